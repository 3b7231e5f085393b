"""How far the boundary of tets is from a surface, and moving it until both enclose the same volume everywhere."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.numerics.geometry.triangle_tree import TriangleTree, closest_places

# Weights of three points in a triangle; their mean is exact for quadratic functions.
_POINTS = np.full((3, 3), 1.0 / 6.0) + 0.5 * np.eye(3)
_ROUNDS = 4
# A move that leaves a tet less than this share of its smallest height is halved.
_LEAST_HEIGHT = 0.6


def distance(mesh: TetMesh, surface: SurfaceMesh) -> float:
    """The Hausdorff distance [m] between the boundary of tets and a surface, by points on both.

    The points are the vertices and, on each triangle, points that are about as dense as the boundary's vertices.
    """
    boundary = mesh.surface.compact()
    farthest = 0.0
    for one, other in ((boundary, surface), (surface, boundary)):
        points = np.concatenate([one.vertices[one.used_vertices], _spread(one, 4 * len(boundary.triangles))])
        farthest = max(farthest, float(TriangleTree.of(other.vertices, other.triangles).nearest(points)[1].max()))
    return farthest


def fitted(mesh: TetMesh, surface: SurfaceMesh) -> TetMesh:
    """The mesh with its boundary moved along its normals, so that each part of it is on average on the surface.

    A coarse boundary cuts off what is convex and fills what is concave: without this, a ring of 2,000 tets lacks 8 % of
    its mass. Flat sides stay where they are. Sides of a wall thinner than a tet can pass each other: what did stays.
    """
    tree = TriangleTree.of(surface.vertices, surface.triangles)
    held = np.zeros(len(mesh.vertices), dtype=np.bool_)
    for _ in range(_ROUNDS):
        found = TetMesh(_moved(mesh, tree, held), mesh.tets)
        crossing = found.surface.check().intersecting_triangles
        if not len(crossing):
            return found
        held[found.surface.triangles[np.unique(crossing)]] = True
    return mesh


def _moved(mesh: TetMesh, tree: TriangleTree, held: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(n, 3) where vertices go that are not held [m]."""
    x, triangles = mesh.vertices.copy(), mesh.surface.triangles
    heights = _least_heights(x, mesh.tets)
    for _ in range(_ROUNDS):
        a, b, c = x[triangles].transpose(1, 0, 2)
        normals = np.cross(b - a, c - a)
        areas = np.linalg.norm(normals, axis=1)
        missing = areas * _missing(tree, np.einsum("kc,tcd->tkd", _POINTS, x[triangles])).mean(axis=1)
        vertex_normals, total, share = np.zeros_like(x), np.zeros(len(x)), np.zeros(len(x))
        for k in range(3):
            np.add.at(vertex_normals, triangles[:, k], normals)
            np.add.at(total, triangles[:, k], missing)
            np.add.at(share, triangles[:, k], areas)
        length = np.maximum(np.linalg.norm(vertex_normals, axis=1), 1e-300)
        move = (total / np.maximum(share, 1e-300) / length)[:, None] * vertex_normals
        move[held] = 0.0
        for halvings in range(_ROUNDS + 1):
            bad = _least_heights(x + move, mesh.tets) < _LEAST_HEIGHT * heights
            if not bad.any():
                break
            move[mesh.tets[bad]] *= 0.5 if halvings < _ROUNDS else 0.0
        while (bad := _least_heights(x + move, mesh.tets) < _LEAST_HEIGHT * heights).any():
            move[mesh.tets[bad]] = 0.0
        x += move
    return x


def _missing(tree: TriangleTree, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far points (m, k, 3) are from the surface: above 0 inside, below 0 outside [m]."""
    flat = points.reshape(-1, 3)
    found, distances = tree.nearest(flat)
    rows = tree.triangles[found]
    weights = closest_places(flat, tree.points, rows)
    corners = tree.points[rows]
    off = np.einsum("kc,kcd->kd", weights, corners) - flat
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return (np.sign(np.einsum("kd,kd->k", off, outward)) * distances).reshape(points.shape[:2])


def _least_heights(x: NDArray[np.float64], tets: NDArray[np.integer]) -> NDArray[np.float64]:
    """The smallest height (m,) [m] of each tet, with the sign of its volume."""
    a, b, c, d = x[tets].transpose(1, 0, 2)
    six = np.einsum("md,md->m", np.cross(b - a, c - a), d - a)
    largest = np.max(
        [np.linalg.norm(np.cross(q - p, r - p), axis=1) for p, q, r in ((a, b, c), (a, b, d), (a, c, d), (b, c, d))],
        axis=0,
    )
    return six / np.maximum(largest, 1e-300)


def _spread(surface: SurfaceMesh, count: int) -> NDArray[np.float64]:
    """About `count` points (k, 3), evenly over the surface, the same at each call."""
    areas = np.linalg.norm(surface.area_vectors, axis=1)
    shares = np.ceil(areas / areas.sum() * count).astype(np.int64)
    rows = np.repeat(np.arange(len(areas)), shares)
    # The additive sequence of the plastic number is even in the square; the square is folded onto the triangle.
    k = np.arange(1, len(rows) + 1)
    u, v = np.modf(0.7548776662466927 * k)[0], np.modf(0.5698402909980532 * k)[0]
    u, v = np.where(u + v > 1.0, (1.0 - u, 1.0 - v), (u, v))
    a, b, c = surface.vertices[surface.triangles[rows]].transpose(1, 0, 2)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a)
