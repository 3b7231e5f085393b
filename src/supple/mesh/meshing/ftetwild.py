"""Surfaces with faults to tets by fTetWild (Hu et al. 2020, "Fast tetrahedral meshing in the wild")."""

from __future__ import annotations

import importlib.util
import logging
from dataclasses import replace

import numpy as np

from supple.errors import MeshingError
from supple.mesh.meshing.child_process import Limits, MesherResult, run_mesher
from supple.mesh.surface import SurfaceMesh

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
        raise MeshingError("fTetWild found nothing that the surface encloses; close its holes, or give another surface")
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
