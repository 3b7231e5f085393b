"""What is measured on a state: energies, momenta, and the smallest J."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.stress import (
    energy_densities,
    least_ratios,
    mean_deformation_gradients,
)
from supple.model.state import State
from supple.model.system import System
from supple.scene.stitches.measures import largest_stitch_stretch, stitch_energy


@dataclass(frozen=True, eq=False)
class Diagnostics:
    """Measured on one state.

    Attributes
    ----------
    min_det_F : smallest J over all tets, of quadratic ones at their nodes and quadrature points; of triangles of shells
        their area over that at rest, of edges of rods their length [-]
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

    @property
    def energy(self) -> float:
        """The sum of the four energies [J]."""
        return self.kinetic_energy + self.elastic_energy + self.potential_energy + self.stitch_energy


@np.errstate(over="ignore", invalid="ignore")
def measure(system: System, state: State) -> Diagnostics:
    """Measure a state. Where its numbers are too large for double precision, the results are not finite."""
    m, x, v = system.masses, state.positions, state.velocities
    center = m @ x / m.sum()
    momentum = m @ v
    laws, stitching = system.laws_at(state.time), system.stitching
    F = mean_deformation_gradients(laws, x)
    points = stitching.points(x, state.time)
    elastic = float((energy_densities(laws, x, F, state.internal) * laws.volumes)[laws.known].sum())
    smallest = float(least_ratios(laws, x, F).min(initial=np.inf))
    if system.shells is not None:
        elastic += system.shells.energy(x)
        smallest = min(smallest, float(system.shells.area_ratios(x).min()))
    if system.rods is not None:
        elastic += system.rods.energy(x)
        smallest = min(smallest, 1.0 + float(system.rods.stretches(x).min()))
    return Diagnostics(
        min_det_F=smallest,
        kinetic_energy=0.5 * float(m @ np.einsum("ij,ij->i", v, v)),
        elastic_energy=elastic,
        potential_energy=-float((m @ x) @ system.gravity),
        stitch_energy=stitch_energy(stitching, points) if len(stitching) else 0.0,
        largest_stitch_stretch=largest_stitch_stretch(stitching, points) if len(stitching) else None,
        linear_momentum=momentum,
        angular_momentum=m @ np.cross(x - center, v - momentum / m.sum()),
    )
