"""The search over the tree of boxes against looking at every pair."""

import numpy as np
import pytest

import supple as sp
from supple.results.check.checks.contact import smallest_on_triangles
from supple.results.check.geometry.box_tree import tree_of
from supple.results.check.geometry.surface_pairs import Triangles, closest_pair, touching_pairs
from supple.results.check.geometry.triangle_distance import point_triangle, triangles_apart
from supple.results.check.geometry.triangle_pairs import triangles_meet


def soup(seed, count=120, size=0.25):
    rng = np.random.default_rng(seed)
    centers = rng.uniform(size=(count, 1, 3)) * [2.0, 1.0, 1.0]
    corners = (centers + rng.normal(scale=size, size=(count, 3, 3))).reshape(-1, 3)
    triangles = np.arange(3 * count).reshape(-1, 3)
    # Some neighbours with common corners.
    triangles[1::5, 0] = triangles[::5, 2]
    return corners, np.ascontiguousarray(triangles), rng.integers(0, 3, count)


def searched(x, triangles, owners, allowed, ignored=()):
    tree, out = tree_of(x, triangles), np.zeros((10_000, 2), dtype=np.int64)
    surface = Triangles(triangles, owners, allowed, np.array(sorted(ignored), dtype=np.int64))
    count = touching_pairs(surface, x, x, tree, tree, False, out)
    nearest = closest_pair(surface, x, tree, np.inf)
    return {tuple(sorted(pair)) for pair in out[:count].tolist()}, nearest


@pytest.mark.parametrize("size", [0.02, 0.3])
def test_all_pairs_are_found(size):
    x, triangles, owners = soup(3, size=size)
    allowed = np.ones((3, 3), dtype=bool)
    allowed[0, 0] = allowed[1, 2] = allowed[2, 1] = False
    n = len(triangles)
    pairs = [(a, b) for a in range(n) for b in range(a + 1, n) if allowed[owners[a], owners[b]]]
    truth = {(a, b) for a, b in pairs if triangles_meet(x, triangles[a], triangles[b])}
    ignored = {a * n + b for a, b in sorted(truth)[::3]}
    found, (squared, a, b) = searched(x, triangles, owners, allowed, ignored)
    assert found == {pair for pair in truth if pair[0] * n + pair[1] not in ignored}
    strangers = [
        (triangles_apart(x, triangles[p], triangles[q]), p, q)
        for p, q in pairs
        if not set(triangles[p]) & set(triangles[q]) and p * n + q not in ignored
    ]
    assert squared == min(strangers)[0]
    assert triangles_apart(x, triangles[a], triangles[b]) == squared
    assert size < 0.1 or len(truth) > 20


def test_no_triangles_and_one_triangle():
    for count in (0, 1):
        x, triangles, owners = soup(1, count)
        found, (squared, a, _) = searched(x, triangles, owners, np.ones((3, 3), dtype=bool))
        assert (found, a, squared) == (set(), -1, np.inf)


def test_distances_of_triangles():
    rng = np.random.default_rng(5)
    k = 30
    u, v = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 1, k), np.linspace(0, 1, k)))
    inside = u + v <= 1.0 + 1e-12
    weights = np.stack([1.0 - u - v, u, v], axis=1)[inside]
    for _ in range(60):
        x = rng.normal(size=(6, 3)) + np.repeat([[0.0, 0, 0], [2.0, 0, 0]], 3, axis=0)
        s, t = np.array([0, 1, 2]), np.array([3, 4, 5])
        if triangles_meet(x, s, t):
            continue
        sampled = np.linalg.norm((weights @ x[s])[:, None] - (weights @ x[t])[None], axis=2).min()
        distance = np.sqrt(triangles_apart(x, s, t))
        assert distance <= sampled + 1e-12
        assert sampled <= distance + 0.25
        point = x[3]
        from_point = np.sqrt(point_triangle(*(tuple(corner) for corner in (point, *x[s]))))
        assert from_point <= np.linalg.norm(weights @ x[s] - point, axis=1).min() + 1e-12
        ball = sp.obstacles.Sphere(center=point, radius=0.1)
        assert smallest_on_triangles(ball.signed_distance, x[s][None])[0] == pytest.approx(from_point - 0.1, abs=1e-12)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e3])
@pytest.mark.parametrize(
    ("second", "distance"),
    [
        ([[0.2, 0.2, 1e-6], [0.2, 0.4, 2], [0.4, 0.2, 2]], 1e-6),  # a corner over the face
        ([[0.5, -1e-3, -1], [0.5, -1e-3, 1], [0.5, -2, 0]], 1e-3),  # crossing sides
        ([[0, 0, 0.5], [1, 0, 0.5], [0, 1, 0.5]], 0.5),  # parallel
        ([[3, 0, 0], [4, 0, 0], [3, 1, 0]], 2.0),  # in one plane
        ([[-3, 0, -4], [-3, 0, -5], [-4, 0, -5]], 5.0),  # corner to corner
    ],
)
def test_known_distances(second, distance, scale):
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], *second], dtype=np.float64) * scale
    assert np.sqrt(triangles_apart(x, np.array([0, 1, 2]), np.array([3, 4, 5]))) == pytest.approx(
        distance * scale, rel=1e-12
    )
