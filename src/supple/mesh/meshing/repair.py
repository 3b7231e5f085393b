"""Repair of triangle surfaces, with a report of what changed."""

from __future__ import annotations

import importlib.util
import logging
from dataclasses import dataclass

import numpy as np

from supple.errors import MeshingError
from supple.mesh.meshing.child_process import Limits, run_mesher
from supple.mesh.meshing.facing import consistently_oriented
from supple.mesh.meshing.holes import close_holes
from supple.mesh.meshing.option_names import option
from supple.mesh.surface import SurfaceMesh
from supple.mesh.surface_checks import SurfaceReport
from supple.mesh.topology import facet_keys, has_vertex_twice, merge_map

logger = logging.getLogger(__name__)

# MeshFix removes triangles that intersect. If a component loses more than this fraction of its area, MeshFix removed
# the wrong part.
LARGEST_LOSS = 0.5


@dataclass(frozen=True, eq=False)
class RepairReport:
    """The result of a repair.

    Attributes
    ----------
    steps : one line for each change
    before, after : the checks of the surface before and after
    """

    steps: tuple[str, ...]
    before: SurfaceReport
    after: SurfaceReport

    @property
    def volume_change(self) -> float:
        """Volume after minus volume before [m^3]; the volume before has no meaning where the surface was open."""
        return self.after.surface.volume - self.before.surface.volume

    def __str__(self) -> str:
        a, b = self.before.surface, self.after.surface
        counts = (
            f"{len(a.triangles)} -> {len(b.triangles)} triangles, {self.before.component_count} -> "
            f"{self.after.component_count} components, volume {a.volume:.6g} -> {b.volume:.6g} m^3"
        )
        return "; ".join([*self.steps, counts])


def repair_surface(
    surface: SurfaceMesh,
    *,
    allow_lost_components: bool = False,
    time_limit: float = 120.0,
    memory_limit: int | None = 4 * 2**30,
) -> tuple[SurfaceMesh, RepairReport]:
    """Repair a surface: duplicates, mixed orientation, holes, then self-intersections and triangles without area.

    The first two are exact and done here, as is the closing of holes with a simple rim. The remaining faults are left
    to MeshFix (Attene 2010, "A lightweight approach to repairing digitized polygon meshes"; the extra `dirty`), in a
    child process and one component at a time, so that it drops none of them. The log lists the changes.

    Parameters
    ----------
    surface : SurfaceMesh
    allow_lost_components : bool
        Whether a component may lose more than half of its area, or all of it.
    time_limit, memory_limit : float [s], int [bytes]
        Limits of MeshFix's process.

    Returns
    -------
    surface, report

    Raises
    ------
    MeshingError : where MeshFix is needed and not installed, a component would be lost, or faults remain.
    """
    before = surface.check()
    steps: list[str] = []
    repaired = _drop_useless(surface, steps)
    repaired = _orient(repaired, steps)
    after = repaired.check()
    if len(after.open_edges) and after.consistently_oriented:
        closed, count = close_holes(repaired, after.open_edges)
        report = closed.check()
        if count and report.watertight and len(report.intersecting_triangles) <= len(after.intersecting_triangles):
            steps.append(f"closed {count} {'hole' if count == 1 else 'holes'} of {len(after.open_edges)} edges")
            repaired = _orient(closed, steps)
            after = repaired.check()
    if not after.ok:
        repaired = _meshfix_components(repaired, steps, allow_lost_components, Limits(time_limit, memory_limit))
        repaired = _orient(repaired, steps)
        after = repaired.check()
    if not after.ok:
        raise MeshingError(
            f"repair could not fix the surface: {'; '.join(after.problems)}; use {option('mesher', 'stuffing')} or fix "
            "it in a modelling program"
        )
    report = RepairReport(tuple(steps), before, after)
    if steps:
        logger.warning("repaired the surface: %s", report)
    return repaired, report


def _drop_useless(surface: SurfaceMesh, steps: list[str]) -> SurfaceMesh:
    """Merge vertices at the same place; drop triangles with a vertex twice, repeated triangles and unused vertices.

    Other triangles without area stay for the later steps: without them the surface would have holes.
    """
    keep, index = merge_map(surface.vertices, 0.0)
    if len(keep) < len(surface.vertices):
        steps.append(f"merged {len(surface.vertices) - len(keep)} vertices with others at the same place")
        surface = SurfaceMesh(surface.vertices[keep], index[surface.triangles])
    triangles = surface.triangles
    collapsed = has_vertex_twice(triangles)
    _, first = np.unique(facet_keys(triangles, len(surface.vertices)), return_index=True)
    repeats = np.ones(len(triangles), dtype=bool)
    repeats[first] = False
    repeats &= ~collapsed
    for rows, what in ((collapsed, "had a vertex twice"), (repeats, "repeated others")):
        if rows.any():
            steps.append(f"dropped {np.count_nonzero(rows)} triangles that {what}")
    keep = ~(collapsed | repeats)
    if not keep.any():
        raise MeshingError("repair could not fix the surface: none of its triangles has an area")
    unused = len(surface.vertices) - len(np.unique(triangles[keep]))
    if keep.all() and unused == 0:
        return surface
    if unused:
        steps.append(f"dropped {unused} vertices that no triangle uses")
    return SurfaceMesh(surface.vertices, triangles[keep]).compact()


def _orient(surface: SurfaceMesh, steps: list[str]) -> SurfaceMesh:
    """Turn triangles to agree with their neighbours, then whole components to face outward."""
    surface = consistently_oriented(surface, steps)
    report = surface.check()
    if len(report.wrong_facing_components):
        rows = np.isin(surface.components.labels, report.wrong_facing_components)
        surface = SurfaceMesh(surface.vertices, np.where(rows[:, None], surface.triangles[:, ::-1], surface.triangles))
        steps.append(f"reoriented {len(report.wrong_facing_components)} components that faced the wrong way")
    return surface


def _meshfix_components(surface: SurfaceMesh, steps: list[str], allow_lost: bool, limits: Limits) -> SurfaceMesh:
    """Run MeshFix on each component that has faults of its own. It cannot separate components that cut each other."""
    if importlib.util.find_spec("pymeshfix") is None:
        faults = "; ".join(surface.check().problems)
        raise MeshingError(f'repair needs MeshFix for this surface ({faults}): pip install "supple[dirty]"')
    count, labels = surface.components
    pieces = [SurfaceMesh(surface.vertices, surface.triangles[labels == k]).compact() for k in range(count)]
    faults = [_own_faults(piece) for piece in pieces]
    faulty = [k for k in range(count) if faults[k]]
    if not faulty:
        return surface
    result = run_mesher(
        "meshfix", surface.vertices, surface.triangles, {"components": labels.tolist(), "faulty": faulty}, limits
    )
    kept: list[SurfaceMesh] = []
    for k, piece in enumerate(pieces):
        if not faults[k]:
            kept.append(piece)
            continue
        rows = result.elements[result.labels == k]
        fixed = SurfaceMesh(result.vertices, rows).compact() if len(rows) else None
        loss = 1.0 if fixed is None or _own_faults(fixed) else 1.0 - fixed.area / piece.area
        what = f"component {k} of {count} ({len(piece.triangles)} triangles; {'; '.join(faults[k])})"
        if loss > LARGEST_LOSS and not allow_lost:
            how_much = "all" if loss == 1.0 else f"{100.0 * loss:.0f} % of the area"
            raise MeshingError(
                f"repair would drop {how_much} of {what}: remove it yourself, allow it in Python with repair_surface("
                f"surface, allow_lost_components=True), or use {option('mesher', 'stuffing')}"
            )
        if fixed is None or loss == 1.0:
            steps.append(f"dropped {what}")
        else:
            sizes = f"{len(piece.triangles)} -> {len(fixed.triangles)} triangles"
            areas = f"area {piece.area:.6g} -> {fixed.area:.6g} m^2"
            steps.append(f"MeshFix repaired component {k} of {count}: {sizes}, {areas}")
            kept.append(fixed)
    if not kept:
        raise MeshingError("repair could not fix the surface: no component remains")
    offsets = np.cumsum([0, *(len(p.vertices) for p in kept[:-1])])
    return SurfaceMesh(
        np.concatenate([p.vertices for p in kept]),
        np.concatenate([p.triangles + offset for p, offset in zip(kept, offsets, strict=True)]),
    )


def _own_faults(piece: SurfaceMesh) -> list[str]:
    """Faults of a component alone, without its facing: alone, a cavity cannot be recognized."""
    report = piece.check()
    return report.problems[: len(report.problems) - bool(len(report.wrong_facing_components))]
