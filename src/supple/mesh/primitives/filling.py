"""Tets of the ready-made shapes: between layers of a surface, and quadratic ones with curved sides."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from supple.mesh.quadratic import positive_tets
from supple.mesh.tetmesh import TetMesh
from supple.mesh.topology import TET_FACETS, unique_edges

# Points (k, 3) -> the points of the surface next to them; NaN for a point that belongs to no curved side.
Onto = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def of_order(mesh: TetMesh, order: int, onto: Onto | None = None) -> TetMesh:
    """A mesh of linear tets as one of this order.

    Parameters
    ----------
    onto : the curved surface. The middle nodes of edges on the surface are moved onto it, but stay where they are in
        tets that would fold.

    Raises
    ------
    MeshError : for another order than 1 and 2.
    """
    straight = mesh.to_order(order)
    if straight is mesh or onto is None:
        return straight
    n = len(mesh.vertices)
    tet, facet = np.nonzero(mesh.adjacency < 0)
    outside = unique_edges(mesh.tets[tet[:, None], TET_FACETS[facet]], n).astype(np.int64)
    edges = mesh.edges.astype(np.int64)
    middle = n + np.searchsorted(edges[:, 0] * n + edges[:, 1], outside[:, 0] * n + outside[:, 1])
    moved = onto(straight.vertices[middle])
    on_curve = np.isfinite(moved).all(axis=1)
    curved = straight.vertices.copy()
    curved[middle[on_curve]] = moved[on_curve]
    while not (good := positive_tets(curved, straight.nodes)).all():
        back = straight.nodes[~good, 4:]
        curved[back] = straight.vertices[back]
    return TetMesh(curved, straight.nodes)


def tets_between_layers(triangles: NDArray[np.integer], points: int, layers: int) -> NDArray[np.int64]:
    """(3 t layers, 4) tets between layers + 1 copies of triangles (t, 3), of this many points each.

    The quad between two columns is cut from the bottom of the lower-numbered one, so that neighbours agree.
    """
    a0, a1, a2 = np.sort(triangles.astype(np.int64), axis=1).T
    b0, b1, b2 = a0 + points, a1 + points, a2 + points
    layer = np.concatenate([np.column_stack(t) for t in ((a0, a1, a2, b2), (a0, a1, b1, b2), (a0, b0, b1, b2))])
    return (layer[None] + points * np.arange(layers)[:, None, None]).reshape(-1, 4)
