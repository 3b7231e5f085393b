"""How much of their stiffness bodies lack in a substep, measured: work of the stresses that a sweep delivered.

A sweep projects each tet from positions y that other tets have changed; the impulse that it delivers is that of a
stress S(y), while the material has the stress T(x) at the positions x in which the substep ends. Over a displacement u
the body resists with the sum of S : du instead of T : du. With the body's own strain, du = (F - F^-T) / 2, the share

    e = sum V (T - S) : du / sum V T : du

is what a body lacks of its stiffness against its present deformation. At rest, where the elastic law is linear, the
work of a load f is f . x = (1 - e) x . K x; as f . K^-1 f >= 2 f . y - y . K y for y = (1 - e) x, it is at most
f . K^-1 f / (1 - e): a body gives way by at most e / (1 - e) too much. What tets alone lack and have too much is
larger, and cancels in the sum.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from supple.numerics.kernel_cache import njit
from supple.system import System
from supple.xpbd.constraints.block_of_two import constants_of_tet, deformation_of, stress_of_step
from supple.xpbd.constraints.stable_neo_hookean import StableNeoHookeanConstraints
from supple.xpbd.sweeps.compilation import FLAGS
from supple.xpbd.sweeps.lanes import nine

if TYPE_CHECKING:
    from supple.xpbd.constraints.registry import ConstraintSet

# Below this J the displacement du no longer grows.
LEAST_J = 0.1


class DeliveredWork:
    """Measures a substep of the tets of all bodies.

    Parameters
    ----------
    system : in the solver's numbering; sets : its constraints
    """

    def __init__(self, system: System, sets: Iterable[ConstraintSet]) -> None:
        self._sets = [each for each in sets if isinstance(each, StableNeoHookeanConstraints)]
        self._bodies = len(system.bodies)
        starts = [part.vertices.start for part in system.bodies]
        # No group has tets of two bodies.
        self._body = [np.searchsorted(starts, each.sweep.groups[0][:, 0, 0], side="right") - 1 for each in self._sets]
        self._before = np.zeros((0, 4))
        self._begun = False

    def begin(self, extended: NDArray[np.float64]) -> None:
        """Take notice of the positions (n + a, 4) before a sweep."""
        if self._sets:
            self._before = extended.copy()
            self._begun = True

    def end(self, points: NDArray[np.float64], h: float) -> NDArray[np.float64]:
        """(b, 3) sums of V (T - S) : du, of V T : du, and of the sizes of the first [J], in that substep of h [s].

        Zeros where no substep has begun.

        Parameters
        ----------
        points : (n, 4) at its end
        """
        sums = np.zeros((self._bodies, 3))
        if self._begun:
            for each, body in zip(self._sets, self._body, strict=True):
                found = np.zeros((len(body), 3))
                _works(self._before, points, *each.sweep.groups, h * h, found)
                np.add.at(sums, body, found)
        self._begun = False
        return sums


@njit(cache=True, fastmath=FLAGS, error_model="numpy")
def _works(before, after, corners, counts, active, data, pointers, h2, out):
    """Sweep over `before` as `Sweep` does: even chunks, then odd ones."""
    for parity in range(2):
        for chunk in range(parity, len(pointers) - 1, 2):
            for g in range(pointers[chunk], pointers[chunk + 1]):
                if active[g]:
                    for lane in range(counts[g]):
                        _add_tet(before, after, corners[g, lane], data, g, lane, h2, out[g])


@njit(fastmath=FLAGS, error_model="numpy")
def _add_tet(before, after, corners, data, g, lane, h2, out):
    b = nine(data[g], lane)
    material, k, w = constants_of_tet(data, g, lane)
    step = min(h2, material[3])
    f, c, J = deformation_of(_places(before, corners), b)
    s = stress_of_step(f, c, J, material, k, step)
    for j in range(3):
        d1 = s[3 * j] * b[0] + s[3 * j + 1] * b[1] + s[3 * j + 2] * b[2]
        d2 = s[3 * j] * b[3] + s[3 * j + 1] * b[4] + s[3 * j + 2] * b[5]
        d3 = s[3 * j] * b[6] + s[3 * j + 1] * b[7] + s[3 * j + 2] * b[8]
        before[corners[0], j] += w[0] * step * (d1 + d2 + d3)
        before[corners[1], j] -= w[1] * step * d1
        before[corners[2], j] -= w[2] * step * d2
        before[corners[3], j] -= w[3] * step * d3
    f, c, J = deformation_of(_places(after, corners), b)
    t = stress_of_step(f, c, J, material, k, 0.0)
    lacks, has = 0.0, 0.0
    for j in range(9):
        u = 0.5 * (f[j] - c[j] / max(J, LEAST_J))
        lacks += (t[j] - s[j] * step / h2) * u
        has += t[j] * u
    out[0] += lacks
    out[1] += has
    out[2] += abs(lacks)


@njit(error_model="numpy", forceinline=True)
def _places(x, corners):
    a, b, c, d = corners
    return (
        x[a, 0], x[a, 1], x[a, 2], x[b, 0], x[b, 1], x[b, 2], x[c, 0], x[c, 1], x[c, 2], x[d, 0], x[d, 1], x[d, 2],
    )  # fmt: skip
