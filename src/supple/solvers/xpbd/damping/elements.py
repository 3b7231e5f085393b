"""What resists in Kelvin-Voigt damping: tetrahedra and springs, with their stiffness and their times tau.

A damped constraint with stiffness k has the viscosity tau k. An edge or a volume that is so stiff that a substep of h
keeps it rigid, h^2 k sum w |grad C|^2 >> 1, has no rate of its own to resist, and its viscosity goes to zero:
tau k / (1 + h^2 k sum w |grad C|^2)^2. The slope sum w |grad C|^2 is 0 in what follows for all other elements.

Constants are those of the laws in `forces`; the last one is tau.
"""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.materials.elastic import EdgesAndVolume
from supple.materials.material import Elastic
from supple.model.system import BodyRange, System


def damped_tets(system: System, inverse_masses: NDArray[np.float64]) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Vertices (m, 4) and constants (m, 13) of all damped tetrahedra of bodies and stitches that can move.

    Parameters
    ----------
    inverse_masses : (n + a,) of the vertices and of the stitches' anchors [1/kg]
    """
    made = [_of_body(system, part, inverse_masses) for part in system.bodies]
    stitches = system.stitching.tets
    moduli = stitches.mu, stitches.lam, stitches.rest_volumes
    made.append((stitches.vertices, _constants(stitches.rest_shape_inverse, *moduli, stitches.damping)))
    vertices, constants = (np.concatenate(column) for column in zip(*made, strict=True))
    return _chosen(vertices, constants, constants[:, 9] + constants[:, 10], inverse_masses)


def _of_body(system: System, part: BodyRange, w: NDArray[np.float64]) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    corners, Dm_inv, V = system.tets[part.tets], system.rest_shape_inverse[part.tets], system.rest_volumes[part.tets]
    material = part.body.material
    if not isinstance(material, EdgesAndVolume):
        tet = cast(Elastic, material).per_tet(len(V))
        return corners, _constants(Dm_inv, tet.mu, tet.lam, V, tet.damping)
    b = np.concatenate([-Dm_inv.sum(axis=1, keepdims=True), Dm_inv], axis=1)
    slope = np.einsum("tp,tpi,tpi->t", w[corners], b, b)
    columns = [np.zeros(len(V)), V**2 * _stiffness(material.volume_compliance), slope, np.full(len(V), _tau(part))]
    return corners, np.column_stack([Dm_inv.reshape(-1, 9), *columns])


def _constants(Dm_inv: NDArray, mu: NDArray, lam: NDArray, V: NDArray, tau: NDArray) -> NDArray[np.float64]:
    """Of stable Neo-Hookean tets, whose bulk modulus at rest is lam - mu / 3; that of a stitch may be negative."""
    return np.column_stack([Dm_inv.reshape(-1, 9), mu * V, np.maximum(lam - mu / 3.0, 0.0) * V, np.zeros(len(V)), tau])


def damped_springs(
    system: System, inverse_masses: NDArray[np.float64]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Vertices (m, 3) and constants (m, 4) of all damped edges of bodies and springs of stitches that can move.

    The last two vertices are the same where a spring ends at a vertex. `inverse_masses` as above.
    """
    springs = system.stitching.springs
    columns = [springs.place, springs.stiffness, np.zeros(len(springs)), springs.damping]
    made = [(springs.vertices, np.column_stack(columns))]
    for part in system.bodies:
        material = part.body.material
        if isinstance(material, EdgesAndVolume):
            ends = system.edges[part.edges][:, [0, 1, 1]]
            slope = inverse_masses[ends[:, :2]].sum(axis=1)
            own = [np.zeros_like(slope), np.full_like(slope, _stiffness(material.edge_compliance)), slope]
            made.append((ends, np.column_stack([*own, np.full_like(slope, _tau(part))])))
    vertices, constants = (np.concatenate(column) for column in zip(*made, strict=True))
    return _chosen(vertices, constants, constants[:, 1], inverse_masses)


def _chosen(
    vertices: NDArray[np.int32], constants: NDArray[np.float64], stiffness: NDArray, w: NDArray[np.float64]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    chosen = (constants[:, -1] * stiffness > 0.0) & (w[vertices] > 0.0).any(axis=1)
    return np.ascontiguousarray(vertices[chosen]), np.ascontiguousarray(constants[chosen])


def _stiffness(compliance: float) -> float:
    """0 where the constraint is rigid; see the module."""
    return 1.0 / compliance if compliance > 0.0 else 0.0


def _tau(part: BodyRange) -> float:
    damping = part.body.material.damping
    if np.ndim(damping):
        raise SolverError(
            f"XPBD: body {part.name!r}: EdgesAndVolume needs one damping for the whole body; give a number"
        )
    return float(damping)
