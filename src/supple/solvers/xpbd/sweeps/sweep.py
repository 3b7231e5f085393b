"""The sweep over grouped constraints: the one loop that all constraint sets share.

Each group is gathered into a local array with one column per constraint, projected, and written back. The constraints
of a group are independent, so the loop over the columns has no dependences and LLVM makes vector instructions of it.
That needs array shapes that are known at compile time, and inlined projections: a sweep is compiled for each of them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import kernel_with, njit, prange
from supple.solvers.xpbd.sweeps.groups import FLAGS, WIDTH, Groups


class Sweep:
    """Constraints and their constants, ready to be projected.

    Parameters
    ----------
    project : compiled function (X, data, g, h) with `forceinline` that projects the constraints of group g in the
        columns of X (3 k, WIDTH), the positions of their k vertices [m], and reads data[g, :, column]; h is the length
        of a substep [s].
    constraints : (m, k) vertices; constants : (m, c); groups : of these constraints
    """

    def __init__(
        self,
        project: Callable[..., Any],
        constraints: NDArray[np.int32],
        constants: NDArray[np.float64],
        groups: Groups,
    ) -> None:
        # With unsigned indices the kernel needs no test for negative ones.
        self._corners = np.ascontiguousarray(constraints[groups.members], dtype=np.uint32)
        self._groups = groups
        self._data = groups.lanes(constants)
        self._counts, self._pointers = groups.counts, groups.pointers
        self._active = np.ones(len(self._counts), dtype=np.bool_)
        self.kernel = _sweep_of(project, constraints.shape[1])

    @property
    def groups(self) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray]:
        """Vertices (g, WIDTH, k), used lanes (g,), what is active (g,), constants (g, c, WIDTH), starts of chunks."""
        return self._corners, self._counts, self._active, self._data, self._pointers

    def choose(self, inverse_masses: NDArray[np.float64]) -> None:
        """Project only the groups with a vertex that can move, of inverse masses (n,) [1/kg]."""
        self._active[:] = (inverse_masses[self._corners] > 0.0).any(axis=(1, 2))

    def change(self, constants: NDArray[np.float64]) -> None:
        """Replace the constants (m, c)."""
        self._data = self._groups.lanes(constants)

    def write(self, first: int, values: NDArray[np.float64]) -> None:
        """Replace some of the constants, from number `first`: values (m, k)."""
        self._data[:, first : first + values.shape[1]] = values[self._groups.members].transpose(0, 2, 1)

    def read(self, first: int, count: int) -> NDArray[np.float64]:
        """(m, count) what projections have written into these rows of the constants."""
        used = np.arange(self._corners.shape[1]) < self._counts[:, None]
        out = np.empty((int(self._groups.members.max()) + 1, count))
        out[self._groups.members[used]] = self._data[:, first : first + count].transpose(0, 2, 1)[used]
        return out

    def run(self, points: NDArray[np.float64], h: float) -> None:
        """Project every constraint once: see `ConstraintSet.project`."""
        self.kernel(points, self.groups, h)

    def run_measured(self, points: NDArray[np.float64], h: float) -> NDArray[np.float64]:
        """`run`, and the forces (m, k, 3) that it delivered to the vertices of each constraint [N].

        NaN for vertices that cannot move, 0 for constraints that are not active.
        """
        members, active = self._groups.members, self._active.copy()
        forces = np.zeros((int(members.max()) + 1, self._corners.shape[2], 3))
        for g in np.flatnonzero(active):  # one after another, as in `run`
            self._active[:] = False
            self._active[g] = True
            corners = self._corners[g, : self._counts[g]]
            before = points[corners]
            self.run(points, h)
            with np.errstate(divide="ignore", invalid="ignore"):
                moved = (points[corners] - before)[..., :3] / (h * h * before[..., 3:])
            forces[members[g, : self._counts[g]]] = np.where(before[..., 3:] > 0.0, moved, np.nan)
        self._active[:] = active
        return forces


@cache
def _sweep_of(project: Any, corners: int) -> Any:
    name = project.py_func.__qualname__
    chunk = njit(fastmath=FLAGS)(kernel_with(_sweep_chunk, name, project=project, CORNERS=corners))
    return njit(cache=True, parallel=True, rows=0)(kernel_with(_sweep, name, _sweep_chunk=chunk))


if TYPE_CHECKING:  # `kernel_with` gives these names to each copy of `_sweep_chunk`
    CORNERS = 0

    def project(X, data, g, h): ...


def _sweep_chunk(points, corners, counts, active, data, first, last, h):
    X = np.zeros((3 * CORNERS, WIDTH))
    for g in range(first, last):
        if not active[g]:
            continue
        count = counts[g]
        for lane in range(count):
            for c in range(CORNERS):
                p = corners[g, lane, c]
                X[3 * c, lane] = points[p, 0]
                X[3 * c + 1, lane] = points[p, 1]
                X[3 * c + 2, lane] = points[p, 2]
        project(X, data, g, h)
        for lane in range(count):
            for c in range(CORNERS):
                p = corners[g, lane, c]
                points[p, 0] = X[3 * c, lane]
                points[p, 1] = X[3 * c + 1, lane]
                points[p, 2] = X[3 * c + 2, lane]


def _sweep(points, groups, h):
    """Project the even chunks, then the odd ones; groups : see `Sweep.groups`."""
    corners, counts, active, data, pointers = groups
    n_chunks = len(pointers) - 1
    for parity in range(2):
        for k in prange((n_chunks + 1 - parity) // 2):
            c = 2 * k + parity
            _sweep_chunk(points, corners, counts, active, data, pointers[c], pointers[c + 1], h)
