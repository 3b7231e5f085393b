"""From a surface to a tet mesh: checks of the surface, the choice of the mesher, and checks of its result."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Literal

import numpy as np

from supple.errors import MeshError, MeshingError
from supple.mesh.meshing.child_process import DAMAGED, Limits, MesherFailure
from supple.mesh.meshing.decimation import decimate_surface
from supple.mesh.meshing.meshers import INSTALL, ftetwild_installed, mesh_with_ftetwild, mesh_with_tetgen
from supple.mesh.meshing.repair import RepairReport, repair_surface
from supple.mesh.meshing.sizes import (
    COUNT_TOLERANCE,
    TETS_OF_BOUND,
    coarse_enough,
    fill_with_count,
    refuse_too_many,
    volume_of_edge,
    warn_of_many,
)
from supple.mesh.meshing.spelling import option
from supple.mesh.surface import SurfaceMesh
from supple.mesh.surface_checks import SurfaceReport
from supple.mesh.tetmesh import TetMesh

logger = logging.getLogger(__name__)

Mesher = Literal["auto", "tetgen", "ftetwild"]

# TetGen's facets are planar to 0.1 degrees; a larger change of the volume has another cause.
VOLUME_TOLERANCE = 1e-3
# Volumes and squares of areas of smaller surfaces are not normal numbers [m].
SMALLEST_LENGTH = 1e-60
DEFAULT_QUALITY = 1.4


@dataclass(frozen=True)
class MeshingReport:
    """How a tet mesh was made.

    Attributes
    ----------
    mesher : "tetgen" or "ftetwild"; seconds : that it took
    repair : what was repaired first; None where nothing was
    fine, filled : the surface before it was reduced to fewer triangles, and the one that was filled; the same one
        where it was not reduced
    """

    mesher: str
    seconds: float
    repair: RepairReport | None
    fine: SurfaceMesh
    filled: SurfaceMesh

    @property
    def reduced(self) -> bool:
        """Whether the surface was reduced."""
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

    The mesher runs in a child process: a crash, an endless loop or a lack of memory there does not affect this process.
    Components that face inward are turned. Cavities (closed shells inside others, facing inward) stay empty.

    Parameters
    ----------
    surface : SurfaceMesh
        For TetGen watertight, oriented and free of self-intersections.
    max_volume : float [m^3], optional
        Upper bound on the volume of each tet.
    edge : float [m], optional
        Length of edges, instead of `max_volume`: no tet is larger than a regular one with such edges.
    tets : int, optional
        Number of tets, instead of `max_volume`, reached within 10 %. A surface whose triangles need more is reduced
        first, unless `decimate` or `keep_surface` is given; where it still needs more, the log has a warning.
    quality : float, optional
        TetGen's upper bound on circumradius over shortest edge of each tet [-], above 1. A smaller bound gives more
        tets of better shape. Tets at small angles of the surface may exceed it. None: no bound.
    min_dihedral : float [degrees], optional
        TetGen's target for the smallest dihedral angle, below 70. Much above 18, TetGen may not end.
    keep_surface : bool
        Add no vertices on the surface.
    mesher : "auto", "tetgen" or "ftetwild"
        "auto" uses TetGen for a clean surface. It warns and uses fTetWild (the extra `dirty`) for any other, and where
        TetGen fails.
    repair : bool
        Repair a surface that is not clean first, see `repair_surface`. Where that fails, "auto" and "ftetwild" mesh the
        surface as it is with fTetWild, if that is installed, with a warning in the log.
    decimate : int, optional
        Number of triangles to which the surface is reduced first, see `decimate_surface`: TetGen keeps all of them.
    envelope : float
        How far fTetWild may move the surface, as a fraction of the bounding box's diagonal.
    time_limit : float [s]
        Wall-clock time of the mesher.
    memory_limit : int [bytes], optional
        Address space of the mesher. Ignored, with a line in the log, where the platform has no such limit.

    Raises
    ------
    MeshingError : for a surface that cannot be meshed (what is wrong, where, and the remedy), a mesher that failed or
        reached a limit, a result that does not meet the demands, or a parameter out of its range.
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
    if edge is not None:
        max_volume = volume_of_edge(edge)
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

    repaired = None
    others_can = ftetwild_installed() and not keep_surface and min_dihedral is None
    surface, report = _facing_outward(surface)
    if repair and not report.ok:
        try:
            fixed, repaired = repair_surface(surface, time_limit=time_limit, memory_limit=limits.memory)
        except MeshingError:
            # fTetWild needs no repair, and meshes much that MeshFix cannot repair: components that cut each other.
            if mesher == "tetgen" or not others_can:
                raise
            # A warning of what is not clean follows.
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
    chosen = _choose(mesher, report, repair)
    if chosen == "ftetwild":
        _check_ftetwild_options(quality, min_dihedral, keep_surface)
    seconds = 0.0
    low, high = surface.bounds  # an open surface has no volume
    enclosed = surface.volume if report.watertight else 0.5 * float(np.prod(high - low))
    least = tets or 0
    if max_volume is not None and report.ok:
        least = enclosed / max_volume if max_volume > 0.0 else np.inf
    refuse_too_many(least, limits.memory)
    warn_of_many(least if tets else TETS_OF_BOUND * least, enclosed, limits.time)

    def make(surface: SurfaceMesh, max_volume: float | None) -> TetMesh:
        nonlocal seconds
        if chosen == "tetgen":
            options = {
                "max_volume": max_volume,
                "quality": quality,
                "min_dihedral": min_dihedral,
                "keep_surface": keep_surface,
            }
            result = mesh_with_tetgen(surface, options, limits)
        else:
            result = mesh_with_ftetwild(surface, max_volume, envelope, limits)
        seconds += result.seconds
        try:
            mesh = TetMesh.dropping_unused(result.vertices, result.elements)
        except MeshError as error:
            raise MeshingError(
                f"{chosen} returned an unusable mesh: {str(error).removeprefix('TetMesh: ')}; the surface has "
                "triangles that are too thin or too close to each other: remesh it evenly, or use "
                + option("mesher", "ftetwild")
            ) from None
        _check_result(mesh, surface, chosen, max_volume if tets is None else None, keep_surface)
        return mesh

    reducing = reduce if decimate is None and not keep_surface else None

    def fill() -> tuple[TetMesh, SurfaceMesh]:
        nonlocal chosen
        if tets is None:
            logger.info("filling %d triangles with tets", len(surface.triangles))
            return make(surface, max_volume), surface
        volume = max(enclosed, 1e-3 * float(np.prod(high - low)))
        if chosen == "tetgen" or reducing is None:
            return fill_with_count(surface, tets, make, reducing, volume)
        coarse = coarse_enough(surface, tets, reducing)
        logger.info("filling %d triangles with about %d tets by fTetWild", len(coarse.triangles), tets)
        mesh = make(coarse, 2.0 * volume / tets)
        boundary = mesh.surface.compact()
        if abs(len(mesh.tets) - tets) <= COUNT_TOLERANCE * tets or not boundary.check().ok:
            return mesh, coarse
        # A run of fTetWild can take a minute, and it resolves how far it moves the surface. Its boundary is clean.
        logger.info("%d tets instead of %d by fTetWild; filling its boundary again", len(mesh.tets), tets)
        chosen = "tetgen"
        return fill_with_count(boundary, tets, make, reducing, volume)

    try:
        mesh, filled = fill()
    except MesherFailure as failure:
        if not (chosen == "tetgen" and mesher == "auto" and failure.kind in DAMAGED and others_can):
            raise
        logger.warning("%s; meshing it with fTetWild, which may move the surface slightly", failure)
        chosen = "ftetwild"
        mesh, filled = fill()
    logger.info("%s: %d vertices, %d tets in %.2f s", chosen, len(mesh.vertices), len(mesh.tets), seconds)
    return mesh, MeshingReport(chosen, seconds, repaired, fine, filled)


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
    """Drop unused vertices, and turn bodies that face inward. A body inside a body is unchanged: is it a cavity?"""
    report = surface.check()
    if len(report.unused_vertices):
        logger.info("dropped %d vertices that no triangle uses", len(report.unused_vertices))
        surface = surface.compact()
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


def _choose(mesher: Mesher, report: SurfaceReport, repaired: bool) -> Literal["tetgen", "ftetwild"]:
    if mesher not in ("auto", "tetgen", "ftetwild"):
        raise MeshingError(f'{option("mesher")} must be "auto", "tetgen" or "ftetwild", not {mesher!r}')
    if mesher == "ftetwild":
        if not ftetwild_installed():
            raise MeshingError(f"fTetWild is not installed: {INSTALL}")
        return "ftetwild"
    if report.ok:
        return "tetgen"
    faults = "; ".join(report.problems)
    if mesher == "auto" and ftetwild_installed():
        logger.warning("the surface is not clean (%s): meshing it with fTetWild, which may move it slightly", faults)
        return "ftetwild"
    remedies = ["fix it in a modelling program"] if repaired else [f"fix it with {option('repair', True)}"]
    remedies.append(f"use {option('mesher', 'ftetwild')}" + ("" if ftetwild_installed() else f" ({INSTALL})"))
    still = "even after repair, " if repaired else ""
    raise MeshingError(f"TetGen cannot mesh this surface: {still}{faults}; {' or '.join(remedies)}")


def _check_ftetwild_options(quality: float | None, min_dihedral: float | None, keep_surface: bool) -> None:
    """Raise for options that fTetWild does not have; warn of the one that it does not use."""
    for name, given in (("keep_surface", keep_surface), ("min_dihedral", min_dihedral is not None)):
        if given:
            raise MeshingError(
                f"fTetWild has no {option(name)}; omit it, or clean the surface so that TetGen can mesh it"
            )
    if quality != DEFAULT_QUALITY:
        logger.warning("fTetWild optimizes shapes by its own measure: %s is not used", option("quality", quality))


def _check_result(
    mesh: TetMesh, surface: SurfaceMesh, mesher: str, max_volume: float | None, keep_surface: bool
) -> None:
    if max_volume is not None and (largest := float(mesh.volumes.max())) > max_volume * (1.0 + 1e-6):
        remedy = f"omit {option('keep_surface')}, give a finer surface" if keep_surface else "give a finer surface"
        raise MeshingError(
            f"{mesher} left a tet of {largest:.4g} m^3, larger than {option('max_volume', max_volume)}; {remedy}, "
            "or allow larger tets"
        )
    if mesher != "tetgen":
        return
    if abs(mesh.volume - surface.volume) > VOLUME_TOLERANCE * surface.volume:
        raise MeshingError(
            f"the tets fill {mesh.volume:.6g} m^3 of the surface's {surface.volume:.6g} m^3; its components may "
            "overlap or touch: separate or join them"
        )
    if keep_surface and len(mesh.surface.used_vertices) > len(surface.vertices):
        raise MeshingError(
            f"TetGen added vertices on the surface; omit {option('keep_surface')}, or give a finer surface"
        )
