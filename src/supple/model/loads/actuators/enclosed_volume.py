"""The volume that a closed surface encloses, V = -1/6 sum det [a b c] over triangles a, b, c that face inward."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.actuators.actuator import Coordinate
from supple.model.loads.pressure import cross_matrices
from supple.numerics.sparse.couplings import Couplings
from supple.runtime.kernel_cache import njit


@dataclass(frozen=True, eq=False)
class EnclosedVolume(Coordinate):
    """The volume of a cavity.

    Attributes
    ----------
    vertices : (v,); triangles : (t, 3) rows of these, which face into the cavity
    """

    vertices: NDArray[np.int32]
    triangles: NDArray[np.int32]

    @classmethod
    def of(cls, triangles: NDArray[np.integer]) -> EnclosedVolume:
        """Inside of triangles (t, 3) of a system's vertices."""
        vertices, local = np.unique(triangles, return_inverse=True)
        return cls(vertices.astype(np.int32), np.ascontiguousarray(local.reshape(-1, 3), dtype=np.int32))

    def renumbered(self, new: NDArray[np.int32]) -> EnclosedVolume:
        return replace(self, vertices=new[self.vertices])

    @property
    def count(self) -> int:
        return 1

    def measure(self, own: NDArray[np.float64], parts: NDArray[np.float64]) -> None:
        _measure(own, self.triangles, parts)

    def differentiate(
        self, own: NDArray[np.float64], parts: NDArray[np.float64], gradients: NDArray[np.float64]
    ) -> None:
        _differentiate(own, self.triangles, parts, gradients[0])

    def hessian(self, own: NDArray[np.float64], factors: NDArray[np.float64], project: bool) -> Couplings | None:
        """It has no diagonal, so that no part of it is definite."""
        if project or factors[0] == 0.0:
            return None
        i, j, k = self.triangles.T
        a, b, c = (own[corner] - own[0] for corner in (i, j, k))
        blocks = factors[0] / 6.0 * cross_matrices(np.concatenate([c, a, b]))
        rows, columns = np.concatenate([i, j, k]), np.concatenate([j, k, i])
        return Couplings(self.vertices[rows], self.vertices[columns], blocks)


@njit(cache=True)
def _measure(x, triangles, volume):
    """Set volume (1,).

    It is that about the first vertex, which keeps the digits of a small volume far from the origin.
    """
    total = 0.0
    for t in range(len(triangles)):
        n = _third_of_area(x, triangles, t)
        i = triangles[t, 0]
        total -= (x[i, 0] - x[0, 0]) * n[0] + (x[i, 1] - x[0, 1]) * n[1] + (x[i, 2] - x[0, 2]) * n[2]
    volume[0] = total


@njit(cache=True)
def _differentiate(x, triangles, volume, gradient):
    """`_measure`, and set gradient (v, 3): a third of minus the area vector of each triangle at each of its corners."""
    gradient[:] = 0.0
    total = 0.0
    for t in range(len(triangles)):
        n = _third_of_area(x, triangles, t)
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        total -= (x[i, 0] - x[0, 0]) * n[0] + (x[i, 1] - x[0, 1]) * n[1] + (x[i, 2] - x[0, 2]) * n[2]
        for corner in (i, j, k):
            gradient[corner, 0] -= n[0]
            gradient[corner, 1] -= n[1]
            gradient[corner, 2] -= n[2]
    volume[0] = total


@njit
def _third_of_area(x, triangles, t):
    i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    u0, u1, u2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
    v0, v1, v2 = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
    return (u1 * v2 - u2 * v1) / 6.0, (u2 * v0 - u0 * v2) / 6.0, (u0 * v1 - u1 * v0) / 6.0
