"""The meshers: TetGen for clean closed surfaces, and fTetWild for surfaces with faults.

Sources: Si 2015, "TetGen, a Delaunay-based quality tetrahedral mesh generator"; Hu et al. 2020, "Fast tetrahedral
meshing in the wild".
"""

from __future__ import annotations

import importlib.util
import logging
import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshingError
from supple.mesh.meshing.child_process import Limits, MesherResult, run_mesher
from supple.mesh.meshing.spelling import option
from supple.mesh.surface import SurfaceMesh
from supple.mesh.topology import without_unused
from supple.numerics.geometry.winding_number import winding_number


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
    for region in regions:
        members = np.flatnonzero(result.labels == region)
        middle = corners[members[volumes[members].argmax()]].mean(axis=0)
        if winding_number(surface.vertices, surface.triangles, tuple(middle)) < 0.5:
            inside[members] = False
    return inside


logger = logging.getLogger(__name__)

INSTALL = 'pip install "supple[dirty]"'


def ftetwild_installed() -> bool:
    """Whether the package that holds fTetWild (pytetwild) can be found."""
    return importlib.util.find_spec("pytetwild") is not None


def mesh_with_ftetwild(
    surface: SurfaceMesh, max_volume: float | None, envelope: float, limits: Limits, threads: int = 0
) -> MesherResult:
    """Tets inside what a surface most plausibly encloses: holes are closed, and overlaps become a union.

    Parameters
    ----------
    max_volume : [m^3], or None for edges of a twentieth of the bounding box's diagonal
    envelope : how far the boundary may move, as a fraction of the bounding box's diagonal
    threads : 0 for all cores

    Raises
    ------
    MeshingError : where fTetWild is not installed, fails or finds no inside.
    """
    if not ftetwild_installed():
        raise MeshingError(f"fTetWild is not installed: {INSTALL}")
    low, high = surface.bounds
    middle, size = 0.5 * (low + high), float(np.linalg.norm(high - low)) or 1.0
    options = {
        "max_volume": None if max_volume is None else max_volume / size**3,
        "envelope": envelope,
        "threads": threads,
    }
    unit = SurfaceMesh((surface.vertices - middle) / size, surface.triangles)
    result = run_mesher("ftetwild", unit, options, limits, "; fix the surface in a modelling program")
    if len(result.elements) == 0:
        raise MeshingError("fTetWild found no volume inside of the surface; close its holes, or give another surface")
    result = replace(result, vertices=result.vertices * size + middle)
    _warn_of_lost_pieces(surface, result, reach=(envelope + 0.05) * size)
    return result


def _warn_of_lost_pieces(surface: SurfaceMesh, result: MesherResult, reach: float) -> None:
    """Log which components of the surface have no tet near them."""
    from scipy.spatial import KDTree

    tree = KDTree(result.vertices)
    count, labels = surface.components
    for k in range(count):
        triangles = surface.triangles[labels == k]
        distance, _ = tree.query(surface.vertices[np.unique(triangles)], distance_upper_bound=reach)
        if not np.isfinite(distance).any():
            where = ", ".join(f"{x:.4g}" for x in surface.vertices[triangles[0, 0]])
            logger.warning(
                "fTetWild dropped component %d of %d (%d triangles) at (%s)", k, count, len(triangles), where
            )
