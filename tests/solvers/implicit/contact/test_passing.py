"""One step longer than the things: they do not pass each other, and what does not meet is not divided."""

import numpy as np
import pytest

import supple as sp
from supple.contact.mesh.contact_mesh import mesh_of_triangles
from supple.contact.passing import Passing, _path
from supple.numerics.geometry.embedded_points import EmbeddedPoints

BALL = sp.shapes.sphere(0.02, 0.012)
RUBBER = sp.StableNeoHookean(youngs=1e6, poisson=0.4, density=1000)
DT = 1 / 60


def ball(name="ball", place=(-0.3, 0, 0), velocity=(20, 0, 0)):
    return sp.Body(name, BALL, RUBBER, position=place, velocity=velocity)


def run(bodies, obstacles=(), pins=(), solver=None, steps=4):
    scene = sp.Scene(bodies, obstacles, pins=pins, gravity=(0, 0, 0))
    return list(sp.simulate(scene, solver or sp.Implicit(), dt=DT, steps=steps))


def velocity(frame, name):
    return frame.velocities[name].mean(axis=0)


@pytest.mark.parametrize(
    ("speed", "integrator", "left"),
    [(4, "backward_euler", 0.3), (20, "bdf2", 0.1), (20, "newmark", 0.3), (100, "backward_euler", 0.5)],
)
def test_balls_that_meet_do_not_go_on(speed, integrator, left):
    """Without the test of the way, 97 to 100 % of the velocity is left. Backward Euler makes what is fast softer."""
    a, b = ball("a", (-0.3, 0, 0), (speed, 0, 0)), ball("b", (0.3, 0.003, 0), (-speed, 0, 0))
    frames = run([a, b], solver=sp.Implicit(integrator=integrator), steps=2 + round(0.3 / speed / DT))
    assert {frame.report.status for frame in frames} == {"converged"}
    assert velocity(frames[-1], "a")[0] < left * speed
    momentum = frames[-1].report.linear_momentum / frames[-1].system.masses.sum()
    assert np.abs(momentum).max() < 1e-6 * speed
    assert frames[-1].report.min_det_F > 0.1


def test_a_glancing_blow_is_that_of_short_steps():
    a, b = ball("a", (-0.3, 0, 0), (20, 0, 0)), ball("b", (0.3, 0.02, 0), (-20, 0, 0))
    after = velocity(run([a, b], steps=3)[-1], "a")
    # At 1/7680 s: (.70, -.35) of the speed.
    assert after[0] == pytest.approx(0.70 * 20, abs=0.15 * 20)
    assert after[1] == pytest.approx(-0.35 * 20, abs=0.15 * 20)


def test_a_step_that_may_not_be_divided_says_so():
    frames = run([ball("a"), ball("b", (0.3, 0.003, 0), (-20, 0, 0))], solver=sp.Implicit(max_substeps=1), steps=2)
    assert [frame.report.status for frame in frames] == ["tunnelled", "converged"]
    assert "body 'a' and body 'b' pass each other" in frames[0].report.message


def test_a_thin_plate_stops_a_ball_near_its_rim():
    plate = sp.obstacles.Box(name="plate", center=(0, 0, 0), size=(0.004, 0.2, 0.2))
    assert run([ball(place=(-0.3, 0.09, 0))], [plate])[-1].positions["ball"][:, 0].max() < 0.0


def test_a_rod_flies_through_a_ring_in_whole_steps():
    ring = sp.obstacles.Torus(name="ring", center=(0, 0, 0), axis=(1, 0, 0), radius=0.06, tube_radius=0.015)
    rod = sp.Body(
        "rod", sp.shapes.box((0.2, 0.02, 0.02), (8, 1, 1)), RUBBER, position=(-0.5, 0, 0), velocity=(20, 0, 0)
    )
    frames = run([rod], [ring])
    assert [frame.report.details.substeps for frame in frames] == [1, 1, 1, 1]
    np.testing.assert_allclose(velocity(frames[-1], "rod"), [20, 0, 0], atol=1e-6)


def test_a_bar_that_turns_sweeps_what_is_beside_its_chord():
    surface = sp.shapes.box_surface((1, 0.04, 0.04), (1, 1, 1))
    bar = sp.RigidBody("bar", surface, density=1000, angular_velocity=(0, 0, 40))
    frames = run([bar, ball(place=(0.3, 0.2, 0), velocity=(0, 0, 0))])
    assert velocity(frames[-1], "ball")[1] > 8.0


def test_a_script_and_a_pin_push_what_they_would_jump_over():
    way = sp.Keyframes([0, 0.2], displacements=[(0, 0, 0), (4, 0, 0)])
    bat = sp.obstacles.Box(name="bat", center=(-0.5, 0, 0), size=(0.02, 0.1, 0.1), motion=way)
    assert velocity(run([ball(place=(0, 0.003, 0), velocity=(0, 0, 0))], [bat])[-1], "ball")[0] > 15.0
    mesh = sp.shapes.box((0.3, 0.02, 0.02), (12, 1, 1))
    bar = sp.Body("bar", mesh, RUBBER, position=(-0.5, 0, 0), velocity=(20, 0, 0), rotation=(0, 0, np.pi / 2))
    pin = sp.Pin("bar", np.flatnonzero(mesh.vertices[:, 0] < mesh.vertices[:, 0].min() + 1e-9), way)
    assert velocity(run([bar, ball(place=(0, 0.05, 0), velocity=(0, 0, 0))], pins=[pin])[-1], "ball")[0] > 10.0


def test_ordinary_falls_are_not_divided():
    cube = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
    bodies = [sp.Body(f"{k}", cube, RUBBER, position=(0.03 * k, 0.06 + 0.15 * k, 0.02 * k)) for k in range(3)]
    floor = sp.obstacles.Box(name="floor", center=(0, -0.5, 0), size=(2, 1, 2), friction=0.5)
    frames = sp.simulate(sp.Scene(bodies, [floor]), sp.Implicit(), dt=DT, steps=20)
    assert {frame.report.details.substeps for frame in frames} == {1}


def test_every_owner_turns_evenly_on_the_direct_way():
    rng = np.random.default_rng(1)
    owner = np.repeat([0, 1], 8).astype(np.int32)
    begin = rng.normal(size=(16, 3))
    centers = np.stack([begin[:8].mean(axis=0), begin[8:].mean(axis=0)])
    c, s = np.cos(1.5), np.sin(1.5)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    moved = centers + rng.normal(size=(2, 3))
    end = np.concatenate([(begin[:8] - centers[0]) @ R.T + moved[0], begin[8:] - centers[1] + moved[1]])
    path = _path(begin, end, owner, centers, moved)
    assert len(path) == 8
    assert (path[0][0] == begin).all()
    assert (path[-1][1] == end).all()
    for k, (_, x) in enumerate(path[:-1]):
        sizes = np.linalg.norm(x[:8] - x[:8].mean(axis=0), axis=1)
        np.testing.assert_allclose(sizes, np.linalg.norm(begin[:8] - centers[0], axis=1), rtol=1e-12)
        t = (k + 1) / 8
        np.testing.assert_allclose(x[8:], (1 - t) * begin[8:] + t * end[8:], atol=1e-12)


@pytest.mark.parametrize(("place", "passes"), [(0.09, True), (0.0, False), (-0.09, True)])
def test_rods_do_not_slip_over_each_others_ends_within_a_step(place, passes):
    """One falls 12 mm onto another: farther than it is to the other's end, or less than the way beside both."""
    below = np.linspace([-0.1, 0.0, 0.0], [0.1, 0.0, 0.0], 11)
    above = np.linspace([place, 0.004, -0.1], [place, 0.004, 0.1], 10)
    x, lines = np.concatenate([below, above]), [np.arange(10), 11 + np.arange(9)]
    edges = np.concatenate([np.column_stack([line, line + 1, line + 1]) for line in lines])
    owner, every = np.repeat([0, 1], [11, 10]), np.ones((2, 2), dtype=np.bool_)
    mesh = mesh_of_triangles(
        EmbeddedPoints.at_vertices(np.arange(21)),
        edges,
        owner,
        x,
        body_count=2,
        names=("below", "above"),
        collide=every,
        offsets=np.full(21, 0.001),
    )
    end = x - np.outer(owner, [0.0, 0.012, 0.0])
    assert (Passing(mesh, x).between(x, end) is not None) == passes
