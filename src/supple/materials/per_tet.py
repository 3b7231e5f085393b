"""A body's material as arrays with one row per tetrahedron, as solvers read it, for one material or several."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError

NOT_ELASTIC = -1
NO_REGION = -1


@dataclass(frozen=True, eq=False)
class TetMaterial:
    """Material parameters of m tets.

    Attributes
    ----------
    density : (m,) [kg/m^3]; damping : (m,) Kelvin-Voigt time [s]
    kind : (m,) int32, the row of `kinds.STRETCH_ENERGIES`, or `NOT_ELASTIC`
    mu, lam : (m,) parameters of each material's energy density [Pa]
    region : (m,) int32, the region over whose patches the energy of a tet is averaged, or `NO_REGION`
    """

    density: NDArray[np.float64]
    damping: NDArray[np.float64]
    kind: NDArray[np.int32]
    mu: NDArray[np.float64]
    lam: NDArray[np.float64]
    region: NDArray[np.int32]


def one_per_tet(value: ArrayLike, n_tets: int, what: str) -> NDArray[np.float64]:
    """`value` as (n_tets,) float64; one number is repeated.

    Raises
    ------
    SceneError : where there is another number of values.
    """
    values = np.asarray(value, dtype=np.float64)
    if values.ndim and values.shape != (n_tets,):
        raise SceneError(f"{what} has {values.size} values for {n_tets} tets; give one number, or one per tet")
    return np.ascontiguousarray(np.broadcast_to(values, n_tets))
