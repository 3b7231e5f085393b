"""Placing a scene by the coordinates of its joints."""

import numpy as np
import pytest

import supple as sp

CUBE = sp.shapes.box_surface((0.1, 0.1, 0.1), (1, 1, 1))


def cube(name, position):
    return sp.RigidBody(name, CUBE, mass=1.0, position=position)


def arm(**more):
    bodies = [cube("a", (0, 0, 0)), cube("b", (1, 0, 0)), cube("c", (2, 0, 0)), cube("d", (2, 1, 0))]
    joints = [
        sp.FixedJoint("a", None, name="base"),
        sp.HingeJoint("b", "a", point=(0.5, 0, 0), axis=(0, 0, 1), limits=(-4, 4), name="elbow"),
        sp.HingeJoint("c", "b", point=(1.5, 0, 0), axis=(0, 0, 1), name="wrist"),
        sp.SliderJoint("d", "c", axis=(0, 1, 0), limits=(0, 0.5), name="grip"),
    ]
    return sp.Scene(bodies, joints=joints, gravity=(0, 0, 0), **more)


def places(scene):
    return {body.name: np.round(body.position, 9).tolist() for body in scene.bodies}


def test_what_hangs_on_a_joint_moves_with_it():
    scene = arm().with_joint_positions({"elbow": np.pi / 2, "grip": 0.25, "wrist": -np.pi / 2})
    assert places(scene) == {"a": [0, 0, 0], "b": [0.5, 0.5, 0], "c": [1.0, 1.0, 0], "d": [1.0, 2.25, 0]}
    elbow, wrist, grip = scene.joints[1:]
    assert (elbow.start, wrist.start, grip.start) == (np.pi / 2, -np.pi / 2, 0.25)
    np.testing.assert_allclose([elbow.point, wrist.point], [[0.5, 0, 0], [0.5, 1, 0]], atol=1e-12)
    np.testing.assert_allclose(grip.axis, [0, 1, 0], atol=1e-12)
    for solver in (sp.Implicit(), sp.XPBD()):
        (frame,) = sp.simulate(scene, solver, dt=0.01, steps=1)
        found = [frame.report.joints[name].coordinate for name in ("elbow", "wrist", "grip")]
        assert found == pytest.approx([np.pi / 2, -np.pi / 2, 0.25], abs=1e-6)
        assert max(frame.report.joints[name].violation for name in ("elbow", "wrist", "grip")) < 1e-6


def test_positions_may_be_set_again_and_over_several_turns():
    scene = arm().with_joint_positions({"elbow": 1.0, "wrist": 9.0})
    (frame,) = sp.simulate(scene, sp.Implicit(), dt=0.01, steps=1)
    assert frame.report.joints["wrist"].coordinate == pytest.approx(9.0, abs=1e-6)
    back = scene.with_joint_positions({"wrist": 0.0, "elbow": 0.0})
    assert places(back) == places(arm())


def test_the_side_that_the_world_does_not_hold_moves():
    """Here the first of the hinge is held."""
    joints = [
        sp.FixedJoint("b", None),
        sp.HingeJoint("b", "a", point=(0.5, 0, 0), axis=(0, 0, 1), name="elbow"),
    ]
    scene = sp.Scene([cube("a", (0, 0, 0)), cube("b", (1, 0, 0))], joints=joints).with_joint_positions(
        {"elbow": np.pi / 2}
    )
    assert places(scene) == {"a": [0.5, 0.5, 0], "b": [1, 0, 0]}
    (frame,) = sp.simulate(scene, sp.Implicit(), dt=1e-3, steps=1)
    assert frame.report.joints["elbow"].coordinate == pytest.approx(np.pi / 2, abs=1e-3)


def test_soft_bodies_that_are_welded_move_with_their_rigid_ones():
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1000)
    finger = sp.Body("finger", sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), rubber, position=(2.1, 0, 0))
    scene = arm()
    soft = sp.Scene(
        [*scene.bodies, finger],
        joints=scene.joints,
        welds=[sp.Weld("finger", "c", max_distance=1e-3)],
        gravity=(0, 0, 0),
    )
    assert places(soft.with_joint_positions({"elbow": np.pi / 2}))["finger"] == [0.5, 1.6, 0]


def test_motors_and_limits_are_those_of_the_coordinate():
    scene = arm().with_joint_positions({"elbow": 1.0}).with_motors({"elbow": sp.PositionMotor(1.0, stiffness=1e3)})
    frame = list(sp.simulate(scene, sp.Implicit(), dt=0.01, steps=10))[-1]
    assert frame.report.joints["elbow"].coordinate == pytest.approx(1.0, abs=1e-6)
    assert frame.report.joints["elbow"].motor_force == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(
    ("positions", "text"),
    [
        ({"elbo": 1.0}, "no hinge or slider has the name 'elbo'; did you mean 'elbow'"),
        ({"base": 1.0}, "no hinge or slider has the name 'base'"),
        ({"elbow": 5.0}, r"'elbow' is 5, outside of the joint's limits \(-4, 4\)"),
        ({"elbow": float("nan")}, "'elbow' is nan"),
        ({"elbow": "far"}, "'elbow' is 'far'; give a number"),
    ],
)
def test_impossible_positions_are_refused(positions, text):
    with pytest.raises(sp.SceneError, match=text):
        arm().with_joint_positions(positions)


def test_a_loop_is_refused():
    scene = arm()
    closed = sp.Scene(scene.bodies, joints=[*scene.joints, sp.BallJoint("c", "a", point=(1, 1, 0))])
    with pytest.raises(sp.SceneError, match="both sides of 'elbow' are connected by other joints, welds or stitches"):
        closed.with_joint_positions({"elbow": 1.0})
    held = sp.Scene(scene.bodies, joints=[*scene.joints, sp.BallJoint("c", None, point=(1, 1, 0))])
    with pytest.raises(sp.SceneError, match="the world holds both sides of 'elbow'"):
        held.with_joint_positions({"elbow": 1.0})


def test_a_scene_file_places_and_a_recording_is_checked(tmp_path, capsys):
    from supple.app.cli.app import main

    path = tmp_path / "arm.yaml"
    path.write_text(
        "bodies:\n"
        "  - {name: a, shape: {kind: box, divisions: [1, 1, 1]}, rigid: {density: 1000}}\n"
        "  - {name: b, shape: {kind: box, divisions: [1, 1, 1]}, rigid: {density: 1000}, position: [2, 0, 0]}\n"
        "joints:\n"
        "  - {kind: fixed, first: a}\n"
        "  - {kind: hinge, first: b, second: a, point: [1, 0, 0], axis: [0, 0, 1], name: elbow, limits: [0.5, 2]}\n"
        "joint_positions: {elbow: 1.5}\n"
        "solver: {kind: implicit}\n"
    )
    assert main(["run", str(path), "-o", str(tmp_path / "out"), "--steps", "5", "-q", "--no-page", "--no-plot"]) == 0
    with sp.read_recording(tmp_path / "out" / "recording.vtkhdf") as recording:
        assert recording[0].report.joints["elbow"].coordinate == pytest.approx(1.5)
    assert main(["check", str(tmp_path / "out" / "recording.vtkhdf")]) == 0, capsys.readouterr()
    path.write_text(path.read_text().replace("1.5}", "0.2}"))
    with pytest.raises(sp.SceneError, match=r"arm.yaml:7: joint_positions.elbow: .*'elbow' is 0.2, outside"):
        sp.load_scene(path)
