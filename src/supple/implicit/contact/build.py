"""Builds the contact model of a system."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from supple.contact.collision_mesh.collisions import Collisions
from supple.contact.collision_mesh.contact_surface import contact_surface
from supple.contact.obstacle_vertices import obstacle_positions, with_obstacles
from supple.errors import SolverError
from supple.implicit.contact.half_spaces import Planes
from supple.implicit.contact.model import ContactModel
from supple.implicit.contact.scales import largest_dhat, scales_of
from supple.implicit.contact.settings import IPCContact
from supple.implicit.contact.threads import one_contact_thread
from supple.scene.contact_pairs import pair_table
from supple.system import System, initial_state


def contact_model(system: System, settings: IPCContact, shear_moduli: NDArray[np.float64]) -> ContactModel:
    """The model, whose `system` has the obstacles' vertices.

    Parameters
    ----------
    shear_moduli : (m,) of the tets [Pa]

    Raises
    ------
    SolverError : where the IPC Toolkit is not installed: it has no wheels for Linux on ARM.
    """
    if find_spec("ipctk") is None:
        raise SolverError(
            "Implicit: contact needs the package ipctk, which is not installed (it has no wheels for Linux on ARM); "
            "build it with `pip install 'ipctk>=1.6.1,<1.7'`, give contact=None, or use XPBD"
        )
    import_module("ipctk")
    with one_contact_thread():
        return _contact_model(system, settings, shear_moduli)


def _contact_model(system: System, settings: IPCContact, shear_moduli: NDArray[np.float64]) -> ContactModel:
    extended, obstacles = with_obstacles(system)
    table = pair_table(system.scene)
    placed = np.concatenate([initial_state(system.scene).positions, obstacle_positions(obstacles, 0.0)])
    surface = contact_surface(extended, obstacles, table.collide, placed)
    widest = largest_dhat(system)
    planes, collisions = Planes.of(surface, obstacles, table.collide, widest), Collisions(surface, widest)
    # A run that is continued keeps its dhat: what rests on something is nearer to it than at the start.
    gaps = []
    for start in system.start_states:
        x = np.concatenate([start.positions, obstacle_positions(obstacles, start.time)])
        heights = planes.distances(x)[0]  # vertices behind a plane are an error that is found later
        gaps.append(min(collisions.smallest_distance(x), float(heights[heights > 0.0].min(initial=np.inf))))
    scales = scales_of(settings, system, shear_moduli, max(gaps, default=np.inf))
    return ContactModel(
        system=extended,
        obstacles=obstacles,
        surface=surface,
        collisions=Collisions(surface, scales.dhat),
        planes=Planes.of(surface, obstacles, table.collide, scales.dhat),
        table=table,
        scales=scales,
        friction_iterations=settings.friction_iterations,
    )
