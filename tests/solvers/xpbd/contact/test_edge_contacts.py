"""Edges against edges: bodies whose vertices do not meet any face."""

import ipctk
import numpy as np
import pytest
from tests.scenes import contact_gap

import supple as sp
from supple.model.system import build_system
from supple.solvers.xpbd.solver import XPBD

STUFF = sp.StableNeoHookean(youngs=2e5, poisson=0.4, density=1000)


def crossing(speed=1.0, friction=0.0):
    """Two square bars, each standing on an edge, one across the other: only two long edges meet."""
    bar = sp.shapes.box((0.4, 0.05, 0.05), (1, 1, 1))
    turned = (np.pi / 4, 0, 0)
    low = sp.Body("low", bar, STUFF, rotation=turned, friction=friction)
    across = sp.TetMesh(bar.vertices[:, [2, 1, 0]] * [1, 1, -1], bar.tets)
    high = sp.Body(
        "high",
        across,
        STUFF,
        position=(0.013, 0.09, 0.007),
        rotation=(0, 0, np.pi / 4),
        velocity=(0, -speed, 0),
        friction=friction,
    )
    return sp.Scene([low, high], gravity=(0, 0, 0))


def surfaces_meet(frame):
    return meet(frame.system, frame.state.positions)


def meet(system, positions):
    mesh = ipctk.CollisionMesh(system.rest_positions, system.edges, system.triangles)
    return ipctk.has_intersections(mesh, np.asfortranarray(positions))


@pytest.mark.parametrize("speed", [0.3, 3.0])
@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_two_crossing_bars_stop_each_other(speed, friction):
    scene = crossing(speed, friction)
    system = build_system(scene)
    state = next(iter(sp.simulate(scene, XPBD(), 1e-9, 1))).state
    m = system.masses[:, None]
    linear, angular = (m * state.velocities).sum(axis=0), np.cross(state.positions, m * state.velocities).sum(axis=0)
    energy = 0.5 * np.sum(m * state.velocities**2)
    smallest = []
    for frame in sp.simulate(scene, XPBD(substeps=40), 1 / 60, 30):
        assert not surfaces_meet(frame)
        now = m * frame.state.velocities
        assert np.abs(now.sum(axis=0) - linear).max() < 1e-11 * np.abs(linear).max()
        moment = np.cross(frame.state.positions, now).sum(axis=0)
        assert np.abs(moment - angular).max() < 1e-10 * np.abs(linear).max()
        assert frame.report.kinetic_energy + frame.report.elastic_energy < energy * 1.02
        if frame.report.details.smallest_gap is not None:
            smallest.append(frame.report.details.smallest_gap)
    thickness = contact_gap(scene.bodies[0])
    assert min(smallest) == pytest.approx(thickness, rel=0.05)


def test_a_bar_rests_across_another_and_keeps_the_thickness():
    """Pinned below; the upper bar is held against falling off by friction."""
    scene = crossing(0.0, 1.0)
    low, high = scene.bodies
    pinned = sp.Pin("low", np.arange(len(low.mesh.vertices)))
    scene = sp.Scene([low, high], pins=[pinned], gravity=(0, -1.0, 0))
    thickness = contact_gap(low)
    gaps = []
    for frame in sp.simulate(scene, XPBD(substeps=40), 1 / 60, 30):
        assert not surfaces_meet(frame)
        gaps.append(frame.report.details.smallest_gap or np.inf)
    assert min(gaps) == pytest.approx(thickness, rel=0.05)


def test_a_bar_stops_on_an_edge_of_a_triangle_obstacle():
    scene = crossing(2.0)
    low, high = scene.bodies
    obstacle = sp.obstacles.TriangleObstacle(sp.SurfaceMesh(low.place(low.mesh.vertices), low.mesh.surface.triangles))
    for frame in sp.simulate(sp.Scene([high], [obstacle], gravity=(0, 0, 0)), XPBD(substeps=20), 1 / 60, 20):
        assert frame.positions["high"][:, 1].mean() > 0.05


def bears(seed, speed, count):
    """Soft bodies with dents that collide: their faces do not tell which side of an edge is free."""
    generator = np.random.default_rng(seed)
    mesh = sp.shapes.gummy_bear(height=0.1, edge_length=0.014)
    soft = sp.StableNeoHookean(youngs=2e4, poisson=0.45, density=1100)
    bodies = []
    for k in range(count):
        place = (0.02 * generator.normal(), 0.13 * k, 0.01 * generator.normal())
        turned, velocity = 0.4 * generator.normal(size=3), (0, -speed * (k - 0.5), 0)
        bodies.append(sp.Body(f"bear {k}", mesh, soft, position=place, rotation=turned, velocity=velocity))
    return sp.Scene(bodies, gravity=(0, 0, 0))


@pytest.mark.parametrize(("seed", "speed"), [(1, 6.0), (2, 10.0), (5, 6.0), (8, 10.0)])
def test_bodies_with_dents_do_not_cross_at_a_fixed_number_of_substeps(seed, speed):
    for frame in sp.simulate(bears(seed, speed, 2), XPBD(substeps=40), 1 / 60, 10):
        assert not surfaces_meet(frame)
        assert frame.report.min_det_F > 0.0


def test_frames_in_which_motion_was_truncated_are_reported():
    """Bears that meet at 20 m/s, with far too few substeps."""
    frames = list(sp.simulate(bears(2, 10.0, 3), XPBD(substeps=5), 1 / 60, 3))
    assert frames[0].report.status in ("truncated", "energy_gained")
    assert "motion was truncated in 80 % of the substeps" in frames[0].report.message
    assert not any(surfaces_meet(frame) for frame in frames)


def test_bars_that_begin_through_each_other_are_separated():
    """There, what passes through something is on its way out."""
    scene = crossing(0.0)
    low, high = scene.bodies
    inside = sp.Body("high", high.mesh, STUFF, position=(0.013, 0.066, 0.007), rotation=(0, 0, np.pi / 4))
    system = build_system(sp.Scene([low, inside]))
    assert meet(system, system.rest_positions)
    frames = list(sp.simulate(sp.Scene([low, inside], gravity=(0, 0, 0)), XPBD(start="push_out"), 1 / 60, 40))
    assert frames[0].report.status != "converged"
    assert not surfaces_meet(frames[-1])
    # Nothing takes the kinetic energy of parting again.
    assert frames[-1].report.status in ("converged", "energy_gained")
