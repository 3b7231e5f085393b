"""The union of the closed components of a surface that overlap, as assemblies of parts have them."""

from __future__ import annotations

import logging

from supple.errors import MeshError
from supple.mesh.meshing.child_process import Limits, MesherFailure, run_mesher
from supple.mesh.meshing.mesher_worker import SHAPELESS
from supple.mesh.meshing.meshers import mesh_with_tetgen
from supple.mesh.surface import SurfaceMesh
from supple.mesh.surface_checks import SurfaceReport

logger = logging.getLogger(__name__)

# Of a surface's size, below which details of the union are dropped: cuts leave triangles near round-off, without which
# others may cross.
_TOLERANCES = (1e-5, 0.0, 1e-4)


def united(surface: SurfaceMesh, report: SurfaceReport, limits: Limits) -> tuple[SurfaceMesh, SurfaceReport]:
    """The union of the components, by Manifold in a child process; the surface itself where that is not clean."""
    if not (report.watertight and report.self_intersecting):
        return surface, report
    low, high = surface.bounds
    middle, size = 0.5 * (low + high), float((high - low).max()) or 1.0
    unit = (surface.vertices - middle) / size
    for tolerance in _TOLERANCES:
        try:
            result = run_mesher("union", unit, surface.triangles, {"tolerance": tolerance}, limits)
            union = SurfaceMesh(result.vertices * size + middle, result.elements)
            found = union.check()
            if not found.ok:
                continue
            mesh_with_tetgen(union, SHAPELESS, limits)  # finds crossings of the size of round-off
        except (MesherFailure, MeshError) as failure:
            logger.debug("%s", failure)
            continue
        logger.info("%d components of the surface overlap: their union is filled", report.component_count)
        return union, found
    return surface, report
