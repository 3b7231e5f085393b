"""The error message for a scene whose surfaces intersect at the start."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.start.intersections import intersections_of
from supple.contact.start.separation import Mover, default_gap
from supple.contact.start.surfaces import start_surfaces
from supple.errors import SceneError
from supple.model.system import System
from supple.scene.contact_pairs import PairTable


def raise_if_intersecting(
    system: System, positions: NDArray[np.float64], time: float, table: PairTable, joined: bool = True
) -> None:
    """Raise where surfaces are not apart at the start. Things that are stitched or welded are named last.

    Parameters
    ----------
    positions : (n, 3) of the system's vertices [m]; time : [s], where scripted obstacles are
    table : which things collide; joined : also those that are stitched or welded to each other

    Raises
    ------
    SceneError : one line: which things, which triangles, where, how deep, and the remedy.
    """
    surfaces = start_surfaces(system, positions, time)
    found = intersections_of(surfaces, table)
    names = [str(thing.name) for thing in (*system.bodies, *system.obstacles)]
    stitched = [{names.index(stitch.first), names.index(stitch.second)} for stitch in system.scene.stitches]
    stitched += [{names.index(weld.body), names.index(weld.rigid)} for weld in system.scene.welds]
    others = [item for item in found if {item.first, item.second} not in stitched]
    found = others or found if joined else others
    if not found:
        return
    mover = Mover(system, table, default_gap(system))
    worst = next((item for item in found if item.kind != "touches"), found[0])
    move = mover.separating_move(surfaces, worst)
    deep = f", about {worst.depth:.2g} m deep" if worst.depth > 0.0 else ""
    more = f" ({len(found) - 1} more such {'pair' if len(found) == 2 else 'pairs'})" if len(found) > 1 else ""
    if move is None:
        remedy = mover.remedy(worst)
    else:
        body, shift = move
        deep = f", about {max(float(np.linalg.norm(shift)) - mover.gap, 0.0):.2g} m deep" if deep else ""
        by = "({:.4g}, {:.4g}, {:.4g})".format(*(shift + 0.0))
        remedy = f"move {mover.names[body]} by {by}, or run `supple run --separate`, which moves it"
    raise SceneError(f"{mover.description(worst)}{deep}; {remedy}{more}")
