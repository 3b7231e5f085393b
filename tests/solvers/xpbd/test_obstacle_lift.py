"""Vertices are taken out of simple shapes by one displacement of all."""

import numpy as np
import pytest

import supple as sp
from supple.model.system import build_system, initial_state
from supple.solvers.xpbd.rigid_fallback import ObstacleLift, RigidFallback

CUBE = sp.shapes.box((0.2, 0.2, 0.2), (2, 2, 2))
JELLY = sp.StableNeoHookean(youngs=1e4, poisson=0.4)
CORNER = [sp.HalfSpace(), sp.HalfSpace((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0))]


def system_with(obstacles, **body):
    return build_system(sp.Scene([sp.Body("cube", CUBE, JELLY, **body)], obstacles))


def test_the_deepest_vertices_come_to_the_skin_of_each_shape():
    system = system_with(CORNER, position=(0.5, 0.5, 0))
    x = initial_state(system.scene).positions
    lift = ObstacleLift(system, 1e-4)
    rows = np.arange(len(x))
    d = lift.displacement(x + np.array([0.43, -0.47, 0]), x, rows, (0.0, 0.01))
    np.testing.assert_allclose(d, [-0.0301, 0.0701, 0], atol=1e-15)
    np.testing.assert_array_equal(lift.displacement(x + np.array([0.3, -0.3, 0]), x, rows, (0.0, 0.01)), 0.0)
    inner = np.setdiff1d(rows, system.triangles)
    np.testing.assert_array_equal(lift.displacement(x - 1.0, x, inner, (0.0, 0.01)), 0.0)


def test_an_old_overlap_remains_and_a_moving_shape_carries_its_own():
    system = system_with([sp.HalfSpace(motion=lambda t: (0, t, 0))], position=(0, 0.05, 0))
    x = initial_state(system.scene).positions
    d = ObstacleLift(system, 0.0).displacement(x, x, np.arange(len(x)), (0.0, 0.01))
    np.testing.assert_allclose(d, [0, 0.01, 0], atol=1e-15)


@pytest.mark.parametrize("speed", [1.0, 30.0])
def test_a_body_whose_motion_is_shortened_stops_at_a_floor(speed):
    system = system_with([sp.HalfSpace()], position=(0, 0.11, 0))
    rest, h = initial_state(system.scene).positions, 0.1
    velocities = np.tile([0.5, -speed, 0.0], (len(rest), 1))
    points = np.column_stack([rest + h * velocities, system.inverse_masses])
    bounds = np.full(len(system.tets), -np.inf)
    RigidFallback(system, 1e-4).apply(
        points, velocities, rest.copy(), rest, np.zeros_like(rest), h, bounds, h, [[0]], 0.5
    )
    assert points[:, 1].min() == pytest.approx(1e-4)
    np.testing.assert_allclose(velocities, np.tile([0.5, (1e-4 - 0.01) / h, 0.0], (len(rest), 1)), atol=1e-12)
