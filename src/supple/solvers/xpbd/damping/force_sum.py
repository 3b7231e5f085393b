"""The sum of the viscous forces of all elements, in the groups and chunks of the sweeps."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import kernel_with, njit, prange
from supple.solvers.xpbd.sweeps.groups import FLAGS, WIDTH, Groups


class ForceSum:
    """Elements whose forces are linear in the velocities.

    Parameters
    ----------
    laws : compiled functions (X, V, k, data, g, h) with `forceinline`, see `forces_of_tets` and `powers_of_tets`
    elements : (m, k) vertices; constants : (m, c); groups : of these elements

    Attributes
    ----------
    members : (g, WIDTH) the elements of each group
    rates : (g,) largest square of a rate of strain of its elements in the last sum [1/s^2]
    powers : (g,) forces times velocities of its elements [W], weighted, see `find_powers`
    """

    def __init__(
        self,
        laws: tuple[Callable[..., Any], Callable[..., Any]],
        elements: NDArray[np.int32],
        constants: NDArray[np.float64],
        groups: Groups,
    ) -> None:
        self._corners = np.ascontiguousarray(elements[groups.members], dtype=np.uint32)
        self._data = groups.lanes(constants)
        self._counts, self._pointers = groups.counts, groups.pointers
        self.members = groups.members
        self.rates, self.powers = np.zeros(len(self._counts)), np.zeros(len(self._counts))
        self._active = np.ones(len(self._counts), dtype=np.bool_)
        self._kernel = _sum_of(laws[0], elements.shape[1])
        self._power_kernel = _powers_of(laws[1], elements.shape[1])

    def choose(self, inverse_masses: NDArray[np.float64]) -> None:
        """Sum only the groups with a vertex that can move, of inverse masses (n,) [1/kg]."""
        self._active[:] = (inverse_masses[self._corners] > 0.0).any(axis=(1, 2))
        self.rates[:] = 0.0

    def add(self, motion: NDArray[np.float64], h: float, out: NDArray[np.float64]) -> None:
        """Add the forces to `out`.

        Parameters
        ----------
        motion : (n, 6) positions [m] and velocities [m/s]; out : (n, 4) [N], and mean diagonal entries of the
            matrix [kg/s]; h : length of the substep [s]
        """
        elements = (self._corners, self._counts, self._active, self._data, self._pointers)
        self._kernel(motion, *elements, h, out, self.rates)

    def find_powers(self, motion: NDArray[np.float64], h: float, weights: NDArray[np.float64]) -> None:
        """Set `powers`, with which the forces resist the velocities, times weights (g,); less work than the forces."""
        elements = (self._corners, self._counts, np.where(self._active, weights, 0.0), self._data, self._pointers)
        self._power_kernel(motion, *elements, h, self.powers)


@cache
def _sum_of(forces: Any, corners: int) -> Any:
    chunk = kernel_with(_sum_chunk, forces.py_func.__qualname__, forces=forces, CORNERS=corners)
    compiled = njit(fastmath=FLAGS)(chunk)
    return njit(cache=True, parallel=True, rows=0)(kernel_with(_sum, forces.py_func.__qualname__, _sum_chunk=compiled))


@cache
def _powers_of(powers: Any, corners: int) -> Any:
    chunk = kernel_with(_power_chunk, powers.py_func.__qualname__, powers=powers, CORNERS=corners)
    compiled = njit(fastmath=FLAGS)(chunk)
    return njit(cache=True, parallel=True, rows=0)(
        kernel_with(_powers, powers.py_func.__qualname__, _power_chunk=compiled)
    )


if TYPE_CHECKING:  # `kernel_with` gives these names to each copy of `_sum_chunk` and `_power_chunk`
    CORNERS = 0

    def forces(X, V, k, data, g, h): ...

    def powers(X, V, k, data, g, h): ...


@njit(forceinline=True)
def _gather(motion, corners, g, count, n_corners, X, V):
    """Positions and velocities of the corners of group g, one element in each column of X and V."""
    for lane in range(count):
        for c in range(n_corners):
            p = corners[g, lane, c]
            X[3 * c, lane] = motion[p, 0]
            X[3 * c + 1, lane] = motion[p, 1]
            X[3 * c + 2, lane] = motion[p, 2]
            V[3 * c, lane] = motion[p, 3]
            V[3 * c + 1, lane] = motion[p, 4]
            V[3 * c + 2, lane] = motion[p, 5]


def _sum_chunk(motion, corners, counts, active, data, first, last, h, out, rates):
    X = np.zeros((3 * CORNERS, WIDTH))
    V = np.zeros((3 * CORNERS, WIDTH))
    k = np.zeros((CORNERS + 1, WIDTH))
    for g in range(first, last):
        if not active[g]:
            continue
        count = counts[g]
        _gather(motion, corners, g, count, CORNERS, X, V)
        forces(X, V, k, data, g, h)
        fastest = 0.0
        for lane in range(count):
            fastest = max(fastest, k[CORNERS, lane])
            for c in range(CORNERS):
                p = corners[g, lane, c]
                out[p, 0] += V[3 * c, lane]
                out[p, 1] += V[3 * c + 1, lane]
                out[p, 2] += V[3 * c + 2, lane]
                out[p, 3] += k[c, lane]
        rates[g] = fastest


def _sum(motion, corners, counts, active, data, pointers, h, out, rates):
    n_chunks = len(pointers) - 1
    for parity in range(2):
        for k in prange((n_chunks + 1 - parity) // 2):
            c = 2 * k + parity
            _sum_chunk(motion, corners, counts, active, data, pointers[c], pointers[c + 1], h, out, rates)


def _power_chunk(motion, corners, counts, weights, data, first, last, h, out):
    X = np.zeros((3 * CORNERS, WIDTH))
    V = np.zeros((3 * CORNERS, WIDTH))
    k = np.zeros((1, WIDTH))
    for g in range(first, last):
        total = 0.0
        if weights[g] > 0.0:
            _gather(motion, corners, g, counts[g], CORNERS, X, V)
            powers(X, V, k, data, g, h)
            for lane in range(counts[g]):
                total += k[0, lane]
        out[g] = weights[g] * total


def _powers(motion, corners, counts, weights, data, pointers, h, out):
    for c in prange(len(pointers) - 1):
        _power_chunk(motion, corners, counts, weights, data, pointers[c], pointers[c + 1], h, out)
