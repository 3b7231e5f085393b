"""Which points are inside closed surfaces, and how deep, from positions alone: for overlaps without a known history."""

import math

import numpy as np
from numpy.typing import NDArray

from supple.contact.search.surfaces import ContactSurfaces
from supple.numerics.geometry.box_tree import boxes_of_labels
from supple.numerics.geometry.closest_points import closest_on_triangle, combine
from supple.numerics.mat3 import dot, row, subtract
from supple.runtime.kernel_cache import njit


@njit
def _crosses_above(y, z, p, q):
    """Whether the segment p q, projected along x, crosses the line of this y above z; for q p the same, bit for bit."""
    if (p[1] > y) == (q[1] > y):
        return False
    if p[1] > q[1]:
        p, q = q, p
    return p[2] + (y - p[1]) / (q[1] - p[1]) * (q[2] - p[2]) > z


@njit
def _ray_hits(q, a, b, c):
    """Whether the ray from q along +x crosses the triangle; neighbours decide in the same way at their common edge."""
    if max(a[0], b[0], c[0]) < q[0]:
        return False
    hit = _crosses_above(q[1], q[2], a, b)
    hit ^= _crosses_above(q[1], q[2], b, c)
    hit ^= _crosses_above(q[1], q[2], c, a)
    if not hit:
        return False
    u, v, d = subtract(b, a), subtract(c, a), subtract(q, a)
    # x of the plane at (y, z) of the ray
    det = u[1] * v[2] - u[2] * v[1]
    if det == 0.0:
        return False
    s, t = (d[1] * v[2] - d[2] * v[1]) / det, (u[1] * d[2] - u[2] * d[1]) / det
    return a[0] + s * u[0] + t * v[0] > q[0]


@njit(cache=True)
def depths_inside(shapes, closed, allowed, boxes, out):
    """Write into out (n,) how deep each point is inside another piece that it may touch [m]; 0 outside of all pieces.

    Parameters
    ----------
    shapes : points (n, 3), point_piece (n,), triangles (t, 3), triangle_piece (t,) in ascending order
    closed : (p,); allowed : (p, p); boxes : low, high (p, 3) of the pieces' points
    """
    points, point_piece, triangles, triangle_piece = shapes
    low, high = boxes
    out[:] = 0.0
    begin = 0
    while begin < len(triangles):
        k = triangle_piece[begin]
        end = begin
        while end < len(triangles) and triangle_piece[end] == k:
            end += 1
        if closed[k]:
            for p in range(len(points)):
                mine = point_piece[p]
                q = row(points, p)
                within = mine != k and allowed[mine, k]
                for j in range(3):
                    within = within and low[k, j] <= q[j] <= high[k, j]
                if not within:
                    continue
                inside, nearest = False, math.inf
                for t in range(begin, end):
                    a, b, c = row(points, triangles[t, 0]), row(points, triangles[t, 1]), row(points, triangles[t, 2])
                    inside ^= _ray_hits(q, a, b, c)
                if not inside:
                    continue
                for t in range(begin, end):
                    a, b, c = row(points, triangles[t, 0]), row(points, triangles[t, 1]), row(points, triangles[t, 2])
                    d = subtract(q, combine(closest_on_triangle(q, a, b, c), a, b, c))
                    nearest = min(nearest, dot(d, d))
                out[p] = max(out[p], math.sqrt(nearest))
        begin = end


def find_depths(surfaces: ContactSurfaces, x: NDArray[np.float64], depth: NDArray[np.float64]) -> None:
    """Write how deep points x (n, 3) are inside of other bodies, and of obstacles, to `depth` (2, n) [m]."""
    s = surfaces
    depth[:] = 0.0
    if not (s.allowed & ~np.eye(len(s.allowed), dtype=np.bool_)).any():
        return
    both = boxes_of_labels(np.concatenate([x, x], axis=1), s.point_piece, len(s.closed))
    boxes = both[:, :3].copy(), both[:, 3:].copy()
    for kind, part in enumerate((slice(0, s.body_triangles), slice(s.body_triangles, None))):
        shapes = (x, s.point_piece, s.triangles[part], s.triangle_piece[part])
        depths_inside(shapes, s.closed, s.allowed, boxes, depth[kind])
