"""Coulomb friction: sticking and sliding on slopes, on moving obstacles, and between bodies."""

import numpy as np
import pytest

import supple as sp
from supple.solvers.xpbd.solver import XPBD

SLOPE = np.arctan(0.5)  # 26.565 degrees
NORMAL = np.array([np.sin(SLOPE), np.cos(SLOPE), 0.0])
DOWN = np.array([np.cos(SLOPE), -np.sin(SLOPE), 0.0])


def block(position, size=(0.2, 0.1, 0.2), divisions=(2, 1, 2), friction=0.0, tilted=False, name="block"):
    material = sp.StableNeoHookean(youngs=1e6, poisson=0.3, density=1000)
    turn = (0, 0, -SLOPE if tilted else 0)
    return sp.Body(name, sp.shapes.box(size, divisions), material, position=position, rotation=turn, friction=friction)


def centers(scene, steps, substeps=20, dt=1 / 60):
    """Center of mass of every body, after each step (steps, bodies, 3)."""
    rows, system = [], None
    for frame in sp.simulate(scene, XPBD(substeps=substeps, accuracy=0.9), dt, steps):
        assert frame.report.status == "converged"
        system = frame.system
        m = system.masses
        rows.append([m[r.vertices] @ frame.state.positions[r.vertices] / m[r.vertices].sum() for r in system.bodies])
    return np.array(rows)


@pytest.fixture(scope="module")
def on_slope():
    """Travel down the slope of a block that starts flat on it, for each coefficient, frame by frame [m]."""

    def travel(mu, steps):
        body = block(0.05 * NORMAL, tilted=True)
        scene = sp.Scene([body], [sp.HalfSpace(normal=NORMAL, friction=mu)])
        return (centers(scene, steps)[:, 0] - 0.05 * NORMAL) @ DOWN

    return travel


def test_block_sticks_where_mu_is_above_the_slope(on_slope):
    travel = on_slope(0.6, 60)
    assert abs(travel[-1]) < 1e-3
    assert abs(travel[-1] - travel[29]) < 1e-4  # the rest is shear deformation at the beginning


@pytest.mark.parametrize("mu", [0.4, 0.0])
def test_block_slides_with_the_analytic_acceleration(on_slope, mu):
    travel = on_slope(mu, 60)
    t = np.arange(1, 61) / 60
    expected = 9.81 * (np.sin(SLOPE) - mu * np.cos(SLOPE))
    fitted = 2 * np.polyfit(t[9:], travel[9:], 2)[0]
    assert fitted == pytest.approx(expected, rel=0.02)


def test_a_block_moves_with_a_slow_floor():
    # 1 m/s^2 is below mu g: the block keeps up with the floor.
    floor = sp.HalfSpace(friction=0.5, motion=lambda t: (0.5 * t * t, 0, 0))
    moved = centers(sp.Scene([block((0, 0.05, 0))], [floor]), 60)[-1, 0]
    assert moved[0] == pytest.approx(0.5, abs=0.01)
    assert abs(moved[2]) < 1e-3


def test_a_block_slides_on_a_floor_that_starts_too_fast():
    floor = sp.HalfSpace(friction=0.2, motion=lambda t: (10 * t, 0, 0))
    moved = centers(sp.Scene([block((0, 0.05, 0))], [floor]), 30)[-1, 0]
    assert moved[0] == pytest.approx(0.5 * 0.2 * 9.81 * 0.5**2, rel=0.05)


def test_a_block_moves_with_a_turntable():
    turn = sp.Keyframes([0, 1], angles=[0, 0.5], axis=(0, 1, 0))
    table = sp.obstacles.Box(center=(0, -0.1, 0), size=(2, 0.2, 2), friction=0.8, motion=turn)
    moved = centers(sp.Scene([block((0.5, 0.05, 0))], [table]), 60)[-1, 0]
    assert moved[[0, 2]] == pytest.approx([0.5 * np.cos(0.5), -0.5 * np.sin(0.5)], abs=5e-3)


@pytest.mark.parametrize(("mu", "sticks"), [(0.6, True), (0.2, False)])
def test_friction_between_bodies_uses_the_geometric_mean(mu, sticks):
    plank = block(0.05 * NORMAL, size=(0.6, 0.1, 0.3), divisions=(5, 1, 3), friction=mu**2, tilted=True, name="plank")
    rider = block(0.1506 * NORMAL, friction=1.0, tilted=True, name="rider")
    x = centers(sp.Scene([plank, rider], [sp.HalfSpace(normal=NORMAL, friction=2.0)]), 24, substeps=60)
    slipped = (x[:, 1] - x[:, 0]) @ DOWN
    if sticks:
        assert slipped[-1] - slipped[12] < 1e-4
        assert slipped[-1] - slipped[0] < 5e-3
    else:
        expected = 9.81 * (np.sin(SLOPE) - mu * np.cos(SLOPE))
        assert 2 * np.polyfit(np.arange(4, 24) / 60, slipped[4:], 2)[0] == pytest.approx(expected, rel=0.05)
