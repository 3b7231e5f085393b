"""From a surface to a tet mesh: checks of the parameters and of the surface, repair, filling, and a report."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass

import numpy as np

from supple.errors import MeshingError
from supple.mesh.meshing.child_process import DAMAGED, Limits, MesherFailure
from supple.mesh.meshing.facing import facing_outward
from supple.mesh.meshing.filling import DEFAULT_QUALITY, Filling, Mesher, check_tetgen_options, choose
from supple.mesh.meshing.option_names import option
from supple.mesh.meshing.repair import RepairReport, repair_surface
from supple.mesh.meshing.sizes import TETS_OF_BOUND, refuse_too_many, volume_of_edge, warn_of_many
from supple.mesh.meshing.surface_fit import distance
from supple.mesh.meshing.union import united
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh

logger = logging.getLogger(__name__)

# Volumes and squares of areas of smaller surfaces are not normal numbers [m].
SMALLEST_LENGTH = 1e-60


@dataclass(frozen=True)
class MeshingReport:
    """How a tet mesh was made.

    Attributes
    ----------
    mesher : "tetgen", "mmg" (which remeshes TetGen's tets) or "stuffing"; seconds : that it took
    repair : what was repaired first; None where nothing was
    fine, filled : the surface, or the union of its components, before it was remeshed, and the boundary of the tets;
        the same one where it was not
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
    time_limit: float = 120.0,
    memory_limit: int | None = 4 * 2**30,
) -> TetMesh:
    """Fill a surface with tets.

    For a number of tets or a length of edges, TetGen fills a clean surface and Mmg remeshes this, with the boundary:
    sharp edges stay, the boundary moves by about a tenth of an edge and is fitted so that the volume stays. Closed
    components that overlap are united first. Any other surface that is not clean is filled by isosurface stuffing,
    which rounds sharp edges at the size of a tet. The log has the distance between both surfaces; draw the original one
    as the skin of the body. Triangles that disagree with their neighbours, and components that face inward, are
    reoriented first. Cavities (closed shells inside others, facing inward) stay empty. All meshers run in child
    processes: a crash, an endless loop or a lack of memory there does not affect this process.

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
        Walls that are thinner than an eighth of such tets' edges, or in a lattice than these, get more tets, with a
        warning, too.
        Without any size: the coarsest mesh of TetGen, or about 2,000 where this has more.
    quality : float, optional
        TetGen's upper bound on circumradius over shortest edge of each tet [-], above 1, for `max_volume`,
        `keep_surface` or no size. A smaller bound gives more tets of better shape. Tets at small angles of the surface
        may exceed it. None: no bound.
    min_dihedral : float [degrees], optional
        TetGen's target for the smallest dihedral angle, below 70, as `quality`. Much above 18, TetGen may not end.
    keep_surface : bool
        Change no triangle, and add no vertices on the surface.
    mesher : "auto", "tetgen" or "stuffing"
        "auto": TetGen (and Mmg) for a clean surface, stuffing with a warning for any other, and where both fail.
    repair : bool
        Repair a surface that is not clean first, see `repair_surface`. Where that fails, it is filled as it is.
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
    _in_range("time_limit", time_limit, 0.0, np.inf)
    _in_range("memory_limit", memory_limit, 0.0, np.inf)
    extent = float(np.ptp(surface.vertices, axis=0).max(initial=0.0)) if len(surface.vertices) else 0.0
    if 0.0 < extent < SMALLEST_LENGTH:
        raise MeshingError(
            f"the surface is {extent:.3g} m long; one below {SMALLEST_LENGTH:g} m cannot be meshed: scale it"
        )
    limits = Limits(time_limit, None if memory_limit is None else int(memory_limit))

    repaired, unites = None, mesher == "auto" and not keep_surface
    surface, report = facing_outward(surface)
    if unites:
        surface, report = united(surface, report, limits)
    if repair and not report.ok:
        try:
            fixed, repaired = repair_surface(surface, time_limit=time_limit, memory_limit=limits.memory)
        except MeshingError:
            if mesher == "tetgen" or keep_surface or min_dihedral is not None:
                raise
            # Stuffing needs no repair, and fills what MeshFix cannot repair. A warning of what is not clean follows.
            logger.info("MeshFix cannot repair it without losing parts; meshing the surface without repair")
        else:
            surface, report = facing_outward(fixed)
            if unites:
                surface, report = united(surface, report, limits)
    chosen = choose(mesher, report, repair, keep_surface)
    if chosen != "tetgen" or edge is not None or tets is not None:
        check_tetgen_options(chosen, quality, min_dihedral, keep_surface)
    filling = Filling(surface, report.watertight, max_volume, edge, tets, quality, min_dihedral, keep_surface, limits)
    least = tets or 0
    if max_volume is not None or edge is not None:
        largest = max_volume or volume_of_edge(edge or 0.0)
        least = filling.enclosed / largest if largest > 0.0 else np.inf
    refuse_too_many(least, limits.memory)
    warn_of_many(least if tets else TETS_OF_BOUND * least, filling.enclosed, limits.time)

    started = time.perf_counter()
    try:
        used, mesh = filling.by(chosen)
    except MesherFailure as failure:
        if chosen != "tetgen" or mesher != "auto" or failure.kind not in DAMAGED or keep_surface:
            raise
        logger.warning("%s; filling it with a lattice, which rounds sharp edges", failure)
        used, mesh = filling.by("stuffing")
    seconds = time.perf_counter() - started
    filled, moved = surface, 0.0
    if used != "tetgen":
        filled = mesh.surface.compact()
        moved = distance(mesh, surface)
    away = f", at most {moved:.3g} m from the surface" if moved else ""
    logger.info("%s: %d vertices, %d tets in %.2f s%s", used, len(mesh.vertices), len(mesh.tets), seconds, away)
    return mesh, MeshingReport(used, seconds, repaired, surface, filled, moved)


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
