"""Rigid bodies in both solvers: rest and Coulomb's law on planes, pins, continued runs, starts that are refused."""

import numpy as np
import pytest
from tests.scenes import FLOOR, G, converged, rigid, soft

import supple as sp
from supple.scene.rotation import rotation_matrix

SOLVERS = {"xpbd": sp.XPBD(substeps=20, sleep_after=None), "implicit": sp.Implicit()}


@pytest.fixture(params=SOLVERS)
def solver(request):
    return request.param


def run(solver, scene, steps, dt=1 / 60, **more):
    return converged(sp.simulate(scene, SOLVERS[solver], dt, steps, **more))


def test_a_dropped_cube_comes_to_rest_and_presses_with_its_weight(solver):
    still, off, flat = {"xpbd": (1e-20, 1e-9, 1e-9), "implicit": (1e-10, 1e-4 * G, 1e-3)}[solver]
    cube = rigid(position=(0, 0.12, 0), rotation=(0.3, 0.2, 0), friction=0.5)
    frames = run(solver, sp.Scene([cube], obstacles=[FLOOR]), 60)
    assert min(frame.positions["rigid"][:, 1].min() for frame in frames) > 0.0
    last = frames[-1]
    assert last.report.kinetic_energy < still
    forces = last.report.details.contact_forces
    np.testing.assert_allclose(forces["rigid"], [0, G, 0], atol=off)
    np.testing.assert_allclose(forces["floor"], [0, -G, 0], atol=off)
    np.testing.assert_allclose(last.contact_force["rigid"].sum(axis=0), [0, G, 0], atol=off)
    assert np.sort(last.positions["rigid"][:, 1])[3] < flat + 1e-3  # one face is on the floor
    assert np.ptp(np.sort(last.positions["rigid"][:, 1])[:4]) < flat
    if solver == "xpbd":
        assert last.report.details.softening == {"rigid": 0.0}
    else:
        assert max(max(frame.report.details.orthogonality_errors.values()) for frame in frames) < 1e-3


@pytest.mark.parametrize(("friction", "slides"), [(0.5, False), (0.3, True)])
def test_a_cube_on_a_slope_sticks_or_slides_with_coulombs_acceleration(solver, friction, slides):
    slope, dt, steps = np.arctan(0.4), 0.01, 50
    normal, down = np.array([np.sin(slope), np.cos(slope), 0.0]), np.array([np.cos(slope), -np.sin(slope), 0.0])
    plane = sp.HalfSpace(point=(0, 0, 0), normal=normal, friction=friction)
    start, least, close = {"xpbd": (0.050006, 2e-6, 2e-3), "implicit": (0.0501, 1e-3, 0.01)}[solver]
    scene = sp.Scene([rigid(position=start * normal, rotation=(0, 0, -slope), friction=0.5)], obstacles=[plane])
    way = run(solver, scene, steps, dt)[-1].poses["rigid"].translation @ down
    # n steps of backward Euler go n (n + 1) / 2 h^2 times the acceleration.
    h = dt / (20 if solver == "xpbd" else 1)
    time = steps * dt
    expected = 0.5 * G * (np.sin(slope) - friction * np.cos(slope)) * time * (time + h)
    assert way == pytest.approx(expected, rel=close) if slides else way < least


def test_pins_hold_and_move_bodies_exactly(solver):
    motion = sp.Keyframes([0.0, 1.0], displacements=[(0, 0, 0), (0.1, 0.2, 0)], angles=[0.0, 1.0], axis=(0, 1, 0))
    bodies = [rigid("held", position=(0.5, 0, 0)), rigid("driven")]
    scene = sp.Scene(bodies, pins=[sp.Pin("held"), sp.Pin("driven", motion=motion)])
    for frame in run(solver, scene, 30)[14::15]:
        np.testing.assert_allclose(frame.poses["held"].translation, [0.5, 0, 0], atol=1e-14)
        driven, time = frame.poses["driven"], frame.time
        np.testing.assert_allclose(driven.translation, [0.1 * time, 0.2 * time, 0], atol=1e-12)
        np.testing.assert_allclose(driven.rotation, rotation_matrix((0, time, 0)), atol=1e-12)
        np.testing.assert_allclose(driven.angular_velocity, [0, 1, 0], atol=1e-5 if solver == "xpbd" else 1e-4)


def test_a_run_that_continues_has_the_same_bits(solver):
    bodies = [
        rigid(position=(0, 0.0501, 0), friction=0.5),
        rigid("high", position=(0.01, 0.155, 0), rotation=(0, 0.3, 0), friction=0.5),
        soft(position=(0.2, 0.06, 0)),
    ]
    scene = sp.Scene(bodies, obstacles=[FLOOR])
    whole = run(solver, scene, 12)
    rest = run(solver, scene, 6, start=whole[5])
    np.testing.assert_array_equal(rest[-1].state.positions, whole[-1].state.positions)
    np.testing.assert_array_equal(rest[-1].state.velocities, whole[-1].state.velocities)
    for name in ("rigid", "high"):
        np.testing.assert_array_equal(rest[-1].positions[name], whole[-1].positions[name])


def test_starts_inside_of_something_are_refused(solver):
    scene = sp.Scene([rigid("a"), rigid("b", position=(0.0, 0.09, 0.0))])
    remedy = {"xpbd": "move it out", "implicit": "move body 'b' by"}[solver]
    with pytest.raises(sp.SceneError, match=rf"body 'a' overlaps body 'b' at the start .* {remedy}"):
        run(solver, scene, 1)
