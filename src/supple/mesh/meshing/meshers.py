"""The meshers: TetGen for clean closed surfaces, and Mmg for the size of tets.

Sources: Dapogny, Dobrzynski, Frey 2014, "Three-dimensional adaptive domain remeshing, implicit domain meshing, and
applications to free and moving boundary problems"; Si 2015, "TetGen, a Delaunay-based quality tetrahedral mesh
generator".
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from supple.mesh.meshing.child_process import Limits, MesherResult, run_mesher
from supple.mesh.meshing.option_names import option
from supple.mesh.surface import SurfaceMesh


def _remedy() -> str:
    return (
        f"; the surface is most likely damaged or has details near round-off: fix it ({option('repair', True)}) or use "
        f"{option('mesher', 'stuffing')}"
    )


def mesh_with_tetgen(surface: SurfaceMesh, options: dict[str, Any], limits: Limits) -> MesherResult:
    """Tets inside a clean surface, without those in its cavities.

    `options`: max_volume [m^3], quality, min_dihedral [degrees], the number of points to add (each may be None) and
    keep_surface.

    Raises
    ------
    MesherFailure : with TetGen's message and the remedy.
    """
    # Scaled by a power of two, so that no bit of the coordinates is lost; TetGen's tolerances suit a unit size best.
    low, high = surface.bounds
    scale = 2.0 ** -math.frexp(float((high - low).max()) or 1.0)[1]
    volume = options["max_volume"]
    scaled = options | {"max_volume": None if volume is None else volume * scale**3}
    result = run_mesher("tetgen", surface.vertices * scale, surface.triangles, scaled, limits, _remedy())
    vertices = result.vertices / scale
    return replace(result, vertices=vertices)


# How far Mmg may move the surface, as a share of the length of edges. With .1, a bracket of 2,000 tets has .8 % more
# volume before it is fitted, at edges of 10 mm; with .03 such a number needs edges of 25 mm.
MMG_DISTANCE = 0.1
# Tets of Mmg: so many for each cube of the edge in the volume, and for each square of it in the area. Solids (washer,
# gear) had 13 to 21 of the first, walls (cup, panel) 3.4 to 4.7 of the second.
_OF_VOLUME, TETS_OF_SQUARE = 14.0, 4.0


def mesh_with_mmg(
    surface: SurfaceMesh,
    *,
    tets: int | None,
    edge: float | None,
    limits: Limits,
) -> MesherResult:
    """Tets of a number or of a length of edges [m] in a clean surface, remeshed; none in its cavities.

    Parameters
    ----------
    tets, edge : one of them

    Raises
    ------
    MesherFailure : with the message and the remedy.
    """
    low, high = surface.bounds
    middle, size = 0.5 * (low + high), float((high - low).max()) or 1.0
    length = edge if edge is not None else edge_of_count(tets or 1, surface.area, surface.volume)
    options = {
        "tets": None if tets is None else int(tets),
        "edge": length / size,
        "distance": MMG_DISTANCE,
    }
    result = run_mesher("mmg", (surface.vertices - middle) / size, surface.triangles, options, limits, _remedy())
    return replace(result, vertices=result.vertices * size + middle)


def edge_of_count(tets: float, area: float, volume: float) -> float:
    """About the length of edges [m] with which Mmg makes so many tets in a body of an area and a volume."""
    # One positive root: tets = a / h^3 + b / h^2.
    a, b = _OF_VOLUME * abs(volume), TETS_OF_SQUARE * area
    roots = np.roots([tets, 0.0, -b, -a])
    return float(np.real(roots[np.abs(np.imag(roots)) < 1e-9 * np.abs(roots)]).max())
