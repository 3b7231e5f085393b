"""How large tets become: a bound on their volume from the length of edges, or from the number of tets."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable

from supple.errors import MeshingError
from supple.mesh.meshing.child_process import DAMAGED, DEFAULT_TETS, MesherFailure
from supple.mesh.meshing.spelling import option
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh

logger = logging.getLogger(__name__)

# Tets that a bound on their volume gives, over the least number: a ball with TetGen had 2.5 to 3.3.
TETS_OF_BOUND = 2.5
# TetGen took 15 s for 0.5 million tets, and 177 s for 2.0 million, which it made more than once (two cores, in use).
MANY = 1_000_000
# Of TetGen, which needed 314 to 319 for each tet more, up to two million; fTetWild needs more.
BYTES_OF_TET = 300.0
COUNT_TOLERANCE = 0.1
MOST_TRIES = 6

# Tets for each triangle of a coarse surface, at the usual quality: a ball of 100 to 300 triangles has 5 to 7.
TETS_OF_TRIANGLE, _LEAST_OF_TRIANGLE = 6, 5
# Surfaces of fewer triangles are not reduced further: they lose their shape.
_FEWEST_TRIANGLES = 100
_MOST_SURFACES = 4
# TetGen's failures depend on where single vertices lie: it fills most surfaces of slightly fewer triangles.
_OTHER_TRIANGLES = 0.9
# Ratio of two bounds from which on their meshes show how the number depends on it: TetGen's is uneven over less.
_LEVER = 2.0


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


def automatic_tets(surface: SurfaceMesh, most: int = DEFAULT_TETS) -> int | None:
    """The number of tets to ask for where nobody has given a size: None, the coarsest mesh, where it has no more."""
    return most if TETS_OF_TRIANGLE * len(surface.triangles) > most else None


def fill_with_count(
    surface: SurfaceMesh,
    count: int,
    make: Callable[[SurfaceMesh, float], TetMesh],
    reduce: Callable[[SurfaceMesh, int], SurfaceMesh] | None,
    volume: float,
) -> tuple[TetMesh, SurfaceMesh]:
    """About `count` tets in a surface, which is reduced where its triangles need more; and the surface that was filled.

    Parameters
    ----------
    make : fills a surface with tets of at most a volume [m^3]; reduce : a surface to a number of triangles, or None
        where the triangles must stay
    volume : of the surface, about [m^3]
    """
    fewest = max(_FEWEST_TRIANGLES, count // TETS_OF_TRIANGLE)
    used, best = surface if reduce is None else coarse_enough(surface, count, reduce), None
    for left in reversed(range(_MOST_SURFACES)):
        filled, now = used, len(used.triangles)
        logger.info("filling %d triangles with about %d tets", now, count)
        try:
            mesh = mesh_with_count(lambda bound, filled=filled: make(filled, bound), count, volume)
        except MesherFailure as failure:
            if reduce is None or failure.kind not in DAMAGED or left == 0:
                if best is None:
                    raise
                break
            fewer = int(_OTHER_TRIANGLES * now)
            logger.info("the mesher failed on %d triangles; reducing the surface to %d", now, fewer)
        else:
            made = len(mesh.tets)
            if best is None or made < len(best[0].tets):
                best = mesh, used
            if made <= (1.0 + COUNT_TOLERANCE) * count:
                return mesh, used
            fewer = max(_FEWEST_TRIANGLES, int(now * count / made))
        if reduce is None or left == 0 or fewer >= now:
            break
        used = _reduced(surface, fewer, reduce)
        if len(used.triangles) >= now:
            break
    assert best is not None
    mesh, used = best
    if reduce is None:
        remedy = f"; reduce them with {option('decimate', fewest)}" if fewest < len(used.triangles) else ""
    else:
        remedy = ", and it cannot be reduced further without changing its shape"
    numbers = len(mesh.tets), count, len(used.triangles)
    logger.warning("%d tets instead of %d: the surface of %d triangles needs so many%s", *numbers, remedy)
    return best


def coarse_enough(surface: SurfaceMesh, count: int, reduce: Callable[[SurfaceMesh, int], SurfaceMesh]) -> SurfaceMesh:
    """The surface, reduced where its triangles certainly need more tets than `count`."""
    if _LEAST_OF_TRIANGLE * len(surface.triangles) <= (1.0 + COUNT_TOLERANCE) * count:
        return surface
    return _reduced(surface, max(_FEWEST_TRIANGLES, count // TETS_OF_TRIANGLE), reduce)


def _reduced(surface: SurfaceMesh, triangles: int, reduce: Callable[[SurfaceMesh, int], SurfaceMesh]) -> SurfaceMesh:
    """A surface of so few triangles; of twice as many, and so on, where they would have faults or another shape."""
    while triangles < len(surface.triangles):
        try:
            return reduce(surface, triangles)
        except MesherFailure:
            raise
        except MeshingError as damage:
            logger.info("%s", str(damage).replace("give a larger number", "trying twice as many"))
            triangles *= 2
    return surface


def mesh_with_count(make: Callable[[float], TetMesh], count: int, volume: float) -> TetMesh:
    """The mesh whose number of tets is nearest to `count`, of at most six that are made.

    Parameters
    ----------
    make : makes a mesh whose tets are at most as large as the number given [m^3]
    count : the number of tets to reach within 10 %
    volume : of the whole mesh, about [m^3]

    The number of tets is about inversely proportional to the bound on their volume. Where the surface alone rules (its
    triangles are smaller than such tets), no bound reaches the number: the coarsest mesh is returned.
    That is so where the power law through the last two meshes needs a bound above the whole volume.
    """
    bound = 2.0 * volume / count  # a mean tet is about half as large as the largest
    too_fine, too_coarse = 0.0, math.inf
    best: TetMesh | None = None
    last: tuple[float, int] | None = None  # bound and tets of the mesh before, where these were too many
    for _ in range(MOST_TRIES):
        mesh = make(bound)
        made = len(mesh.tets)
        if best is None or abs(made - count) < abs(len(best.tets) - count):
            best = mesh
        if abs(made - count) <= COUNT_TOLERANCE * count or bound > volume:
            break
        if made > count:
            if last is not None and too_coarse == math.inf and not _reaches(count, last, (bound, made), volume):
                break
            too_fine, last = max(too_fine, bound), (bound, made)
        else:
            too_coarse = min(too_coarse, bound)
        bound *= made / count
        if not too_fine < bound < too_coarse:
            bound = math.sqrt(too_fine * too_coarse)
    assert best is not None
    return best


def _reaches(count: int, before: tuple[float, int], now: tuple[float, int], volume: float) -> bool:
    """Whether the power law through two meshes (bound, tets) has so few tets at some bound below the whole volume."""
    (small, many), (large, fewer) = before, now
    if large < _LEVER * small:
        return True
    slope = math.log(many / fewer) / math.log(large / small)
    return slope > 0.0 and math.log(fewer / count) <= slope * math.log(volume / large)
