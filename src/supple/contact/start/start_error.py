"""The one line that says why a scene cannot start, and how to mend it."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from supple.contact.start.intersections import intersections_of
from supple.contact.start.separation import Mover, default_gap
from supple.contact.start.surfaces import start_surfaces
from supple.errors import SceneError
from supple.scene.contact_pairs import PairTable
from supple.system import System


def refuse_intersecting(
    system: System,
    positions: NDArray[np.float64],
    time: float,
    table: PairTable,
    ignored: Collection[tuple[int, int]] = (),
    sewn: Collection[tuple[int, int]] = (),
) -> None:
    """Raise where surfaces are not apart at the start. Other parameters: see `find_intersections`.

    Parameters
    ----------
    sewn : pairs of things, ascending, that may meet where they are stitched; named only where nothing else is wrong

    Raises
    ------
    SceneError : one line: which things, which triangles, where, how deep, and the mend.
    """
    surfaces = start_surfaces(system, positions, time)
    found = intersections_of(surfaces, table, ignored)
    if not found:
        return
    found = [item for item in found if (item.first, item.second) not in sewn] or found
    mover = Mover(system, table, default_gap(system))
    worst = next((item for item in found if item.kind != "touches"), found[0])
    way = mover.way_out(surfaces, worst)
    deep = f", about {worst.depth:.2g} m deep" if worst.depth > 0.0 else ""
    more = f" ({len(found) - 1} more such {'pair' if len(found) == 2 else 'pairs'})" if len(found) > 1 else ""
    if way is None:
        mend = mover.why_not(worst)
    else:
        body, shift = way
        deep = f", about {max(float(np.linalg.norm(shift)) - mover.gap, 0.0):.2g} m deep" if deep else ""
        by = "({:.4g}, {:.4g}, {:.4g})".format(*(shift + 0.0))
        mend = f"move {mover.names[body]} by {by}, or let `supple run --separate` move it"
    raise SceneError(f"{mover.say(worst)}{deep}; {mend}{more}")
