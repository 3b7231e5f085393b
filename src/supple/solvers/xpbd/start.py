"""The error for a scene whose bodies begin inside of something: XPBD would push them apart slowly, or never."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.start.intersections import intersections_of
from supple.contact.start.separation import Mover, default_gap
from supple.contact.start.surfaces import start_surfaces
from supple.errors import SceneError
from supple.model.system import System
from supple.scene.contact_pairs import PairTable, pair_table
from supple.solvers.xpbd.assessment.surfaces import TOLERATED_DEPTH, SurfaceCheck
from supple.solvers.xpbd.contact.settings import XPBDContact, colliding_pairs

_REMEDY = "run `supple run --separate`, which moves it, or give XPBD(start='push_out')"


def raise_if_inside(
    system: System, positions: NDArray[np.float64], time: float, settings: XPBDContact | None, edge_length: float
) -> None:
    """Raise where a body begins inside of an obstacle, of another body or of itself, deeper than contact tolerates.

    Parameters
    ----------
    positions : (n, 3) of the system's vertices [m]; time : [s], where scripted obstacles are
    settings : of contact; edge_length : mean surface edge [m]

    Raises
    ------
    SceneError : one line: which things, where, how deep, and the remedy.
    """
    deep = SurfaceCheck(system, settings, edge_length).depths(positions, time)
    if deep:
        raise SceneError(f"{deep[0]} at the start; move it out, {_REMEDY}{_more(len(deep))}")
    collide = colliding_pairs(system, settings)
    # Obstacles without triangles were measured exactly above; a polyhedron about them is larger.
    bodies = len(system.bodies)
    for k, obstacle in enumerate(system.obstacles):
        if obstacle.contact_mesh is None:
            collide[bodies + k] = collide[:, bodies + k] = False
    table = PairTable(collide, pair_table(system.scene).friction, bodies)
    found = intersections_of(start_surfaces(system, positions, time), table)
    found = [item for item in found if item.kind != "touches" and item.depth > TOLERATED_DEPTH * edge_length]
    if found:
        worst = max(found, key=lambda item: item.depth)
        text = Mover(system, table, default_gap(system)).description(worst)
        raise SceneError(f"{text}, about {worst.depth:.2g} m deep; move it out, {_REMEDY}{_more(len(found))}")


def _more(count: int) -> str:
    return f" ({count - 1} more such {'pair' if count == 2 else 'pairs'})" if count > 1 else ""
