"""What a mesh of quadratic tets has beyond its corners: nodes on edges, curved sides, and their checks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.mesh.topology import TET_FACETS
from supple.numerics.bernstein import determinant_coefficients, positive_elements
from supple.numerics.quadratic_shape_functions import (
    BETWEEN,
    NODE_EDGES,
    TURNED,
    conical_rule,
    reference_gradients,
    shape_functions,
)
from supple.runtime.kernel_cache import read_only


def reoriented_nodes(nodes: NDArray[np.int32], negative: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Tets (m, 4) or (m, 10) with corners 2 and 3 exchanged where `negative`."""
    order = TURNED[: nodes.shape[1]]
    return np.where(negative[:, None], nodes[:, order], nodes)


def with_middle_nodes(
    vertices: NDArray[np.float64], tets: NDArray[np.int32], edges: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices with the middles of the unique, sorted edges (e, 2) after them, and the tets' ten nodes."""
    n = len(vertices)
    keys = edges[:, 0].astype(np.int64) * n + edges[:, 1]
    ends = np.sort(tets[:, NODE_EDGES], axis=2).astype(np.int64)
    middle = n + np.searchsorted(keys, ends[:, :, 0] * n + ends[:, :, 1])
    points = np.concatenate([vertices, 0.5 * (vertices[edges[:, 0]] + vertices[edges[:, 1]])])
    return points, np.hstack([tets.astype(np.int64), middle])


def half_edges(nodes: NDArray[np.int32]) -> NDArray[np.int32]:
    """(e, 2) from each edge's middle node to its two ends, lower vertex first, sorted."""
    middle = nodes[:, 4:]
    pairs = np.concatenate([np.stack([nodes[:, NODE_EDGES[:, k]], middle], axis=2).reshape(-1, 2) for k in (0, 1)])
    return np.ascontiguousarray(np.unique(np.sort(pairs, axis=1), axis=0).astype(np.int32))


def facet_quarters(nodes: NDArray[np.int32], facet: NDArray[np.integer]) -> NDArray[np.int32]:
    """(4 t, 3) the four triangles of facet number `facet` (t,) of each of the tets (t, 10)."""
    a, b, c = TET_FACETS[facet].T
    ab, bc, ca = BETWEEN[a, b], BETWEEN[b, c], BETWEEN[c, a]
    local = np.stack([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))], axis=1)
    return np.ascontiguousarray(nodes[np.arange(len(nodes))[:, None, None], local].reshape(-1, 3))


def volumes_of(vertices: NDArray[np.float64], nodes: NDArray[np.int32]) -> NDArray[np.float64]:
    """(m,) exact volumes of quadratic tets (m, 10) [m^3]."""
    return determinant_coefficients(vertices, np.ascontiguousarray(nodes)).mean(axis=1) / 6.0


def node_volumes(vertices: NDArray[np.float64], nodes: NDArray[np.int32]) -> NDArray[np.float64]:
    """(m, 10) the part of each quadratic tet's volume that belongs to each of its nodes, all positive [m^3].

    In proportion to the integral of N_a^2, the diagonal of the consistent mass matrix: 1/36 to a corner and 4/27 to a
    node on an edge, where sides are straight. Their sum is the volume of the tet, and their center of mass that of a
    tet with straight sides.

    Source: Hinton, Rock, Zienkiewicz (1976), "A note on mass lumping and related processes in the finite element
    method".
    """
    places, weights = conical_rule(4)  # exact for N_a^2 times the determinant, of degree 7
    N, reference = shape_functions(places), reference_gradients(places)
    volumes = np.zeros((len(nodes), 10))
    for k in range(len(places)):
        jacobians = np.einsum("mai,aj->mij", vertices[nodes], reference[k])
        volumes += (weights[k] / 6.0 * np.linalg.det(jacobians))[:, None] * N[k] ** 2
    return volumes * (volumes_of(vertices, nodes) / volumes.sum(axis=1))[:, None]


def positive_tets(vertices: NDArray[np.float64], nodes: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(m,) whether the determinant of a quadratic tet is positive everywhere in it."""
    positive = np.empty(len(nodes), dtype=np.bool_)
    positive_elements(read_only(vertices), read_only(nodes), positive)
    return positive


def node_weights(
    vertices: NDArray[np.float64],
    nodes: NDArray[np.int32],
    points: NDArray[np.float64],
    guess: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(k, 10) values of the shape functions at points (k, 3), each in the quadratic tet of its nodes (k, 10).

    Newton's method on the curved map begins at barycentric coordinates `guess` (k, 4) in the straight tet. Where it
    does not converge, which can happen far outside, the weights are those of the straight tet's corners.
    """
    corners = vertices[nodes]
    size = np.abs(corners - corners[:, :1]).max(axis=(1, 2))
    places = guess.copy()
    for _ in range(20):
        missing = points - np.einsum("ka,kai->ki", shape_functions(places), corners)
        jacobian = np.einsum("kai,kaj->kij", corners, reference_gradients(places))
        singular = ~(np.abs(np.linalg.det(jacobian)) > 1e-12 * size**3)
        jacobian[singular] = np.eye(3)
        step = np.linalg.solve(jacobian, missing[:, :, None])[:, :, 0]
        step *= (1.0 / np.maximum(1.0, np.abs(step).max(axis=1)))[:, None]
        places[:, 1:] += step
        places[:, 0] = 1.0 - places[:, 1:].sum(axis=1)
    weights = shape_functions(places)
    missing = points - np.einsum("ka,kai->ki", weights, corners)
    lost = ~(np.abs(missing).max(axis=1) <= 1e-12 * (size + np.abs(points).max(axis=1)))
    weights[lost] = 0.0
    weights[lost, :4] = guess[lost]
    return weights


def check_middle_nodes(nodes: NDArray[np.int32], n_vertices: int) -> None:
    """Check that each edge has one node, that no other edge has, and that is not a corner.

    Raises
    ------
    MeshError : naming the edge or node.
    """
    ends = np.sort(nodes[:, NODE_EDGES], axis=2).reshape(-1, 2).astype(np.int64)
    middle = nodes[:, 4:].ravel()
    is_corner = np.zeros(n_vertices, dtype=bool)
    is_corner[nodes[:, :4]] = True
    if is_corner[middle].any():
        row = int(np.flatnonzero(is_corner[middle])[0])
        raise MeshError(
            f"TetMesh: tet {row // 6} has vertex {middle[row]} in the middle of an edge, and it is a corner of another "
            "tet; nodes must be in VTK's order, corners first"
        )
    keys = ends[:, 0] * n_vertices + ends[:, 1]
    for first, second, what in ((keys, middle, "edge"), (middle, keys, "node")):
        order = np.lexsort((second, first))
        a, b = first[order], second[order]
        differ = np.flatnonzero((a[1:] == a[:-1]) & (b[1:] != b[:-1]))
        if len(differ):
            one, two = (int(order[k]) for k in (differ[0], differ[0] + 1))
            if what == "edge":
                raise MeshError(
                    f"TetMesh: tets {one // 6} and {two // 6} share the edge {ends[one].tolist()}, with the middle "
                    f"nodes {middle[one]} and {middle[two]}; give it one node"
                )
            raise MeshError(
                f"TetMesh: vertex {middle[one]} is the middle node of the edges {ends[one].tolist()} and "
                f"{ends[two].tolist()}; give each edge its own node, in VTK's order"
            )


def check_positive(vertices: NDArray[np.float64], nodes: NDArray[np.int32]) -> None:
    """Check that every quadratic tet is mapped one to one from a straight one.

    Raises
    ------
    MeshError : naming the first tet with a determinant that is not positive everywhere in it.
    """
    bad = np.flatnonzero(~positive_tets(vertices, nodes))
    if len(bad):
        more = f" (and {len(bad) - 1} more)" if len(bad) > 1 else ""
        raise MeshError(
            f"TetMesh: quadratic tet {bad[0]} {nodes[bad[0]].tolist()} folds over itself or is flat somewhere{more}: "
            "the determinant of its map is not positive everywhere; move its middle nodes nearer to its edges, or give "
            "the nodes in VTK's order"
        )
