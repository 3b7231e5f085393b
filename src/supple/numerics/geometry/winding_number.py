"""How many times closed surfaces wind around points: whether points are inside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.numerics.geometry.triangle_tree import TriangleTree
from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit, prange

# A node that is farther away than so many of its radii counts as one dipole. Barill et al. use 2.
_FAR = 2.3


@njit(cache=True)
def winding_number(x, triangles, q):
    """Of a closed surface of triangles (t, 3) of x (n, 3) about q: 1 inside, 0 outside, -1 inside an inward one."""
    total = 0.0
    for t in range(len(triangles)):
        total += half_solid_angle(x, triangles, t, q)
    return total / (2.0 * np.pi)


@njit
def half_solid_angle(x, triangles, t, q):
    """Of triangle t, seen from q. Source: van Oosterom, Strackee, "The solid angle of a plane triangle" (1983)."""
    a = subtract(row(x, triangles[t, 0]), q)
    b = subtract(row(x, triangles[t, 1]), q)
    c = subtract(row(x, triangles[t, 2]), q)
    la, lb, lc = np.sqrt(dot(a, a)), np.sqrt(dot(b, b)), np.sqrt(dot(c, c))
    det = dot(a, cross(b, c))
    return np.arctan2(det, la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb)


def winding_numbers(tree: TriangleTree, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of a surface, which may have holes and cut itself, about each point (k, 3): about 1 or more inside, 0 outside.

    Source: Barill et al., "Fast Winding Numbers for Soups and Clouds" (2018), with dipoles; errors are below .05.
    """
    corners = tree.points[tree.triangles[tree.order]]
    areas = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(areas, axis=1)[:, None]
    sums = np.cumsum(
        np.concatenate([np.zeros((1, 7)), np.hstack([areas, size * corners.mean(axis=1), size])[:, :7]]), 0
    )
    nodes = sums[tree.bounds[:, 1]] - sums[tree.bounds[:, 0]]
    middle = nodes[:, 3:6] / np.maximum(nodes[:, 6:], 1e-300)
    reach = np.maximum(tree.boxes[:, 3:] - middle, middle - tree.boxes[:, :3])
    radius = np.where(nodes[:, 6] > 0.0, np.linalg.norm(np.where(np.isfinite(reach), reach, 0.0), axis=1), 0.0)
    out = np.empty(len(points))
    _winding_numbers(np.ascontiguousarray(points), *tree, np.ascontiguousarray(nodes[:, :3]), middle, radius, out)
    return out


@njit(cache=True, parallel=True)
def _winding_numbers(points, x, triangles, order, bounds, boxes, areas, middle, radius, out):
    for k in prange(len(points)):
        q = row(points, k)
        stack = np.empty(64, dtype=np.int64)
        stack[0] = 0
        depth, total = 1, 0.0
        while depth > 0:
            depth -= 1
            node = stack[depth]
            if bounds[node, 0] == bounds[node, 1]:
                continue
            off = subtract(row(middle, node), q)
            square = dot(off, off)
            if square > (_FAR * radius[node]) ** 2:
                total += dot(off, row(areas, node)) / (2.0 * square * np.sqrt(square))
                continue
            left = 2 * node + 1
            if left < len(boxes):
                stack[depth], stack[depth + 1] = left, left + 1
                depth += 2
                continue
            for i in range(bounds[node, 0], bounds[node, 1]):
                total += half_solid_angle(x, triangles, order[i], q)
        out[k] = total / (2.0 * np.pi)
