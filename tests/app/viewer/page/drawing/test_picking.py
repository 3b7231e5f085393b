"""Points of surfaces under the mouse."""

import numpy as np
import pytest

from supple.app.viewer.messages import frame_of
from supple.results.view.picking import nearest_surface_point


@pytest.fixture
def frame(fake):
    return frame_of(fake.snapshot)


def place_of(frame, point):
    rows = point.vertices + point.body.vertices.start
    return point.weights @ frame.positions[rows]


def test_nearest_point_of_any_surface(frame):
    low, high = frame.positions[frame.model.bodies[1].vertices].min(axis=0), frame.positions.max(axis=0)
    point = nearest_surface_point(frame, high - np.array([-0.5, 0.3, 0.4]))
    assert point.body.name == "body 1"
    np.testing.assert_allclose(place_of(frame, point), high - [0.0, 0.3, 0.4], atol=1e-12)
    np.testing.assert_allclose(place_of(frame, nearest_surface_point(frame, low - 1.0)), point_of(frame, low))
    assert point.weights.min() >= 0.0
    assert point.weights.sum() == pytest.approx(1.0)


def point_of(frame, low):
    """The corner of the nearer body that is nearest to what lies below and before both."""
    offsets = np.linalg.norm(frame.positions - (low - 1.0), axis=1)
    return frame.positions[np.argmin(offsets)]
