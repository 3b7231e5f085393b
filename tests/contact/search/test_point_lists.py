"""Candidate pairs against brute force."""

import numpy as np
import pytest

from supple.contact.search.point_lists import PairFinder
from supple.numerics.geometry.closest_points import closest_on_triangle


def distance(p, a, b, c):
    """From a point to a triangle, by projecting on the plane and on the three edges."""
    n = np.cross(b - a, c - a)
    n /= np.linalg.norm(n)
    q = p - np.dot(p - a, n) * n
    if all(np.dot(np.cross(v - u, q - u), n) >= 0 for u, v in ((a, b), (b, c), (c, a))):
        return abs(np.dot(p - a, n))
    best = np.inf
    for u, v in ((a, b), (b, c), (c, a)):
        t = np.clip(np.dot(p - u, v - u) / np.dot(v - u, v - u), 0, 1)
        best = min(best, np.linalg.norm(p - u - t * (v - u)))
    return best


def test_closest_point_agrees_with_the_plane_and_the_edges():
    rng = np.random.default_rng(1)
    for _ in range(300):
        p, a, b, c = rng.normal(size=(4, 3))
        u = closest_on_triangle(tuple(p), tuple(a), tuple(b), tuple(c))
        assert min(u) >= -1e-12
        assert sum(u) == pytest.approx(1)
        assert np.linalg.norm(p - u[0] * a - u[1] * b - u[2] * c) == pytest.approx(distance(p, a, b, c), abs=1e-12)


def find(points, triangles, far, near, pieces, excluded=None):
    finder = PairFinder(np.ones(len(points), dtype=bool))
    starts, masked = excluded if excluded else (np.zeros(len(triangles) + 1, np.int64), np.zeros(0, np.int32))
    shapes = (points, pieces, triangles, pieces[triangles[:, 0]])
    k = int(pieces.max()) + 1
    finder.gather(shapes, (far, near), (np.ones((k, k), bool), starts, masked))
    found = [(p, t) for p in range(len(points)) for t in finder.triangles[finder.starts[p] : finder.starts[p + 1]]]
    active = finder.active[: finder.n_active].tolist()
    assert active == sorted({p for p, _ in found})
    return found


# The second: triangles of two pieces among each other, which no group of points may mix.
@pytest.mark.parametrize("pieces", [np.arange(90) // 45, np.arange(90) // 3 % 2])
def test_each_near_pair_is_found_once_and_no_other(pieces):
    rng = np.random.default_rng(2)
    points = rng.uniform(-1, 1, size=(90, 3))
    triangles = np.arange(90, dtype=np.int32).reshape(-1, 3)
    points[1::3] = points[::3] + rng.normal(scale=0.2, size=(30, 3))
    points[2::3] = points[::3] + rng.normal(scale=0.2, size=(30, 3))
    points[0:3] = [[-3, -0.1, -3], [3, -0.1, -3], [0, 0.1, 3]]  # one triangle far larger than others
    pieces = pieces.astype(np.int32)
    far, near = rng.uniform(0, 0.2, size=(90, 3)), rng.uniform(0, 0.1, size=(90, 3))
    far[7, 0] = 2.5  # a point with a large search radius
    expected = []
    for p in range(90):
        for t, corners in enumerate(triangles):
            if p in corners:
                continue
            look = near if pieces[p] == pieces[corners[0]] else far
            if distance(points[p], *points[corners]) <= look[p, 0] + look[corners, 1].max():
                expected.append((p, t))
    assert find(points, triangles, far, near, pieces) == expected
    assert len(expected) > 60


def test_groups_that_are_kept_while_points_move_lose_no_pair():
    rng = np.random.default_rng(4)
    points = rng.uniform(-1, 1, size=(60, 3))
    triangles = np.arange(60, dtype=np.int32).reshape(-1, 3)
    pieces = (np.arange(60) // 3 % 2).astype(np.int32)
    shapes = (points, pieces, triangles, pieces[triangles[:, 0]])
    rules = (np.ones((2, 2), bool), np.zeros(21, np.int64), np.zeros(0, np.int32))
    radii = np.full((60, 3), 0.2)
    finder = PairFinder(np.ones(60, dtype=bool))
    for _ in range(4):
        finder.gather(shapes, (radii, radii), rules)
        found = [(p, t) for p in range(60) for t in finder.triangles[finder.starts[p] : finder.starts[p + 1]]]
        assert found == find(points, triangles, radii, radii, pieces)
        points += rng.normal(scale=0.05, size=(60, 3))


def test_excluded_pairs_and_positions_that_are_not_finite_are_omitted():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0.2, 0.1, 0.2], [0.3, 0.1, 0.3]], dtype=float)
    triangles = np.array([[0, 1, 2]], dtype=np.int32)
    pieces = np.zeros(5, dtype=np.int32)
    look = np.full((5, 3), 0.2)
    assert find(points, triangles, look, look, pieces) == [(3, 0), (4, 0)]
    masked = (np.array([0, 1]), np.array([3], dtype=np.int32))
    assert find(points, triangles, look, look, pieces, masked) == [(4, 0)]
    points[1, 1] = np.nan
    assert find(points, triangles, look, look, pieces) == []
