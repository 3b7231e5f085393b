"""From a surface to a tet mesh: checks of the surface, the choice of the mesher, and checks of its result."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from supple.errors import MeshError, MeshingError
from supple.mesh.meshing.child_process import DAMAGED, DEFAULT_TETS, Limits, MesherFailure, MesherResult
from supple.mesh.meshing.decimation import decimate_surface
from supple.mesh.meshing.meshers import (
    INSTALL,
    ftetwild_installed,
    mesh_with_ftetwild,
    mesh_with_mmg,
    mesh_with_tetgen,
)
from supple.mesh.meshing.repair import RepairReport, consistently_oriented, repair_surface
from supple.mesh.meshing.sizes import (
    TETS_OF_BOUND,
    allow,
    edge_of_volume,
    refuse_too_many,
    tets_of_walls,
    volume_of_edge,
    warn_of_many,
)
from supple.mesh.meshing.spelling import option
from supple.mesh.meshing.stuffing import stuffed
from supple.mesh.meshing.surface_fit import distance, fitted
from supple.mesh.surface import SurfaceMesh
from supple.mesh.surface_checks import SurfaceReport
from supple.mesh.tetmesh import TetMesh

logger = logging.getLogger(__name__)

Mesher = Literal["auto", "tetgen", "stuffing", "ftetwild"]

# Of the volume: what is more is said. TetGen's facets are planar to 0.1 degrees; Mmg's are coarser, and fitted.
VOLUME_TOLERANCE = 0.02
# A surface of more triangles for each tet that was asked for is decimated before TetGen, which keeps all: that takes
# most of the time, and changes the volume by this share at most.
DENSE, DENSE_TOLERANCE = 5, 0.01
# TetGen's coarsest mesh of a ball of 100 to 300 triangles has 5 to 7 tets for each triangle.
TETS_OF_TRIANGLE = 6
# Volumes and squares of areas of smaller surfaces are not normal numbers [m].
SMALLEST_LENGTH = 1e-60
DEFAULT_QUALITY = 1.4


@dataclass(frozen=True)
class MeshingReport:
    """How a tet mesh was made.

    Attributes
    ----------
    mesher : "tetgen", "mmg" (which remeshes TetGen's tets), "stuffing" or "ftetwild"; seconds : that it took
    repair : what was repaired first; None where nothing was
    fine, filled : the surface before it was remeshed or reduced, and the boundary of the tets; the same one where it
        was not
    distance : Hausdorff distance between both [m]
    """

    mesher: str
    seconds: float
    repair: RepairReport | None
    fine: SurfaceMesh
    filled: SurfaceMesh
    distance: float

    @property
    def reduced(self) -> bool:
        """Whether the boundary of the tets is another surface."""
        return self.filled is not self.fine


def tetrahedralize(
    surface: SurfaceMesh,
    *,
    max_volume: float | None = None,
    edge: float | None = None,
    tets: int | None = None,
    quality: float | None = DEFAULT_QUALITY,
    min_dihedral: float | None = None,
    keep_surface: bool = False,
    mesher: Mesher = "auto",
    repair: bool = False,
    decimate: int | None = None,
    envelope: float = 1e-3,
    time_limit: float = 120.0,
    memory_limit: int | None = 4 * 2**30,
) -> TetMesh:
    """Fill a surface with tets.

    For a number of tets or a length of edges, TetGen fills a clean surface and Mmg remeshes this, with the boundary:
    sharp edges stay, the boundary moves by about a tenth of an edge and is fitted so that the volume stays. A surface
    that is not clean is filled by isosurface stuffing, which rounds sharp edges at the size of a tet. The log has the
    distance between both surfaces; draw the original one as the skin of the body. Triangles that disagree with their
    neighbours, and components that face inward, are turned first. Cavities (closed shells inside others, facing inward)
    stay empty. All meshers run in child processes: a crash, an endless loop or a lack of memory there does not affect
    this process.

    Parameters
    ----------
    surface : SurfaceMesh
        For TetGen watertight and free of self-intersections.
    max_volume : float [m^3], optional
        Upper bound on the volume of each tet, by TetGen alone. Long triangles need many times the tets of such a size.
    edge : float [m], optional
        Mean length of edges.
    tets : int, optional
        Number of tets, reached within 10 % where the details of the surface allow it; otherwise the log has a warning.
        Walls that are thinner than an eighth of such tets' edges get more tets, with a warning, too.
        Without any size: the coarsest mesh of TetGen, or about 2,000 where this has more.
    quality : float, optional
        TetGen's upper bound on circumradius over shortest edge of each tet [-], above 1, for `max_volume`,
        `keep_surface` or no size. A smaller bound gives more tets of better shape. Tets at small angles of the surface
        may exceed it. None: no bound.
    min_dihedral : float [degrees], optional
        TetGen's target for the smallest dihedral angle, below 70, as `quality`. Much above 18, TetGen may not end.
    keep_surface : bool
        Change no triangle, and add no vertices on the surface.
    mesher : "auto", "tetgen", "stuffing" or "ftetwild"
        "auto": TetGen (and Mmg) for a clean surface, stuffing with a warning for any other, and where both fail.
        "ftetwild" (the extra `dirty`) takes any surface, and keeps thin walls.
    repair : bool
        Repair a surface that is not clean first, see `repair_surface`. Where that fails, it is filled as it is.
    decimate : int, optional
        Number of triangles to which the surface is reduced first, see `decimate_surface`.
    envelope : float
        How far fTetWild may move the surface, as a fraction of the bounding box's diagonal.
    time_limit : float [s]
        Wall-clock time of the mesher.
    memory_limit : int [bytes], optional
        Address space of the mesher. Ignored, with a line in the log, where the platform has no such limit.

    Raises
    ------
    MeshingError : for a surface that cannot be meshed (what is wrong, where, and the remedy), a mesher that failed or
        reached a limit, a result that does not meet the demands, a surface that needs ten times the tets that were
        asked for, or a parameter out of its range.
    """
    return tetrahedralize_reported(**locals())[0]  # all parameters, and nothing else yet


def tetrahedralize_reported(
    surface: SurfaceMesh,
    *,
    max_volume: float | None = None,
    edge: float | None = None,
    tets: int | None = None,
    quality: float | None = DEFAULT_QUALITY,
    min_dihedral: float | None = None,
    keep_surface: bool = False,
    mesher: Mesher = "auto",
    repair: bool = False,
    decimate: int | None = None,
    envelope: float = 1e-3,
    time_limit: float = 120.0,
    memory_limit: int | None = 4 * 2**30,
) -> tuple[TetMesh, MeshingReport]:
    """`tetrahedralize`, with a report."""
    if not isinstance(surface, SurfaceMesh):
        raise MeshingError(f"tetrahedralize needs a SurfaceMesh, not {type(surface).__name__}")
    _in_range("max_volume", max_volume, 0.0, np.inf)
    _in_range("edge", edge, 0.0, np.inf)
    _in_range("tets", tets, 0.0, np.inf)
    if sum(size is not None for size in (max_volume, edge, tets)) > 1:
        raise MeshingError(f"give only one of {option('max_volume')}, {option('edge')} and {option('tets')}")
    _in_range("quality", quality, 1.0, np.inf)
    _in_range("min_dihedral", min_dihedral, 0.0, 70.0)
    _in_range("envelope", envelope, 0.0, 1.0)
    _in_range("time_limit", time_limit, 0.0, np.inf)
    _in_range("memory_limit", memory_limit, 0.0, np.inf)
    extent = float(np.ptp(surface.vertices, axis=0).max(initial=0.0)) if len(surface.vertices) else 0.0
    if 0.0 < extent < SMALLEST_LENGTH:
        raise MeshingError(
            f"the surface is {extent:.3g} m long; one below {SMALLEST_LENGTH:g} m cannot be meshed: scale it"
        )
    limits = Limits(time_limit, None if memory_limit is None else int(memory_limit))

    size_given = not (max_volume is edge is tets is None)
    repaired = None
    surface, report = _facing_outward(surface)
    if repair and not report.ok:
        try:
            fixed, repaired = repair_surface(surface, time_limit=time_limit, memory_limit=limits.memory)
        except MeshingError:
            if mesher == "tetgen" or keep_surface or min_dihedral is not None:
                raise
            # Stuffing needs no repair, and fills what MeshFix cannot repair. A warning of what is not clean follows.
            logger.info("MeshFix cannot repair it without losing parts; meshing the surface without repair")
        else:
            surface, report = _facing_outward(fixed)
    fine = surface

    def reduce(surface: SurfaceMesh, triangles: int) -> SurfaceMesh:
        reduced = decimate_surface(surface, triangles, time_limit=time_limit, memory_limit=limits.memory)
        return surface if reduced is surface else _facing_outward(reduced)[0]

    if decimate is not None:
        surface = reduce(surface, decimate)
        report = surface.check()
    chosen = _choose(mesher, report, repair, keep_surface)
    if chosen != "tetgen" or edge is not None or tets is not None:
        _check_tetgen_options(chosen, quality, min_dihedral, keep_surface)
    low, high = surface.bounds  # an open surface has no volume
    enclosed = surface.volume if report.watertight else 0.5 * float(np.prod(high - low))
    least = tets or 0
    if max_volume is not None or edge is not None:
        largest = max_volume or volume_of_edge(edge or 0.0)
        least = enclosed / largest if largest > 0.0 else np.inf
    refuse_too_many(least, limits.memory)
    warn_of_many(least if tets else TETS_OF_BOUND * least, enclosed, limits.time)

    def with_tetgen(quality: float | None, bound: float | None, points: int | None = None) -> TetMesh:
        options = {
            "max_volume": bound,
            "quality": quality,
            "min_dihedral": min_dihedral,
            "keep_surface": keep_surface,
            "points": points,
        }
        return _used("tetgen", mesh_with_tetgen(surface, options, limits))

    def remeshed(start: TetMesh | None, base: SurfaceMesh) -> TetMesh:
        wanted = tets
        if tets is not None:
            wanted = tets_of_walls(base, tets)
            if start is None and len(base.triangles) > DENSE * wanted:
                base = _fewer(base, DENSE * wanted, reduce)
        logger.info("filling %d triangles with %s", len(base.triangles), f"about {wanted} tets" if tets else "tets")
        result = mesh_with_mmg(base, start, tets=wanted, edge=edge, limits=limits)
        mesh = _used("Mmg", result)
        if wanted is not None:
            _say_count(len(mesh.tets), wanted)
        return fitted(mesh, fine)

    def fill() -> TetMesh:
        nonlocal chosen, tets
        if chosen == "stuffing":
            # The largest tets of a lattice have 2.5 times the mean volume.
            length = edge_of_volume(0.4 * max_volume) if max_volume is not None else edge
            mesh, volume = stuffed(surface, tets or (DEFAULT_TETS if length is None else None), length)
            _say_volume(mesh.volume, volume)
            return mesh
        if chosen == "ftetwild":
            bound = max_volume
            if not size_given or tets:
                bound = 2.0 * max(enclosed, 1e-3 * float(np.prod(high - low))) / (tets or DEFAULT_TETS)
            elif edge is not None:
                bound = 2.0 * volume_of_edge(edge)
            mesh = _used("ftetwild", mesh_with_ftetwild(surface, bound, envelope, limits))
            return mesh if max_volume is not None else remeshed(mesh, mesh.surface.compact())
        if not size_given and not keep_surface:
            if TETS_OF_TRIANGLE * len(surface.triangles) <= DEFAULT_TETS:
                # Where more points are needed, the shape of the triangles is bad, and the mesh is not used.
                mesh = with_tetgen(quality, None, DEFAULT_TETS)
                if len(mesh.tets) <= DEFAULT_TETS:
                    return _checked(mesh, surface, None, keep_surface)
            tets = DEFAULT_TETS
        if max_volume is not None or keep_surface:
            bound = max_volume
            if tets is not None or edge is not None:
                bound = volume_of_edge(edge) if edge is not None else 2.0 * enclosed / (tets or 1)
            mesh = with_tetgen(quality, bound)
            if tets is not None and edge is None and not 0.8 * tets < len(mesh.tets) < 1.25 * tets:
                mesh = with_tetgen(quality, min(enclosed, (bound or 0.0) * len(mesh.tets) / tets))
                _say_count(len(mesh.tets), tets)
            return _checked(mesh, surface, max_volume, keep_surface)
        chosen = "mmg"
        mesh = remeshed(None, surface)
        _say_volume(mesh.volume, fine.volume)
        return mesh

    started = time.perf_counter()
    try:
        mesh = fill()
    except MesherFailure as failure:
        if chosen not in ("tetgen", "mmg") or mesher != "auto" or failure.kind not in DAMAGED or keep_surface:
            raise
        logger.warning("%s; filling it with a lattice, which rounds sharp edges", failure)
        chosen = "stuffing"
        mesh = fill()
    seconds = time.perf_counter() - started
    filled, moved = surface, 0.0
    if chosen in ("mmg", "stuffing", "ftetwild"):
        filled = mesh.surface.compact()
    if filled is not fine:
        moved = distance(mesh, fine)
    away = f", at most {moved:.3g} m from the surface" if moved else ""
    logger.info("%s: %d vertices, %d tets in %.2f s%s", chosen, len(mesh.vertices), len(mesh.tets), seconds, away)
    return mesh, MeshingReport(chosen, seconds, repaired, fine, filled, moved)


def _used(mesher: str, result: MesherResult) -> TetMesh:
    try:
        return TetMesh.dropping_unused(result.vertices, result.elements)
    except MeshError as error:
        # As a failure of the mesher, so that "auto" goes on with stuffing.
        raise MesherFailure(
            "failed",
            f"{mesher} returned an unusable mesh: {str(error).removeprefix('TetMesh: ')}; the surface has triangles "
            f"that are too thin or too close to each other: remesh it evenly, or use {option('mesher', 'stuffing')}",
        ) from None


def _fewer(surface: SurfaceMesh, triangles: int, reduce: Callable[[SurfaceMesh, int], SurfaceMesh]) -> SurfaceMesh:
    """The surface with fewer triangles, where that changes neither its faults nor its volume."""
    try:
        reduced = reduce(surface, triangles)
    except MeshingError as error:
        logger.info("%s; filling all triangles", error)
        return surface
    same = abs(reduced.volume - surface.volume) <= DENSE_TOLERANCE * surface.volume and reduced.check().ok
    return reduced if same else surface


def _say_count(made: int, wanted: int) -> None:
    if made > 1.25 * wanted:
        allow(f"the details of the surface need {made:,} tets", made, wanted)
        logger.warning("%s tets instead of %s: the details of the surface need so many", f"{made:,}", f"{wanted:,}")


def _say_volume(made: float, volume: float) -> None:
    if abs(made - volume) > VOLUME_TOLERANCE * volume:
        logger.warning(
            "the tets have %+.1f %% of the surface's volume and mass: its details are smaller than tets; ask for more",
            100.0 * (made / volume - 1.0),
        )


def _in_range(name: str, value: float | None, low: float, high: float) -> None:
    """Raise for a parameter that is not a number strictly between `low` and `high`."""
    if value is None:
        return
    if (
        isinstance(value, bool)
        or not isinstance(value, (int, float, np.integer, np.floating))
        or not low < value < high
    ):
        span = f"between {low:g} and {high:g}" if np.isfinite(high) else f"above {low:g} and finite"
        raise MeshingError(f"{option(name)} must be a number {span}, not {value!r}")


def _facing_outward(surface: SurfaceMesh) -> tuple[SurfaceMesh, SurfaceReport]:
    """Drop unused vertices, turn triangles that disagree with their neighbours, and bodies that face inward.

    A body inside a body is unchanged: is it a cavity?
    """
    report = surface.check()
    if len(report.unused_vertices):
        logger.info("dropped %d vertices that no triangle uses", len(report.unused_vertices))
        surface = surface.compact()
        report = surface.check()
    steps: list[str] = []
    surface = consistently_oriented(surface, steps)
    if steps:
        logger.warning("%s", steps[0])
        report = surface.check()
    wrong = report.wrong_facing_components
    if len(wrong) == 0 or report.self_intersecting:
        return surface, report
    flipped = np.isin(surface.components.labels, wrong)
    # If all are wrong, the surface is inside out. Otherwise only bodies are turned: a cavity could be a mistake.
    if len(wrong) < report.component_count:
        for k in wrong:
            alone = SurfaceMesh(
                surface.vertices, surface.triangles[surface.components.labels == k], shares_vertices=True
            )
            if alone.volume > 0.0:
                flipped[surface.components.labels == k] = False
    if not flipped.any():
        return surface, report
    logger.warning("turned %d of %d triangles that faced inward", np.count_nonzero(flipped), len(flipped))
    triangles = surface.triangles.copy()
    triangles[flipped] = triangles[flipped][:, ::-1]
    turned = SurfaceMesh(surface.vertices, triangles)
    return turned, turned.check()


def _choose(
    mesher: Mesher, report: SurfaceReport, repaired: bool, keep_surface: bool
) -> Literal["tetgen", "stuffing", "ftetwild"]:
    if mesher not in ("auto", "tetgen", "stuffing", "ftetwild"):
        names = '"auto", "tetgen", "stuffing" or "ftetwild"'
        raise MeshingError(f"{option('mesher')} must be {names}, not {mesher!r}")
    if mesher == "ftetwild" and not ftetwild_installed():
        raise MeshingError(f"fTetWild is not installed: {INSTALL}")
    if mesher in ("stuffing", "ftetwild"):
        return mesher
    if report.ok:
        return "tetgen"
    faults = "; ".join(report.problems)
    if mesher == "auto" and not keep_surface:
        logger.warning("the surface is not clean (%s): filling it with a lattice, which rounds sharp edges", faults)
        return "stuffing"
    remedies = ["fix it in a modelling program"] if repaired else [f"fix it with {option('repair', True)}"]
    remedies.append(f"use {option('mesher', 'stuffing')}")
    still = "even after repair, " if repaired else ""
    raise MeshingError(f"TetGen cannot mesh this surface: {still}{faults}; {' or '.join(remedies)}")


def _check_tetgen_options(mesher: str, quality: float | None, min_dihedral: float | None, keep_surface: bool) -> None:
    """Raise for options that only TetGen has; warn of the one that is not used."""
    if mesher != "tetgen":
        for name, given in (("keep_surface", keep_surface), ("min_dihedral", min_dihedral is not None)):
            if given:
                raise MeshingError(
                    f"{mesher} has no {option(name)}; omit it, or clean the surface so that TetGen can mesh it"
                )
    for name, given in (("quality", quality != DEFAULT_QUALITY), ("min_dihedral", min_dihedral is not None)):
        if given:
            logger.warning("%s is not used: it is TetGen's, with %s", option(name), option("max_volume"))


def _checked(mesh: TetMesh, surface: SurfaceMesh, max_volume: float | None, keep_surface: bool) -> TetMesh:
    """TetGen's mesh, where it meets the demands."""
    if max_volume is not None and (largest := float(mesh.volumes.max())) > max_volume * (1.0 + 1e-6):
        remedy = f"omit {option('keep_surface')}, give a finer surface" if keep_surface else "give a finer surface"
        raise MeshingError(
            f"TetGen left a tet of {largest:.4g} m^3, larger than {option('max_volume', max_volume)}; {remedy}, "
            "or allow larger tets"
        )
    _say_volume(mesh.volume, surface.volume)
    if keep_surface and len(mesh.surface.used_vertices) > len(surface.vertices):
        raise MeshingError(
            f"TetGen added vertices on the surface; omit {option('keep_surface')}, or give a finer surface"
        )
    return mesh
