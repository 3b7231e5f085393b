"""Skinning: points of a fine surface that follow the coarse tets they lie in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import MeshError
from supple.mesh.checked_arrays import frozen, vertex_array
from supple.mesh.quadratic import node_weights
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.runtime.kernel_cache import njit

# How many tets, nearest by centre, are tried for each point. In even meshes nearly every point lies in one of them.
NEAREST = 16
# How far below 0 a barycentric coordinate may be for the point still to count as inside.
SLACK = 1e-9
# Pairs of points and tets processed at once; bounds the memory needed.
BLOCK = 1_000_000


@dataclass(frozen=True, eq=False)
class Embedding:
    """Where points lie in a tet mesh, so that they can follow its deformation.

    A point inside the mesh is tied to the tet that contains it. A point outside is extrapolated from the tet, among
    those around it, for which its largest distance outside the four planes is smallest. Affine motions of the mesh are
    reproduced exactly, up to round-off.

    Attributes
    ----------
    tets : (k,) the tet that each point is tied to
    corners : (k, 4) vertices of that tet; (k, 10) its nodes in a mesh of quadratic tets
    weights : barycentric coordinates, or values of the quadratic shape functions [-]; they sum to 1
    vertex_count : vertices of the mesh
    outside : (k,) which points lie outside the mesh, of quadratic tets outside the straight ones between the corners
    """

    tets: NDArray[np.int32]
    corners: NDArray[np.int32]
    weights: NDArray[np.float64]
    vertex_count: int
    outside: NDArray[np.bool_]

    @classmethod
    def of(cls, mesh: TetMesh, points: ArrayLike) -> Embedding:
        """Find the tet of each point.

        Parameters
        ----------
        mesh : the coarse mesh, at rest
        points : (k, 3) [m], in the same coordinates

        Raises
        ------
        MeshError : where `points` is not a (k, 3) array of finite numbers.
        """
        places = vertex_array(points, "Embedding")
        tets = _containing_tets(mesh, places)
        weights = _barycentric(mesh, places, tets)
        outside = frozen(weights.min(axis=1) < -SLACK)
        if mesh.order == 2:
            weights = node_weights(mesh.vertices, mesh.nodes[tets], places, weights)
        return cls(
            frozen(tets.astype(np.int32)), frozen(mesh.nodes[tets]), frozen(weights), len(mesh.vertices), outside
        )

    def apply(self, positions: ArrayLike) -> NDArray[np.float64]:
        """Where the points (k, 3) are when the mesh's vertices are at `positions` (n, 3) [m].

        Raises
        ------
        MeshError : where `positions` does not have one row for each vertex of the mesh.
        """
        x = np.asarray(positions, dtype=np.float64)
        if x.shape != (self.vertex_count, 3):
            raise MeshError(f"Embedding: positions have shape {x.shape}; they must have shape ({self.vertex_count}, 3)")
        return mixed(self.corners, self.weights, np.ascontiguousarray(x))


@dataclass(frozen=True, eq=False)
class Skin:
    """Triangles whose vertices follow the vertices of a body.

    Attributes
    ----------
    corners : (k, 4) int32, rows of the body's vertices: the tet that carries each surface vertex; (k, 10) the nodes of
        a quadratic one
    weights : (k, 4) barycentric coordinates in it, or (k, 10) shape functions, summing to one; negative
        where the vertex lies outside
    triangles : (t, 3) int32, rows of `corners`
    """

    corners: NDArray[np.int32]
    weights: NDArray[np.float64]
    triangles: NDArray[np.int32]

    @classmethod
    def of(cls, mesh: TetMesh, surface: SurfaceMesh) -> Skin:
        """A surface in the coordinates of the mesh, without vertices that no triangle uses."""
        used = surface.compact()
        held = Embedding.of(mesh, used.vertices)
        return cls(held.corners, held.weights, used.triangles)

    def positions(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where the surface's vertices (k, 3) are when the body's are at x (n, 3) [m]."""
        return mixed(self.corners, self.weights, np.ascontiguousarray(x, dtype=np.float64))


@njit(cache=True)
def mixed(corners, weights, x):
    """Points (k, 3), each the sum of the rows `corners` (k, w) of x (n, 3), weighted by `weights` (k, w)."""
    out = np.empty((len(corners), 3))
    for i in range(len(corners)):
        for k in range(3):
            total = weights[i, 0] * x[corners[i, 0], k]
            for j in range(1, corners.shape[1]):
                total += weights[i, j] * x[corners[i, j], k]
            out[i, k] = total
    return out


def _containing_tets(mesh: TetMesh, points: NDArray[np.float64]) -> NDArray[np.int64]:
    """The tet that contains each point, or the one from which it is least far outside."""
    from scipy.spatial import KDTree

    corners = mesh.vertices[mesh.tets]
    centers = corners.mean(axis=1)
    search = _Search(mesh, points)
    count = min(NEAREST, len(centers))
    near = KDTree(centers).query(points, k=count, workers=-1)[1]
    search.offer(np.repeat(np.arange(len(points)), count), np.ravel(near))

    # A tet reaches no farther than `reach` from its centre. Where tets differ much in size, the one that contains a
    # point need not be among the nearest by centre: try every tet within reach, by classes of size.
    left = np.flatnonzero(search.distance > search.slack)
    if len(left) == 0:
        return search.tet
    reach = np.linalg.norm(corners - centers[:, None], axis=2).max(axis=1)
    size = np.floor(np.log2(reach)).astype(np.int64)
    tree = KDTree(points[left])
    for k in np.unique(size):
        members = np.flatnonzero(size == k)
        pairs = tree.sparse_distance_matrix(
            KDTree(centers[members]), float(reach[members].max()), output_type="ndarray"
        )
        search.offer(left[pairs["i"]], members[pairs["j"]])
    return search.tet


class _Search:
    """The best tet so far for each point: the one with the smallest largest distance outside its four planes."""

    def __init__(self, mesh: TetMesh, points: NDArray[np.float64]) -> None:
        self.mesh, self.points = mesh, points
        self.tet = np.zeros(len(points), dtype=np.int64)
        self.distance = np.full(len(points), np.inf)
        gradients = mesh.rest_shape_inverse
        first = -gradients.sum(axis=1, keepdims=True)
        # A barycentric coordinate times this is the distance from its plane.
        self.heights = 1.0 / np.linalg.norm(np.concatenate([first, gradients], axis=1), axis=2)
        self.slack = SLACK * float(self.heights.min())

    def offer(self, rows: NDArray[np.int64], tets: NDArray[np.int64]) -> None:
        """Try tets[k] for point rows[k]."""
        for start in range(0, len(rows), BLOCK):
            row, tet = rows[start : start + BLOCK], tets[start : start + BLOCK]
            out = (-_barycentric(self.mesh, self.points[row], tet) * self.heights[tet]).max(axis=1)
            before = self.distance[row]
            np.minimum.at(self.distance, row, out)
            # Of equally good tets (the point lies on a shared facet) the one of lowest number wins.
            better = (out == self.distance[row]) & (out < before)
            self.tet[row[better]] = len(self.mesh.tets)
            np.minimum.at(self.tet, row[better], tet[better])


def _barycentric(mesh: TetMesh, points: NDArray[np.float64], tets: NDArray[np.int64]) -> NDArray[np.float64]:
    """Barycentric coordinates (k, 4) of points (k, 3), each in its tet (k,)."""
    offset = points - mesh.vertices[mesh.tets[tets, 0]]
    last = np.einsum("kij,kj->ki", mesh.rest_shape_inverse[tets], offset)
    return np.column_stack([1.0 - last.sum(axis=1), last])
