"""`sp.modes` against closed forms: bars, free bodies, pins, stitches, welds, joints, springs; and what it refuses."""

import numpy as np
import pytest
from tests.scenes import bar, hinge, rigid

import supple as sp

STEEL = sp.StableNeoHookean(youngs=2e11, poisson=0.0, density=8000.0)
SIDE = 0.05
BENDING = np.sqrt(2e11 / 8000.0 / 12.0) * SIDE / (2.0 * np.pi)  # times (beta / L)^2 [Hz]


def beam(name="beam", length=1.0, cells=20, order=2, **values):
    return sp.Body(name, sp.shapes.box((length, SIDE, SIDE), (cells, 1, 1), order=order), STEEL, **values)


def clamped(body):
    return sp.Pin(body.name, np.flatnonzero(body.mesh.vertices[:, 0] < body.mesh.vertices[:, 0].min() + 1e-9))


def scene(*bodies, **values):
    return sp.Scene(list(bodies), **{"gravity": (0, 0, 0), **values})


def test_a_clamped_beam_bends_as_theory_says():
    body = beam()
    found = sp.modes(scene(body, pins=[clamped(body)]), 4).frequencies
    assert found[:2] == pytest.approx(1.8751**2 * BENDING, rel=0.005)
    assert found[2:4] == pytest.approx(4.6941**2 * BENDING, rel=0.015)  # shear and the inertia of turning are 1 %


def test_linear_tets_stretch_as_a_bar():
    mesh = sp.shapes.box((1.0, 0.02, 0.02), (50, 1, 1))
    body = sp.Body("bar", mesh, STEEL)
    stretches = np.sqrt(2e11 / 8000.0) / 4.0
    modes = sp.modes(scene(body, pins=[clamped(body)]), 30)
    along = [k for k in range(30) if np.abs(modes.shape(k)["bar"][:, 0]).max() > 0.9]
    assert modes.frequencies[along[0]] == pytest.approx(stretches, rel=1e-3)


def test_a_free_beam_has_six_rigid_motions_in_both_methods():
    for cells, rel in ((20, 0.02), (3, 0.3)):
        found = sp.modes(scene(beam(cells=cells)), 8).frequencies
        assert np.abs(found[:6]).max() < 1e-5 * found[6]
        assert found[6:] == pytest.approx(4.7300**2 * BENDING, rel=rel)


def test_shapes_are_those_of_the_simulation():
    body = beam(cells=8)
    held = scene(body, pins=[clamped(body)])
    modes = sp.modes(held, 2)
    x, shape, f = body.mesh.vertices, modes.shape(0)["beam"], modes.frequencies[0]
    assert np.linalg.norm(shape, axis=1).max() == pytest.approx(1.0)
    assert np.abs(shape[x[:, 0] < -0.5 + 1e-9]).max() == 0.0
    quarter = 0.25 / f
    steps, solver = 25, sp.Implicit(integrator="newmark", contact=None)
    start = {"beam": x + 1e-5 * shape}
    *_, last = sp.simulate(held, solver, quarter / steps, steps, initial_positions=start, strict=True)
    left = (last.positions["beam"] - x) / 1e-5
    speed = last.velocities["beam"] / (1e-5 * 2 * np.pi * f)
    assert np.abs(left).max() < 0.01
    assert np.abs(speed + shape).max() < 0.01


def test_two_stitched_halves_are_one_beam():
    one, other = (beam(name, 0.5, 10, position=(x, 0, 0)) for name, x in (("one", -0.25), ("other", 0.25)))
    left, right = one.mesh.vertices, other.mesh.vertices
    ends = np.flatnonzero(left[:, 0] > 0.25 - 1e-9)
    pairs = [(i, int(np.linalg.norm(right - left[i] * (-1, 1, 1), axis=1).argmin())) for i in ends]
    stitch = sp.VertexVertexStitch("one", "other", pairs=pairs, stiffness=1e12, rest_length=0.0)
    found = sp.modes(scene(one, other, pins=[clamped(one)], stitches=[stitch]), 2).frequencies
    assert found == pytest.approx(1.8751**2 * BENDING, rel=0.01)


def test_a_welded_end_holds_and_a_heavy_tip_slows():
    body = beam()
    wall = sp.RigidBody("wall", sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), density=1e4, position=(-0.55, 0, 0))
    weld = sp.Weld("beam", "wall", max_distance=1e-6)
    found = sp.modes(scene(body, wall, welds=[weld], pins=[sp.Pin("wall")]), 2).frequencies
    assert found == pytest.approx(1.8751**2 * BENDING, rel=0.005)
    # A tip of ten times the beam's mass, small against it: k = 3 E I / L^3 and 33/140 of the beam.
    mass = 8000.0 * SIDE**2
    tip = sp.RigidBody(
        "tip", sp.shapes.box((0.05, 0.05, 0.05), (1, 1, 1)), density=10 * mass / SIDE**3, position=(0.525, 0, 0)
    )
    weld = sp.Weld("beam", "tip", max_distance=1e-6)
    found = sp.modes(scene(body, tip, welds=[weld], pins=[clamped(body)]), 2).frequencies
    k = 3 * 2e11 * SIDE**4 / 12 / 1.025**3  # to the center of the tip, whose half is rigid
    assert found == pytest.approx(np.sqrt(k / (10 + 33 / 140) / mass) / 2 / np.pi, rel=0.01)


def test_a_pendulum_swings_about_its_equilibrium_and_falls_from_the_top():
    body = bar(density=1000.0)
    properties, center = body.properties, body.place(body.properties.center)
    point = (center[0], center[1] + 0.4, center[2])
    second = properties.second_moment
    inertia = second[0, 0] + second[1, 1] + properties.mass * 0.4**2
    expected = np.sqrt(properties.mass * 9.81 * 0.4 / inertia) / 2 / np.pi
    for gravity, sign in ((-9.81, 1), (9.81, -1)):
        hung = sp.Scene([body], joints=[hinge(point=point, axis=(0, 0, 1))], gravity=(0, gravity, 0))
        (still,) = sp.simulate(hung, sp.Implicit(integrator="static", contact=None), 1.0, 1, strict=True)
        found = sp.modes(hung, 1, start=still)
        assert found.frequencies == pytest.approx(sign * expected, rel=1e-4)


def test_a_rigid_body_on_a_spring():
    ball = rigid(density=500.0)
    center = ball.place(ball.properties.center)
    away = (center[0], center[1] + 1.0, center[2])
    spring = sp.Spring((ball.name, tuple(ball.properties.center)), (None, away), stiffness=2000.0)
    found = sp.modes(scene(ball, loads=[spring]), 6).frequencies
    assert np.abs(found[:5]).max() < 1e-3
    assert found[5] == pytest.approx(np.sqrt(2000.0 / ball.properties.mass) / 2 / np.pi)


def test_a_joint_counts_once_where_a_chain_is_closed():
    ball = rigid()
    place = tuple(ball.place(ball.properties.center))
    joints = [sp.HingeJoint(ball.name, None, point=place, axis=(0, 0, 1), name=name) for name in ("a", "b")]
    modes = sp.modes(scene(ball, joints=joints), 1)
    assert abs(modes.frequencies[0]) < 1e-3
    with pytest.raises(sp.SolverError, match="2 modes of a scene that has 1"):
        sp.modes(scene(ball, joints=joints), 2)


def test_a_mode_is_saved_as_a_recording(tmp_path):
    body = beam(cells=4)
    modes = sp.modes(scene(body, pins=[clamped(body)]), 2)
    modes.save(tmp_path / "out", mode=1, amplitude=0.02)
    recording = sp.read_recording(tmp_path / "out" / "recording.vtkhdf")
    assert (len(recording), recording.times[-1]) == (31, pytest.approx(1.0))
    paths = np.array([frame.positions["beam"] - body.mesh.vertices for frame in recording])
    assert np.linalg.norm(paths, axis=2).max() == pytest.approx(0.02, rel=0.01)
    assert paths[[0, -1]] == pytest.approx(0.0, abs=1e-12)
    for mode, amplitude, text in ((2, None, "mode 2 does not exist"), (0, -1.0, "amplitude is -1.0")):
        with pytest.raises(sp.SolverError, match=text):
            modes.save(tmp_path / "out", mode=mode, amplitude=amplitude)


def test_what_has_no_modes_says_why():
    body = beam(cells=2)
    everything = sp.Pin("beam", np.arange(len(body.mesh.vertices)))
    with pytest.raises(sp.SolverError, match="everything is held"):
        sp.modes(scene(body, pins=[everything]), 1)
    with pytest.raises(sp.SolverError, match="everything is held"):
        sp.modes(scene(rigid(), pins=[sp.Pin("rigid")]), 1)
    with pytest.raises(sp.SolverError, match="whole number above zero"):
        sp.modes(scene(body), 0)
    with pytest.raises(sp.SolverError, match="7 modes of a scene that has 6"):
        sp.modes(scene(rigid()), 7)
    with pytest.raises(sp.SolverError, match="ask for at most"):
        sp.modes(scene(beam()), 600)
    with pytest.raises(sp.SceneError, match="give a Scene"):
        sp.modes(body, 1)  # type: ignore[arg-type]
    springs = sp.EdgesAndVolume(edge_compliance=1e-9, volume_compliance=0.0, density=1000.0)
    with pytest.raises(sp.SolverError, match="XPBD"):
        sp.modes(scene(sp.Body("b", sp.shapes.box((1, 1, 1), (1, 1, 1)), springs)), 1)


def test_everything_at_once_is_solved_by_both_methods_alike(monkeypatch):
    from supple.solvers.implicit import natural_modes

    body = beam(cells=4)
    tip = sp.RigidBody("tip", sp.shapes.box((0.05, 0.05, 0.05), (1, 1, 1)), density=8000.0, position=(0.525, 0, 0))
    swing = sp.RigidBody("swing", sp.shapes.box((0.05, 0.2, 0.05), (1, 1, 1)), density=8000.0, position=(0.6, 0, 0))
    cable = sp.Cable([("swing", (0, -0.1, 0)), (None, (0.6, -1.0, 0.1))], length=1.0, stiffness=1e5)
    whole = scene(
        body,
        tip,
        swing,
        pins=[clamped(body)],
        welds=[sp.Weld("beam", "tip", max_distance=1e-6)],
        joints=[hinge("swing", "tip", point=(0.575, 0, 0), axis=(0, 0, 1))],
        cables=[cable],
    )
    one = sp.modes(whole, 8).frequencies
    monkeypatch.setattr(natural_modes, "_DENSE", 0)
    assert sp.modes(whole, 8).frequencies == pytest.approx(one, rel=1e-6, abs=0.1)
