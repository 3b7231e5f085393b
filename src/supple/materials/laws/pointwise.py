"""Energy densities, stresses and Hessians at given deformation gradients, of materials of any kind.

Materials that flow are not in them: see `supple.materials.laws.internal`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.materials.isotropic import densities, hessians, piolas
from supple.materials.per_tet import BY_LAW, TetMaterial


def densities_at(material: TetMaterial, F: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m,) energy densities [Pa] of F (m, 3, 3)."""
    out = np.empty(len(F))
    densities(F, material.kind, material.mu, material.lam, out)
    out[material.kind == BY_LAW] = 0.0
    for tets in material.elastic_laws:
        out[tets.rows] += tets.law.densities(F[tets.rows], tets.parameters)
    return out


def piolas_at(material: TetMaterial, F: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, 3, 3) first Piola stresses [Pa] of F (m, 3, 3)."""
    out = np.empty((len(F), 3, 3))
    piolas(F, material.kind, material.mu, material.lam, out)
    out[material.kind == BY_LAW] = 0.0
    for tets in material.elastic_laws:
        out[tets.rows] += tets.law.models(F[tets.rows], tets.parameters, False, False)[1]
    return out


def hessians_at(material: TetMaterial, F: NDArray[np.float64], project: bool) -> NDArray[np.float64]:
    """(m, 9, 9) Hessians [Pa] of F (m, 3, 3); with `project`, positive semi-definite."""
    out = np.empty((len(F), 9, 9))
    hessians(F, material.kind, material.mu, material.lam, project, out)
    out[material.kind == BY_LAW] = 0.0
    for tets in material.elastic_laws:
        out[tets.rows] += tets.law.models(F[tets.rows], tets.parameters, True, project)[2]
    return out
