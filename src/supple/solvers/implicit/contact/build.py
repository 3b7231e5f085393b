"""Builds the contact model of a system."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.contact_mesh import contact_mesh
from supple.contact.mesh.obstacles import obstacle_positions, with_obstacles
from supple.model.stitched_points import stitched_state
from supple.model.system import System, initial_state
from supple.scene.contact_pairs import pair_table
from supple.solvers.implicit.contact.collisions import Collisions
from supple.solvers.implicit.contact.half_spaces import Planes
from supple.solvers.implicit.contact.model import ContactModel
from supple.solvers.implicit.contact.settings import IPCContact, largest_dhat, scales_of


def contact_model(system: System, settings: IPCContact, shear_moduli: NDArray[np.float64]) -> ContactModel:
    """The model, whose `system` has the obstacles' vertices.

    Parameters
    ----------
    shear_moduli : (m,) of the tets [Pa]
    """
    extended, obstacles = with_obstacles(system)
    table = pair_table(system.scene)
    begun = stitched_state(extended, initial_state(system.scene)).positions
    placed = np.concatenate([begun, obstacle_positions(obstacles, 0.0)])
    mesh = contact_mesh(extended, obstacles, table.collide, placed)
    widest = largest_dhat(system)
    planes, collisions = Planes(mesh, obstacles, table.collide, widest), Collisions(mesh, widest)
    # A run that is continued keeps its dhat: what rests on something is nearer to it than at the start.
    gaps = []
    for start in system.start_states:
        there = stitched_state(extended, start).positions
        x = np.concatenate([there, obstacle_positions(obstacles, start.time)])
        heights = planes.heights(x)  # vertices behind a plane are an error that is found later
        gaps.append(min(collisions.smallest_distance(x), float(heights[heights > 0.0].min(initial=np.inf))))
    scales = scales_of(settings, system, shear_moduli, max(gaps, default=np.inf))
    return ContactModel(
        system=extended,
        obstacles=obstacles,
        mesh=mesh,
        collisions=Collisions(mesh, scales.dhat),
        planes=Planes(mesh, obstacles, table.collide, scales.dhat),
        table=table,
        scales=scales,
        friction_iterations=settings.friction_iterations,
    )
