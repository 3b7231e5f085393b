"""Coulomb's law: what sticks, what slides and how far; between whom; never a gain of energy."""

import numpy as np
import pytest
from tests.scenes import converged

import supple as sp

ANGLE = np.deg2rad(26.565)  # tan = .5
NORMAL = np.array([np.sin(ANGLE), np.cos(ANGLE), 0.0])
TURN = (0.0, 0.0, -ANGLE)
GRAVITY = 9.81
TIME, DT = 1.25, 0.025


def downhill(mu):
    """Obstacles whose upper side is the slope."""
    sheet = sp.SurfaceMesh(
        np.array([[-3, 0, -1], [3, 0, -1], [3, 0, 1], [-3, 0, 1]])
        @ np.array([[NORMAL[1], -NORMAL[0], 0], [NORMAL[0], NORMAL[1], 0], [0, 0, 1]]),
        [[0, 2, 1], [0, 3, 2]],
    )
    return {
        "half-space": sp.HalfSpace(normal=NORMAL, friction=mu),
        "box": sp.obstacles.Box(center=-0.5 * NORMAL, size=(6, 1, 2), rotation=TURN, friction=mu),
        "sheet": sp.obstacles.TriangleObstacle(surface=sheet, friction=mu),
    }


def block(friction=0.0, size=0.2, youngs=1e9):
    material = sp.StableNeoHookean(youngs=youngs, poisson=0.3, density=1000.0)
    mesh = sp.shapes.box((size,) * 3, (1, 1, 1))
    return sp.Body("block", mesh, material, position=NORMAL * (size / 2 + 1e-4), rotation=TURN, friction=friction)


def slide(scene, time=TIME, dt=DT, **contact):
    """Frames, and how far the block has slid down at the end [m]."""
    frames = converged(sp.simulate(scene, sp.Implicit(contact=sp.IPCContact(**contact)), dt, round(time / dt)))
    body = scene.body("block")
    moved = (frames[-1].positions["block"] - body.place(body.mesh.vertices)).mean(axis=0)
    assert abs(moved @ NORMAL) < 1e-3
    return frames, float(np.linalg.norm(moved))


def way_down(mu, time=TIME, dt=DT):
    """The displacement that backward Euler gives under constant acceleration, once static friction is overcome."""
    return 0.5 * GRAVITY * (np.sin(ANGLE) - mu * np.cos(ANGLE)) * time * (time + dt)


@pytest.mark.parametrize("kind", ["half-space", "box", "sheet"])
def test_a_block_on_a_slope_sticks_at_the_angle_of_friction(kind):
    frames, way = slide(sp.Scene([block()], obstacles=[downhill(0.5)[kind]]), 1.0)
    slow = 1e-3 * 0.2 * 3**0.5
    assert way <= slow * 1.0
    assert np.linalg.norm(frames[-1].velocities["block"].mean(axis=0)) <= slow


@pytest.mark.parametrize("kind", ["half-space", "sheet", pytest.param("box", marks=pytest.mark.slow)])
def test_a_block_on_a_slope_slides_by_coulombs_law(kind):
    _, way = slide(sp.Scene([block()], obstacles=[downhill(0.49)[kind]]))
    assert way == pytest.approx(way_down(0.49), rel=0.02)


def test_friction_of_two_bodies_is_the_geometric_mean_of_their_coefficients():
    """A block of coefficient .8 on a pinned slab of .2 has .4; on an obstacle it has that of the obstacle."""
    slab_mesh = sp.shapes.box((2.4, 0.1, 0.6), (12, 1, 3))
    material = sp.StableNeoHookean(youngs=1e9, poisson=0.3, density=1000.0)
    slab = sp.Body("slab", slab_mesh, material, position=-0.05 * NORMAL, rotation=TURN, friction=0.2)
    pin = sp.Pin("slab", np.arange(len(slab_mesh.vertices)))
    scene = sp.Scene([block(friction=0.8), slab], pins=[pin])
    _, way = slide(scene, 1.0)
    assert way == pytest.approx(way_down(0.4, 1.0), rel=0.03)


def test_an_obstacles_coefficient_holds_for_all_bodies():
    floor = sp.HalfSpace(normal=NORMAL, friction=0.3)
    _, way = slide(sp.Scene([block(friction=0.9)], obstacles=[floor]), 1.0)
    assert way == pytest.approx(way_down(0.3, 1.0), rel=0.02)


@pytest.mark.parametrize("iterations", [1, 3, None])
def test_friction_brakes_a_sliding_block(iterations):
    """On a level floor: v0^2 / (2 mu g), with any number of friction iterations."""
    material = sp.StableNeoHookean(youngs=1e6, poisson=0.3, density=1000.0)
    mesh = sp.shapes.box((0.2, 0.1, 0.2), (1, 1, 1))
    body = sp.Body("block", mesh, material, position=(0, 0.0501, 0), velocity=(1, 0, 0))
    scene = sp.Scene([body], obstacles=[sp.HalfSpace(friction=0.5)])
    solver = sp.Implicit(contact=sp.IPCContact(friction_iterations=iterations))
    frames = converged(sp.simulate(scene, solver, 0.01, 30))
    way = frames[-1].positions["block"][:, 0].mean()
    assert way == pytest.approx(1.0 / (2 * 0.5 * GRAVITY), rel=0.06)
    # It stays where it stopped; and has never gained energy.
    assert np.abs(frames[-1].velocities["block"]).max() < 1e-3
    energies = np.array([f.report.kinetic_energy + f.report.elastic_energy + f.report.potential_energy for f in frames])
    assert np.diff(energies).max() < 1e-3 * frames[0].report.kinetic_energy


def test_friction_acts_on_both_with_opposite_forces():
    """Also where the other one is a half-space."""
    for kind in ("half-space", "box"):
        frames, _ = slide(sp.Scene([block(youngs=1e6)], obstacles=[downhill(0.5)[kind]]), 0.25)
        details = frames[-1].report.details
        forces = details.friction_forces
        name = next(key for key in forces if key != "block")
        weight = 8.0 * GRAVITY
        assert np.linalg.norm(forces["block"]) == pytest.approx(weight * np.sin(ANGLE), rel=0.05)
        assert np.linalg.norm(forces["block"] + forces[name]) < 1e-6 * weight
