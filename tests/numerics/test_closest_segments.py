"""The closest points of two segments against bounded minimization and in degenerate positions."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from supple.numerics.geometry.closest_points import closest_on_segments


def gap(points, s, t):
    a, b, c, d = points
    return np.linalg.norm((1 - s) * a + s * b - (1 - t) * c - t * d)


def test_distances_are_those_of_bounded_least_squares():
    rng = np.random.default_rng(0)
    inside = 0
    for _ in range(300):
        points = rng.normal(size=(4, 3))
        s, t = closest_on_segments(*map(tuple, points))
        a, b, c, d = points
        best = lsq_linear(np.column_stack([b - a, c - d]), c - a, (0.0, 1.0), tol=1e-14).x
        assert gap(points, s, t) == pytest.approx(gap(points, *best), rel=1e-6)
        assert 0.0 <= s <= 1.0
        assert 0.0 <= t <= 1.0
        inside += 0.0 < s < 1.0 and 0.0 < t < 1.0
    assert inside > 20


@pytest.mark.parametrize("angle", [1e-3, 1e-6, 1e-9, 1e-12])
def test_almost_parallel_segments_that_cross_are_as_near_as_their_lines(angle):
    height = 1e-3 * angle
    points = np.array([[-1.0, 0, 0], [1.0, 0, 0], [-1.0, -angle, height], [1.0, angle, height]])
    assert gap(points, *closest_on_segments(*map(tuple, points))) == pytest.approx(height, rel=1e-2)


def test_parallel_segments_and_segments_without_length():
    beside = np.array([[0.0, 0, 0], [2.0, 0, 0], [1.0, 3.0, 4.0], [3.0, 3.0, 4.0]])
    assert gap(beside, *closest_on_segments(*map(tuple, beside))) == pytest.approx(5.0)
    after = np.array([[0.0, 0, 0], [1.0, 0, 0], [3.0, 0, 0], [7.0, 0, 0]])
    assert closest_on_segments(*map(tuple, after)) == (1.0, 0.0)
    point = np.array([[0.0, 0, 0], [2.0, 0, 0], [0.5, 1.0, 0], [0.5, 1.0, 0]])
    assert gap(point, *closest_on_segments(*map(tuple, point))) == pytest.approx(1.0)
    both = np.array([[0.0, 0, 0], [0.0, 0, 0], [0.0, 1.0, 0], [0.0, 1.0, 0]])
    assert gap(both, *closest_on_segments(*map(tuple, both))) == pytest.approx(1.0)
