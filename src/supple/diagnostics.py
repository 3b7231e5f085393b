"""Measurements on a state: energies, momenta, and the most compressed tetrahedron."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.materials.edges_and_volume import EdgesAndVolume
from supple.materials.material import Elastic
from supple.numerics.kernel_cache import njit
from supple.scene.stitches.measures import largest_stitch_stretch, stitch_energy
from supple.state import State
from supple.system import BodyRange, System


@dataclass(frozen=True, eq=False)
class Diagnostics:
    """Measured on one state.

    Attributes
    ----------
    min_det_F : smallest J over all tets [-]
    kinetic_energy, elastic_energy : [J], elastic from the rest state
    potential_energy : of gravity [J], zero where all mass is at the origin
    stitch_energy : of all stitches, from their rest state [J]
    largest_stitch_stretch : see `supple.scene.stitches.measures`; None without stitches
    linear_momentum : (3,) [kg m/s]; angular_momentum : (3,) about the center of mass [kg m^2/s]
    """

    min_det_F: float
    kinetic_energy: float
    elastic_energy: float
    potential_energy: float
    stitch_energy: float
    largest_stitch_stretch: float | None
    linear_momentum: NDArray[np.float64]
    angular_momentum: NDArray[np.float64]


@np.errstate(over="ignore", invalid="ignore")
def measure(system: System, state: State) -> Diagnostics:
    """Measure a state. Where its numbers are too large for double precision, the results are not finite."""
    m, x, v = system.masses, state.positions, state.velocities
    center = m @ x / m.sum()
    momentum = m @ v
    F = deformation_gradients(x, system.tets, system.rest_shape_inverse)
    J = determinants(F)
    stitching = system.stitching
    points = stitching.points(x, state.time)
    return Diagnostics(
        min_det_F=float(J.min()),
        kinetic_energy=0.5 * float(m @ np.einsum("ij,ij->i", v, v)),
        elastic_energy=sum(_elastic_energy(system, part, x, F[part.tets], J[part.tets]) for part in system.bodies),
        potential_energy=-float((m @ x) @ system.gravity),
        stitch_energy=stitch_energy(stitching, points) if len(stitching) else 0.0,
        largest_stitch_stretch=largest_stitch_stretch(stitching, points) if len(stitching) else None,
        linear_momentum=momentum,
        angular_momentum=m @ np.cross(x - center, v - momentum / m.sum()),
    )


def _elastic_energy(system: System, part: BodyRange, x: NDArray, F: NDArray, J: NDArray) -> float:
    material = part.body.material
    volumes = system.rest_volumes[part.tets]
    if isinstance(material, EdgesAndVolume):
        energy = 0.0
        if material.edge_compliance > 0.0:
            ends = system.edges[part.edges]
            C = np.linalg.norm(x[ends[:, 0]] - x[ends[:, 1]], axis=1) - system.rest_lengths[part.edges]
            energy += 0.5 * float(C @ C) / material.edge_compliance
        if material.volume_compliance > 0.0:
            C = (J - 1.0) * volumes
            energy += 0.5 * float(C @ C) / material.volume_compliance
        return energy
    if isinstance(material, Elastic):
        return float(material.energy_density(F) @ volumes)
    return 0.0


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


@njit(cache=True)
def determinants(F):
    """det of every matrix: (m, 3, 3) -> (m,)."""
    J = np.empty(len(F))
    for e in range(len(F)):
        f = F[e]
        J[e] = (
            f[0, 0] * (f[1, 1] * f[2, 2] - f[1, 2] * f[2, 1])
            - f[0, 1] * (f[1, 0] * f[2, 2] - f[1, 2] * f[2, 0])
            + f[0, 2] * (f[1, 0] * f[2, 1] - f[1, 1] * f[2, 0])
        )
    return J
