"""How large tets become: a bound on their volume from the length of edges, or from the number of tets.

Where a mesh becomes much larger than what was asked for, whoever wants it is asked.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from supple.errors import MeshingError
from supple.mesh.meshing.meshers import TETS_OF_SQUARE
from supple.mesh.meshing.option_names import option
from supple.mesh.surface import SurfaceMesh

logger = logging.getLogger(__name__)

# Tets that a bound on their volume gives, over the least number: a ball with TetGen had 2.5 to 3.3.
TETS_OF_BOUND = 2.5
# TetGen took 15 s for 0.5 million tets, and 177 s for 2.0 million, which it made more than once (two cores, in use).
MANY = 1_000_000
# Of TetGen, which needed 314 to 319 for each tet more, up to two million.
BYTES_OF_TET = 300.0
# Walls may be so many times thinner than edges are long: the smallest angle between the sides of a regular prism's tets
# is then 7 degrees.
MOST_SLENDER = 8.0
# A mesh of more times the tets that were asked for is another thing than what was asked for.
MOST_TIMES = 10.0


def volume_of_edge(edge: float) -> float:
    """The volume of a regular tetrahedron with edges of this length [m^3]."""
    return edge**3 / (6.0 * math.sqrt(2.0))


def edge_of_volume(volume: float) -> float:
    """The edge of a regular tetrahedron of this volume [m]."""
    return (6.0 * math.sqrt(2.0) * volume) ** (1.0 / 3.0)


def warn_of_many(tets: float, volume: float, seconds: float) -> None:
    """Log before the start where about so many tets of a whole volume [m^3] may take longer than a time limit [s].

    It is not a refusal: the time depends on the machine, and the limit ends the mesher.
    """
    if tets >= MANY:
        edge = edge_of_volume(TETS_OF_BOUND * volume / MANY)
        logger.warning(
            "about %.2g tets are expected: the mesher may reach its time limit of %g s; "
            "ask for fewer (%s, or %s), or raise %s",
            *(tets, seconds, option("tets", MANY // 2), option("edge", float(f"{edge:.2g}")), option("time_limit")),
        )


def refuse_too_many(tets: float, memory: int | None) -> None:
    """Raise `MeshingError` where so many tets do not fit into the memory [bytes] of a mesher."""
    if memory is not None and BYTES_OF_TET * tets > memory:
        raise MeshingError(
            f"at least {tets:.3g} tets do not fit into the memory limit of {memory / 2**20:.0f} MiB; ask for fewer "
            f"({option('tets')}, or a larger {option('edge')}), or raise {option('memory_limit')}"
        )


def tets_of_walls(surface: SurfaceMesh, tets: int) -> int:
    """The number of tets to ask for: as wanted, or more where tets would be longer than eight times a wall's thickness.

    The thickness is the mean one, twice the volume over the area. It takes no time, and is that of shells and sheets.

    Raises
    ------
    MeshingError : where ten times as many are needed, and nobody agrees to that.
    """
    thickness, needed = needed_by_walls(surface)
    if needed <= tets:
        return tets
    walls = f"its walls are {thickness:.2g} m thick on average: tets that are at most {MOST_SLENDER:g} times as long"
    allow(f"{walls} are about {needed:,}", needed, tets)
    logger.warning("%s are about %s instead of %s", walls, f"{needed:,}", f"{tets:,}")
    return needed


def needed_by_walls(surface: SurfaceMesh) -> tuple[float, int]:
    """The mean thickness of walls [m], and the least number of tets for it."""
    thickness = 2.0 * surface.volume / surface.area
    if thickness <= 0.0:
        return 0.0, 0
    return thickness, math.ceil(TETS_OF_SQUARE * surface.area / (MOST_SLENDER * thickness) ** 2)


def allow(why: str, needed: int, tets: int) -> None:
    """Ask where a surface needs ten times the tets that were asked for.

    Raises
    ------
    MeshingError : where nobody agrees to that; with the remedy.
    """
    if needed <= MOST_TIMES * tets:
        return
    many = f"{why}, {needed / tets:.0f} times the {tets:,} that were asked for"
    if not agreed(many):
        more = option("tets", int(float(f"{1.05 * needed:.2g}")))
        raise MeshingError(f"{many}; ask for them ({more}{beforehand()}), or give a simpler or thicker surface")


# The function that asks, and what says yes beforehand.
_ASK: ContextVar[tuple[Callable[[str], bool], str] | None] = ContextVar("ask", default=None)


@contextmanager
def asking(ask: Callable[[str], bool], beforehand: str) -> Iterator[None]:
    """Meshing inside puts its questions to `ask`, which returns whether to continue; an option says yes
    `beforehand`."""
    token = _ASK.set((ask, beforehand))
    try:
        yield
    finally:
        _ASK.reset(token)


def agreed(question: str) -> bool:
    """The answer; no where nobody is asked, as in a program or a scene file."""
    ask = _ASK.get()
    return ask is not None and ask[0](question)


def beforehand() -> str:
    """The option that says yes beforehand, with a comma; empty where nobody is asked."""
    ask = _ASK.get()
    return "" if ask is None else f", {ask[1]}"
