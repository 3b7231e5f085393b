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

from supple.model.system import System
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.constraints.block_of_two import (
    constants_of_tet,
    deformation_of,
    moved_by_stress,
    stress_of_step,
)
from supple.solvers.xpbd.constraints.stable_neo_hookean import StableNeoHookeanConstraints
from supple.solvers.xpbd.sweeps.groups import FLAGS, WIDTH, nine, put_twelve, twelve

if TYPE_CHECKING:
    from supple.solvers.xpbd.constraints.registry import ConstraintSet

# Below this J the displacement du does not grow.
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
        """Record the positions (n + a, 4) before a sweep."""
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


@njit(cache=True, fastmath=FLAGS)
def _works(before, after, corners, counts, active, data, pointers, h2, out):
    """Sweep over `before` as `Sweep` does: even chunks, then odd ones."""
    X, Y, sums = np.zeros((12, WIDTH)), np.zeros((12, WIDTH)), np.zeros((3, WIDTH))
    for parity in range(2):
        for chunk in range(parity, len(pointers) - 1, 2):
            for g in range(pointers[chunk], pointers[chunk + 1]):
                if active[g]:
                    for lane in range(counts[g]):
                        _gather(before, corners[g, lane], lane, X)
                        _gather(after, corners[g, lane], lane, Y)
                    _works_of_group(X, Y, data, g, h2, sums)
                    for lane in range(counts[g]):
                        for c in range(4):
                            for j in range(3):
                                before[corners[g, lane, c], j] = X[3 * c + j, lane]
                        for j in range(3):
                            out[g, j] += sums[j, lane]


@njit(forceinline=True)
def _gather(x, corners, lane, out):
    for c in range(4):
        for j in range(3):
            out[3 * c + j, lane] = x[corners[c], j]


@njit(fastmath=FLAGS, forceinline=True)
def _works_of_group(X, Y, data, g, h2, sums):
    """Project the tets in the columns of X, and set what each adds to the sums, with its positions Y afterwards."""
    for i in range(WIDTH):
        b = nine(data[g], i)
        material, k, w = constants_of_tet(data, g, i)
        step = min(h2, material[3])
        x = twelve(X, i)
        f, c, J = deformation_of(x, b)
        s = stress_of_step(f, c, J, material, k, step)
        put_twelve(X, i, moved_by_stress(x, w, b, s, step))
        f, c, J = deformation_of(twelve(Y, i), b)
        t = stress_of_step(f, c, J, material, k, 0.0)
        lacks, has = 0.0, 0.0
        for j in range(9):
            u = 0.5 * (f[j] - c[j] / max(J, LEAST_J))
            lacks += (t[j] - s[j] * step / h2) * u
            has += t[j] * u
        sums[0, i], sums[1, i], sums[2, i] = lacks, has, abs(lacks)
