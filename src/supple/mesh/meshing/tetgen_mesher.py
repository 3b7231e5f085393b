"""Clean closed surfaces to tets by TetGen (Si 2015, "TetGen, a Delaunay-based quality tetrahedral mesh generator")."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.mesh.meshing.child_process import Limits, MesherResult, run_mesher
from supple.mesh.meshing.spelling import option
from supple.mesh.surface import SurfaceMesh
from supple.mesh.surface_checks import winding_number
from supple.mesh.topology import without_unused


def _remedy() -> str:
    return (
        f"; the surface is most likely damaged or has details near round-off: fix it ({option('repair', True)}) or use "
        f'{option("mesher", "ftetwild")} (pip install "supple[dirty]")'
    )


def mesh_with_tetgen(surface: SurfaceMesh, options: dict[str, Any], limits: Limits) -> MesherResult:
    """Tets inside a clean surface, without those in its cavities.

    `options`: max_volume [m^3], quality, min_dihedral [degrees] (each may be None) and keep_surface.

    Raises
    ------
    MesherFailure : with TetGen's message and the remedy.
    """
    # Scaled by a power of two, so that no bit of the coordinates is lost; TetGen's tolerances suit a unit size best.
    low, high = surface.bounds
    scale = 2.0 ** -math.frexp(float((high - low).max()) or 1.0)[1]
    volume = options["max_volume"]
    scaled = options | {"max_volume": None if volume is None else volume * scale**3}
    result = run_mesher("tetgen", SurfaceMesh(surface.vertices * scale, surface.triangles), scaled, limits, _remedy())
    vertices = result.vertices / scale
    inside = _inside(surface, vertices, result)
    if inside.all():
        return replace(result, vertices=vertices)
    vertices, elements = without_unused(vertices, result.elements[inside])
    return replace(result, vertices=vertices, elements=elements, labels=result.labels[inside])


def _inside(surface: SurfaceMesh, vertices: NDArray[np.float64], result: MesherResult) -> NDArray[np.bool_]:
    """Which tets lie inside. TetGen fills everything that the surface encloses, also cavities (each is a region)."""
    inside = np.ones(len(result.elements), dtype=bool)
    regions = np.unique(result.labels)
    if len(regions) < 2:
        return inside
    corners = vertices[result.elements]
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    triangles = surface.vertices[surface.triangles]
    for region in regions:
        members = np.flatnonzero(result.labels == region)
        middle = corners[members[volumes[members].argmax()]].mean(axis=0)
        if winding_number(triangles, middle) < 0.5:
            inside[members] = False
    return inside
