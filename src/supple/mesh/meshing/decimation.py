"""Fewer triangles for a surface, before it is filled with tets: TetGen keeps every triangle of a surface."""

from __future__ import annotations

import logging

import numpy as np

from supple.errors import MeshError, MeshingError
from supple.mesh.meshing.child_process import Limits, run_mesher
from supple.mesh.surface import SurfaceMesh

logger = logging.getLogger(__name__)

# A closed surface has at least this many triangles.
_LEAST = 4

# Of the volume: beyond it the shape is another one.
_LARGEST_CHANGE = 0.1

# How aggressive the collapses are at first: their order decides by chance whether thin parts get folds, and a knot that
# got some with the first number got none with one of the others.
_FIRST = (1, 4, 5)

# By 60 degrees about (1, 1, 1).
_TURN = np.array([[2.0, -1.0, 2.0], [2.0, 2.0, -1.0], [-1.0, 2.0, 2.0]]) / 3.0


def decimate_surface(
    surface: SurfaceMesh, triangles: int, *, time_limit: float = 120.0, memory_limit: int | None = 4 * 2**30
) -> SurfaceMesh:
    """Reduce a surface to a number of triangles, by collapsing the edges that change its shape least.

    The log says by how much the volume of a closed surface changes. The work is done by fast-simplification, in a
    child process. Collapsed edges are chosen by the quadric error of Garland, Heckbert, "Surface Simplification Using
    Quadric Error Metrics" (1997).

    Parameters
    ----------
    surface : SurfaceMesh
        With the faults that it may have: the result can have the same.
    triangles : int
        At most this many are left, unless none can be removed without turning others over.
    time_limit, memory_limit : float [s], int [bytes]
        Limits of the child process.

    Returns
    -------
    SurfaceMesh : the surface itself where it has no more triangles than that.

    Raises
    ------
    MeshingError : where `triangles` is below 4, or a surface without faults would get some, or change its volume by
        more than a tenth.
    """
    if isinstance(triangles, bool) or not isinstance(triangles, (int, np.integer)) or triangles < _LEAST:
        raise MeshingError(f"a surface is decimated to {_LEAST} triangles or more, not {triangles!r}")
    if len(surface.triangles) <= triangles:
        return surface
    low, high = surface.bounds
    middle, size = 0.5 * (low + high), float(np.linalg.norm(high - low)) or 1.0
    # The library's thresholds are lengths of surfaces of size 1. On faces along the axes all collapses cost exactly
    # nothing, and it leaves triangles without area there.
    unit = (surface.vertices - middle) / size @ _TURN.T
    before, problems = surface.check(), []
    for first in _FIRST:
        options = {"triangles": int(triangles), "first": first}
        result = run_mesher("decimation", unit, surface.triangles, options, Limits(time_limit, memory_limit))
        try:
            reduced = SurfaceMesh(result.vertices @ _TURN * size + middle, result.elements).compact()
        except MeshError as error:
            problems = problems or [str(error)]
            continue
        found = [] if not before.ok else list(reduced.check().problems)
        if before.ok and abs(reduced.volume - surface.volume) > _LARGEST_CHANGE * surface.volume:
            found.append(f"the volume changes from {surface.volume:.4g} to {reduced.volume:.4g} m^3")
        if not found:
            break
        problems = problems or found
    else:
        raise MeshingError(f"decimation to {triangles} triangles: {'; '.join(problems)}; give a larger number")
    change = f", volume {surface.volume:.6g} -> {reduced.volume:.6g} m^3" if before.watertight else ""
    logger.info("decimated the surface: %d -> %d triangles%s", len(surface.triangles), len(reduced.triangles), change)
    return reduced
