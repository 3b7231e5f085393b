"""One value for each tet, for coloring."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.materials.edges_and_volume import EdgesAndVolume
from supple.materials.material import Elastic
from supple.materials.patches.energy import tet_shares
from supple.numerics.deformation import deformation_gradients, determinants
from supple.system import System

QUANTITIES = ("J", "von_mises", "energy")


@np.errstate(all="ignore")
def tet_values(system: System, positions: NDArray[np.float64], quantity: str) -> NDArray[np.float64]:
    """(m,) of every tet: "J" [-], "von_mises" stress [Pa], or "energy" density per rest volume [J/m^3].

    Stress and energy are those of the material of the body; 0 where it has none (`EdgesAndVolume` has no stress).
    """
    F = deformation_gradients(positions, system.tets, system.rest_shape_inverse)
    J = determinants(F)
    if quantity == "J":
        return J
    values = np.zeros(len(J))
    for part in system.bodies:
        material, rows = part.body.material, part.tets
        if isinstance(material, EdgesAndVolume):
            if quantity == "energy" and material.volume_compliance > 0.0:
                volumes = system.rest_volumes[rows]
                values[rows] = 0.5 * (J[rows] - 1.0) ** 2 * volumes / material.volume_compliance
        elif isinstance(material, Elastic):
            if quantity == "energy":
                values[rows] = material.energy_density(F[rows])
            else:
                values[rows] = von_mises(material.first_piola(F[rows]), F[rows], J[rows])
    if quantity == "energy" and system.patches is not None:
        values[system.patches.rows] = tet_shares(system.patches, positions) / system.patches.tet_volumes
    return np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)


def von_mises(P: NDArray[np.float64], F: NDArray[np.float64], J: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m,) sqrt(3/2 s:s) of the Cauchy stress s + p I = P F^T / J, from first Piola stresses P (m, 3, 3) [Pa]."""
    cauchy = np.einsum("eij,ekj->eik", P, F) / J[:, None, None]
    pressure = np.trace(cauchy, axis1=1, axis2=2) / 3.0
    deviator = cauchy - pressure[:, None, None] * np.eye(3)
    return np.sqrt(1.5 * np.einsum("eij,eij->e", deviator, deviator))
