"""Deformation gradients of tetrahedra and their determinants."""

import numpy as np
from numpy.typing import NDArray

from supple.runtime.kernel_cache import njit


@njit(cache=True)
def deformation_gradients(x, tets, Dm_inv):
    """F = Ds Dm^-1 of every tet: positions (n, 3), tets (m, 4), Dm_inv (m, 3, 3) -> (m, 3, 3)."""
    F = np.empty((len(tets), 3, 3))
    for e in range(len(tets)):
        a = tets[e, 0]
        for i in range(3):
            d0 = x[tets[e, 1], i] - x[a, i]
            d1 = x[tets[e, 2], i] - x[a, i]
            d2 = x[tets[e, 3], i] - x[a, i]
            for j in range(3):
                F[e, i, j] = d0 * Dm_inv[e, 0, j] + d1 * Dm_inv[e, 1, j] + d2 * Dm_inv[e, 2, j]
    return F


def determinants(F: NDArray[np.float64]) -> NDArray[np.float64]:
    """det of every matrix: (m, 3, 3) -> (m,)."""
    a, b, c, d, e, f, g, h, i = F.reshape(-1, 9).T
    with np.errstate(all="ignore"):  # positions that are not finite are reported where they arise
        return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
