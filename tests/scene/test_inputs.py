"""Inputs: motions and forces that are set while the simulation runs, by a callback and by `send`."""

import numpy as np
import pytest

import supple as sp
from supple.errors import SceneError
from supple.scene.inputs import Ramp

DT = 1 / 60
MESH = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2))
SOFT = sp.StableNeoHookean(youngs=2e4, poisson=0.3, density=1000, damping=0.02)


def held_cube(motion=None, force=None):
    body = sp.Body("cube", MESH, SOFT)
    top = sp.InBox((-1, 0.049, -1), (1, 1, 1))
    bottom = sp.InBox((-1, -1, -1), (1, -0.049, 1))
    forces = [] if force is None else [sp.Force("cube", bottom, force)]
    return sp.Scene([body], pins=[sp.Pin("cube", top, motion)], forces=forces)


def test_a_motion_is_straight_within_a_frame_and_a_force_constant():
    first, last = np.zeros(3), np.array([2.0, 0.0, 0.0])
    motion, force = sp.MotionInput("hand"), sp.ForceInput("push")
    motion.ramp = force.ramp = Ramp(1.0, 2.0, first, last)
    assert [motion(time)[0] for time in (0.5, 1.0, 1.25, 2.0, 3.0)] == [0.0, 0.0, 0.5, 2.0, 2.0]
    assert [force(time)[0] for time in (0.5, 1.0, 1.25, 2.0, 3.0)] == [0.0, 0.0, 2.0, 2.0, 2.0]


@pytest.mark.parametrize("solver", [sp.XPBD(substeps=5), sp.Implicit(integrator="bdf2")], ids=["xpbd", "bdf2"])
def test_an_input_does_what_a_script_with_the_same_values_does(solver):
    """The script is straight from frame to frame too, so the bits are equal up to the round-off of its values."""
    places = 0.01 * np.sin(np.arange(9.0))

    def script(time):
        return (np.interp(time, DT * np.arange(9), places), 0.0, 0.0)

    scripted = [frame.state for frame in sp.simulate(held_cube(script), solver, DT, 8)]
    scene = held_cube(sp.MotionInput("hand"))
    steered = sp.simulate(scene, solver, DT, 8, control=lambda frame: {"hand": (places[frame.index + 1], 0.0, 0.0)})
    for expected, frame in zip(scripted, steered, strict=True):
        assert np.abs(frame.state.positions - expected.positions).max() < 1e-9
        assert frame.state.inputs["hand"][0] == places[frame.index]


def test_send_sets_an_input_for_the_next_step_and_it_stays():
    run = sp.simulate(held_cube(sp.MotionInput("hand")), sp.XPBD(substeps=5), DT, 5)
    pinned = MESH.vertices[:, 1] > 0.049
    lifted = [next(run)] + [run.send(values) for values in ({"hand": (0, 0.02, 0)}, None, {"hand": (0, 0.01, 0)})]
    heights = [frame.positions["cube"][pinned, 1].mean() - 0.05 for frame in lifted]
    assert heights == pytest.approx([0.0, 0.02, 0.02, 0.01], abs=1e-12)


def test_a_force_input_accelerates_like_the_force():
    body = sp.Body("cube", MESH, SOFT)
    everything = np.arange(len(MESH.vertices))
    scene = sp.Scene([body], forces=[sp.Force("cube", everything, sp.ForceInput("push"))], gravity=(0, 0, 0))
    run = sp.simulate(scene, sp.XPBD(substeps=5), DT, 3)
    momenta = [next(run).report.linear_momentum[0]]
    momenta += [run.send(values).report.linear_momentum[0] for values in ({"push": (3.0, 0, 0)}, {"push": (0, 0, 0)})]
    assert momenta == pytest.approx([0.0, 3.0 * DT, 3.0 * DT], rel=1e-9, abs=1e-12)


def test_a_gripper_closes_until_it_feels_a_force():
    """Two plates press on a cube, each by a step a frame, until the force on one of them is above 2 N."""
    cube = sp.Body("cube", MESH, SOFT, friction=0.5)
    left, right = (
        sp.obstacles.Box(center=(x, 0, 0), size=(0.04, 0.2, 0.2), friction=0.5, motion=sp.MotionInput(name), name=name)
        for name, x in (("left", -0.08), ("right", 0.08))
    )
    scene = sp.Scene([cube], obstacles=[left, right], gravity=(0, 0, 0))
    closed, forces = [0.0], []

    def grip(frame):
        force = np.linalg.norm(frame.report.details.contact_forces["right"]) if frame.index else 0.0
        forces.append(force)
        if max(forces) < 2.0:
            closed.append(closed[-1] + 0.0005)
        return {"left": (closed[-1], 0, 0), "right": (-closed[-1], 0, 0)}

    frames = list(sp.simulate(scene, sp.Implicit(), 0.02, 40, control=grip))
    assert len(frames) == 40
    assert len(closed) < 35, "it stopped closing"
    stopped = len(closed) - 1
    assert forces[stopped] >= 2.0
    assert max(forces[:stopped]) < 2.0
    final = np.linalg.norm(frames[-1].report.details.contact_forces["right"])
    assert 2.0 < final < 4.5, "and it holds: one step more is 2 N"
    # Wherever the plates are, the cube is between them: they are obstacles that moved, not only numbers.
    width = np.ptp(frames[-1].positions["cube"][:, 0])
    assert width < 0.12 - 2 * closed[-1]
    assert width < 0.0999


def test_a_start_from_a_frame_and_a_resumed_run_go_on_with_the_inputs(tmp_path):
    solver = sp.XPBD(substeps=5)

    def control(frame):
        return {"hand": (0.002 * frame.index, 0, 0)} if frame.index % 2 else None

    whole = list(sp.simulate(held_cube(sp.MotionInput("hand")), solver, DT, 8, control=control))
    scene = held_cube(sp.MotionInput("hand"))
    folder = sp.RunFolder(tmp_path / "out", solver, checkpoint_every=2)
    early = list(sp.simulate(scene, solver, DT, 5, control=control, sinks=[folder]))
    going_on = list(sp.simulate(scene, solver, DT, 3, start=early[-1], control=control))
    other = held_cube(sp.MotionInput("hand"))
    resumed = list(sp.resume(tmp_path / "out", other, solver, steps=8, control=control))
    for rest in (going_on, resumed):
        assert len(rest) == 3
        for expected, frame in zip(whole[5:], rest, strict=True):
            assert np.array_equal(frame.state.positions, expected.state.positions)
            assert np.array_equal(frame.state.inputs["hand"], expected.state.inputs["hand"])
    with pytest.raises(SceneError, match="not the one that was run"):
        sp.resume(tmp_path / "out", held_cube(sp.MotionInput("hand", (0, 0, 1))), solver, steps=20)


def test_what_cannot_be_set_is_refused_in_one_line():
    with pytest.raises(SceneError, match=r"input 'a' has shape \(2,\); give \(3,\), or \(k, 3\)"):
        sp.MotionInput("a", (1, 2))
    with pytest.raises(SceneError, match="input 'a' is not finite"):
        sp.ForceInput("a", (1, 2, np.nan))
    with pytest.raises(SceneError, match="there are two inputs 'a'; give each a name"):
        held_cube(sp.MotionInput("a"), sp.ForceInput("a"))
    one = sp.MotionInput("a")
    assert held_cube(one).inputs == {"a": one}
    for sent, expected in (
        ({"b": (0, 0, 0)}, "input 'b' does not exist; there are: 'a'"),
        ({"a": (0, 0)}, r"input 'a' has shape \(2,\)"),
        ({"a": np.zeros((2, 3))}, r"input 'a' is set to an array of shape \(2, 3\); give \(3,\)"),
        (3, "inputs are set by 3; give a mapping"),
    ):
        run = sp.simulate(held_cube(one), sp.XPBD(substeps=2), DT, 3)
        next(run)
        with pytest.raises(SceneError, match=expected):
            run.send(sent)
