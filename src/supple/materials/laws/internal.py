"""Internal variables: their start, and the deformation that is left for the elastic law."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.materials.per_tet import LawTets, TetMaterial

# F_i^-1, a measure of all flow so far, and the energy dissipated per rest volume.
COLUMNS = 11
FLOW, DISSIPATED = 9, 10
NEVER_FLOWED = np.zeros((0, COLUMNS))


def at_rest(count: int) -> NDArray[np.float64]:
    """(count, 11) the internal variables of what has never flowed."""
    rows = np.zeros((count, COLUMNS))
    rows[:, [0, 4, 8]] = 1.0
    return rows


def count_of(material: TetMaterial) -> int:
    """How many rows of internal variables these tets have."""
    return sum(len(tets.rows) * tets.points for tets, _ in material.flowing_laws)


def checked(material: TetMaterial, internal: NDArray[np.float64]) -> NDArray[np.float64]:
    """The internal variables of these tets: those given, or those at rest where none are given.

    Raises
    ------
    SceneError : where another number of them is given.
    """
    count = count_of(material)
    if len(internal) == count:
        return internal
    if len(internal) == 0:
        return at_rest(count)
    raise SceneError(
        f"the state has {len(internal)} rows of internal variables, and the scene {count}; give a state of this scene"
    )


def tets_of(material: TetMaterial) -> NDArray[np.int64]:
    """(k,) the tet of every row."""
    column = (np.repeat(tets.rows, tets.points) for tets, _ in material.flowing_laws)
    return np.concatenate([np.zeros(0, dtype=np.int64), *column])


def rows_of_points(material: TetMaterial) -> NDArray[np.int64]:
    """(k,) the rows that belong to points of quadratic tets, in their order."""
    column = (np.arange(rows.start, rows.stop) for tets, rows in material.flowing_laws if tets.points > 1)
    return np.concatenate([np.zeros(0, dtype=np.int64), *column])


def inverse_flow(internal: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, 3, 3) F_i^-1."""
    return np.ascontiguousarray(internal[:, :9]).reshape(-1, 3, 3)


def flowed(internal: NDArray[np.float64], V: NDArray[np.float64], strains: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, 3, 3) F_i^-1 after flow by the logarithmic strains (k, 3) along V (k, 3, 3) of the trial F_e."""
    return inverse_flow(internal) @ (V * np.exp(-strains)[:, None, :]) @ np.swapaxes(V, 1, 2)


def add_densities(
    material: TetMaterial, F: NDArray[np.float64], internal: NDArray[np.float64], out: NDArray[np.float64]
) -> None:
    """Add the stored energy densities [Pa] of what flows in linear tets to `out` (m,), from F (m, 3, 3)."""
    rows = checked(material, internal)
    for tets, own in _in_linear_tets(material):
        out[tets.rows] += tets.law.densities(F[tets.rows] @ inverse_flow(rows[own]), tets.parameters)


def add_piolas(
    material: TetMaterial, F: NDArray[np.float64], internal: NDArray[np.float64], out: NDArray[np.float64]
) -> None:
    """Add the first Piola stresses [Pa] of what flows in linear tets to `out` (m, 3, 3): P = P_e F_i^-T."""
    rows = checked(material, internal)
    for tets, own in _in_linear_tets(material):
        G = inverse_flow(rows[own])
        P = tets.law.models(F[tets.rows] @ G, tets.parameters, False, False)[1]
        out[tets.rows] += P @ np.swapaxes(G, 1, 2)


def _in_linear_tets(material: TetMaterial) -> list[tuple[LawTets, slice]]:
    return [(tets, own) for tets, own in material.flowing_laws if tets.points == 1]


def add_resting_densities(material: TetMaterial, F: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """As `add_densities`, of what has never flowed."""
    add_densities(material, F, NEVER_FLOWED, out)


def add_resting_piolas(material: TetMaterial, F: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """As `add_piolas`, of what has never flowed."""
    add_piolas(material, F, NEVER_FLOWED, out)


def add_resting_hessians(
    material: TetMaterial, F: NDArray[np.float64], project: bool, out: NDArray[np.float64]
) -> None:
    """Add the Hessians [Pa] to `out` (m, 9, 9) of what has never flowed, and does not flow."""
    for tets, _ in material.flowing_laws:
        out[tets.rows] += tets.law.models(F[tets.rows], tets.parameters, True, project)[2]
