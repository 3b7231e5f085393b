"""The tree finds the same triangles as a search through all of them."""

import numpy as np
import pytest

from supple.numerics.geometry.triangle_tree import TriangleTree, pair_distances


def soup(count, seed):
    rng = np.random.default_rng(seed)
    centers = rng.uniform(-1, 1, (count, 1, 3)) ** 3  # dense in the middle
    sizes = 10.0 ** rng.uniform(-3, 0, (count, 1, 1))
    corners = centers + sizes * rng.normal(size=(count, 3, 3))
    return corners.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


def every_distance(queries, points, triangles):
    rows = np.tile(np.arange(len(triangles)), len(queries))
    return pair_distances(np.repeat(queries, len(triangles), axis=0), points, triangles[rows]).reshape(len(queries), -1)


@pytest.mark.parametrize("count", [1, 2, 5, 64, 300])
@pytest.mark.parametrize("collapse", [0, 1, 2], ids=["triangles", "edges", "points"])
def test_agrees_with_a_search_through_all_triangles(count, collapse):
    points, triangles = soup(count, 7 * count)
    triangles[:, 3 - collapse :] = triangles[:, [2 - collapse]]
    queries = np.random.default_rng(1).normal(size=(40, 3))
    tree = TriangleTree.of(points, triangles)
    distances = every_distance(queries, points, triangles)
    found, nearest = tree.nearest(queries)
    assert np.array_equal(found, distances.argmin(axis=1))
    assert np.allclose(nearest, distances.min(axis=1), rtol=1e-12)
    limit = float(np.median(distances.min(axis=1)))
    near, how_near = tree.nearest(queries, limit * (1 + 1e-9))
    assert np.array_equal(near >= 0, distances.min(axis=1) <= limit * (1 + 1e-9))
    assert np.isinf(how_near[near < 0]).all()
    of_query, rows, lengths = tree.all_within(queries, limit)
    expected = np.nonzero(distances <= limit * (1 + 1e-12))
    assert np.array_equal(of_query, expected[0])
    assert np.array_equal(rows, expected[1])
    assert np.allclose(lengths, distances[expected])


def test_an_edge_as_a_triangle_has_the_distance_of_an_edge():
    points = np.array([[0.0, 0, 0], [2, 0, 0]])
    queries = np.array([[1.0, 3, 4], [-3, 0, 4], [5, 0, 4], [2, 0, 0]])
    edges = np.repeat([[0, 1, 1]], 4, axis=0).astype(np.int32)
    assert pair_distances(queries, points, edges).tolist() == [5.0, 5.0, 5.0, 0.0]


@pytest.mark.parametrize("shift", [0.0, 1.0, 1000.0])
def test_of_equally_near_triangles_that_touch_the_lowest_number_wins(shift):
    rng = np.random.default_rng(2)
    ring = np.array([[np.cos(a), np.sin(a), 0.1 * a] for a in np.linspace(0, 2 * np.pi, 13)[:-1]])
    points = np.concatenate([[[0.1, 0.2, 0.3]], ring]) @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + shift
    fan = np.array([[0, 1 + k, 1 + (k + 1) % 12] for k in range(12)], dtype=np.int32)
    for start in range(12):
        turned = np.roll(fan, start, axis=0)
        found, distances = TriangleTree.of(points, turned).nearest(points)
        assert found[0] == 0
        for vertex in range(1, 13):
            assert found[vertex] == min(np.flatnonzero((turned == vertex).any(axis=1)))
        assert distances.max() < 1e-12 * (1.0 + shift)


def test_of_equally_near_triangles_the_one_that_faces_the_point_wins():
    roof = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1], [1, 0, 1], [0, -1, 0], [1, -1, 0]])
    side, top, top_again = [0, 1, 4], [0, 2, 1], [1, 2, 3]
    triangles = np.array([side, top, top_again], dtype=np.int32)
    # Above the edge of side and top; above the edge of both tops; beside the edge, in front of the side; beyond it.
    queries = np.array([[0.5, 0.2, 0.0], [0.5, 0.2, 0.5], [0.5, 0.0, -0.2], [0.5, 0.2, -0.3]])
    for order in ([0, 1, 2], [2, 1, 0], [1, 0, 2]):
        found, _ = TriangleTree.of(roof, triangles[order]).nearest(queries)
        number = {original: place for place, original in enumerate(order)}
        assert found.tolist() == [number[1], min(number[1], number[2]), number[0], number[0]]


@pytest.mark.slow
def test_a_hundred_thousand_against_a_hundred_thousand():
    """Takes seconds (not asserted); a search through all 10^10 pairs would take a quarter of an hour."""
    n = 223
    grid = np.stack(np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij"), -1).reshape(-1, 2)
    heights = 0.1 * np.sin(7 * grid[:, 0]) * np.cos(5 * grid[:, 1])
    points = np.column_stack([grid, heights])
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    triangles = np.concatenate([np.column_stack([a, a + 1, a + n + 2]), np.column_stack([a, a + n + 2, a + n + 1])])
    queries = np.random.default_rng(0).uniform(0, 1, (100_000, 3)) * [1, 1, 0.3]
    found, distances = TriangleTree.of(points, triangles).nearest(queries)
    assert len(triangles) == 99_458
    assert (found >= 0).all()
    sample = np.arange(0, 100_000, 5_000)
    assert np.allclose(
        every_distance(queries[sample], points, triangles.astype(np.int32)).min(axis=1), distances[sample]
    )
