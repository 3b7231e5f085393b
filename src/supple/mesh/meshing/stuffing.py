"""Tets of a lattice in any surface that encloses something: with holes, of several shells, with crossing triangles."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError, MeshingError
from supple.mesh.meshing.child_process import DEFAULT_TETS
from supple.mesh.meshing.option_names import option
from supple.mesh.meshing.sizes import allow
from supple.mesh.primitives.isosurface_stuffing import MEAN_EDGE, stuff
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.numerics.geometry.triangle_tree import TriangleTree
from supple.numerics.geometry.winding_number import winding_numbers

logger = logging.getLogger(__name__)

_MOST_TRIES = 8
# The number of tets falls with so great a power of the edge.
_SLOPE = 2.7
# Where walls are lost, the next lattice has edges of this share, and about twice the tets.
_FINER = 0.75
# Of a wish for few tets, for thin walls: more of them take long to find.
_MORE = 5
# Of cuts: to .4 % of an edge. Each one costs a winding number.
_BISECTIONS = 8
# Of moving the boundary: a ball of 24 tets lacks 3, .5 and .1 % of its volume after one, two and three.
_ROUNDS = 3
_TOLERANCE = 0.1
# Of the edge, by which the boundary is moved outward for the volume: where it is more, walls are thinner than tets. A
# ball of 24 tets has .15, one of 192 .07 (of the mean edge).
_FARTHEST = 0.2
# Points in the box around the surface by which its volume is counted, along each side.
_GRID = 64


def stuffed(surface: SurfaceMesh, tets: int | None, edge: float | None) -> tuple[TetMesh, float]:
    """Well-shaped tets where the surface winds around points more than half a time; and the volume there [m^3].

    Sharp edges are rounded at the size of a tet; the boundary is then moved outward until the volume is right.

    Parameters
    ----------
    tets : the number of them, within 10 % where the lattice can; edge : otherwise, the mean length of their edges [m]

    Raises
    ------
    MeshingError : where the surface encloses nothing, or walls are thinner than tets.
    """
    tree = TriangleTree.of(surface.vertices, surface.triangles)
    low, high = surface.bounds
    # A lattice point of a flat side is neither inside nor outside.
    middle, half = 0.5 * (low + high), 0.5 * (high - low) * (1.0 + 1e-3) + 1e-9 * float((high - low).max())

    def inside(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return 0.5 - winding_numbers(tree, points)

    steps = (np.arange(_GRID) + 0.5) / _GRID * 2.0 - 1.0
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    volume = float((inside(middle + half * grid) < 0.0).mean() * np.prod(2.0 * half))
    if volume < 1e-6 * float((high - low).max()) ** 3:
        raise MeshingError("the surface encloses nothing: close its holes, or give it a thickness")
    length = edge or MEAN_EDGE * (12.0 * volume / (tets or 1)) ** (1.0 / 3.0)
    best, made, longest = None, None, np.inf  # edges of that length lose walls
    for _ in range(_MOST_TRIES if tets else 1):
        made = _lattice(inside, (middle - half, middle + half), length)
        wanted = tets or 0
        if made is None or not _keeps_walls(made, volume, surface):
            longest = length
            if made is not None and len(made.tets) > max(wanted, _MORE * min(wanted, DEFAULT_TETS)):
                break
            length *= _FINER
            continue
        if best is None or abs(len(made.tets) - wanted) < abs(len(best.tets) - wanted):
            best = made
        following = min(length * (len(made.tets) / max(wanted, 1)) ** (1.0 / _SLOPE), _FINER**0.5 * longest)
        if abs(len(made.tets) - wanted) <= _TOLERANCE * wanted or length <= following < length / _FINER**0.25:
            break
        length = following
    if best is None:
        more = 2 * max(tets or 0, 1 if made is None else len(made.tets))
        raise MeshingError(
            f"the surface is filled with a lattice, and its walls are thinner than edges, {length:.3g} m; "
            f"ask for more tets ({option('tets', more)}), or clean the surface ({option('repair', True)})"
        )
    if tets and len(best.tets) > 1.25 * tets and longest < np.inf:
        allow(f"a lattice that keeps the surface's walls has {len(best.tets):,} tets", len(best.tets), tets)
        logger.warning("%s tets instead of %s: longer ones lose walls", f"{len(best.tets):,}", f"{tets:,}")
    return as_large(best, volume), volume


def _lattice(
    inside: Callable[[NDArray[np.float64]], NDArray[np.float64]], box: tuple[Any, Any], length: float
) -> TetMesh | None:
    """The tets of one lattice with edges of a length [m]; None where it has none inside."""
    try:
        return stuff("stuffing", inside, box, length, _BISECTIONS)
    except MeshError as error:
        if "no tet is left" in str(error):
            return None
        raise MeshingError(str(error).replace("make edge_length longer", "ask for fewer tets")) from None


def _keeps_walls(mesh: TetMesh, volume: float, surface: SurfaceMesh) -> bool:
    """Whether a lattice lacks so little of the surface's volume [m^3] that it has lost no wall."""
    missing = (volume - mesh.volume) / mesh.surface.compact().area
    edge = MEAN_EDGE * (12.0 * mesh.volume / len(mesh.tets)) ** (1.0 / 3.0)
    return missing <= _FARTHEST * edge and mesh.components.count <= surface.components.count


def as_large(mesh: TetMesh, volume: float) -> TetMesh:
    """The mesh, whose surface cuts corners, with its surface moved outward until it has this volume [m^3]."""
    surface = mesh.surface.triangles
    rows = np.unique(surface)
    for _ in range(_ROUNDS):
        x = mesh.vertices.copy()
        areas = 0.5 * np.cross(x[surface[:, 1]] - x[surface[:, 0]], x[surface[:, 2]] - x[surface[:, 0]])
        normals = np.zeros_like(x)
        np.add.at(normals, surface.ravel(), np.repeat(areas, 3, axis=0))
        length = np.maximum(np.linalg.norm(normals[rows], axis=1), 1e-300)
        move = (volume - float(mesh.volumes.sum())) / np.linalg.norm(areas, axis=1).sum()
        x[rows] += move * normals[rows] / length[:, None]
        corners = x[mesh.tets]
        if not (np.linalg.det(corners[:, 1:] - corners[:, :1]) > 0.0).all():
            break
        mesh = TetMesh(x, mesh.tets)
    return mesh
