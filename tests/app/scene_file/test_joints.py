"""Joints in scene files, and in everything that reads or writes a run of one."""

import pytest
from jsonschema import Draft202012Validator

import supple as sp
from supple.app.cli.app import main
from supple.app.scene_file.document import json_schema
from supple.app.scene_file.loader import load_run
from supple.app.scene_file.resolved import resolved_scene
from supple.app.scene_file.yaml_files import read_yaml

BAR = (
    "{name: %s, shape: {kind: box, size: [1, .05, .05], divisions: [1, 1, 1]}, rigid: {mass: 2}, position: [%g, 1, 0]}"
)
SCENE = f"""\
bodies:
  - {BAR % ("upper", 0.5)}
  - {BAR % ("lower", 1.5)}
  - {BAR % ("slide", 2.5)}
  - {BAR % ("tool", 3.5)}
joints:
  - {{kind: ball, first: upper, point: [0, 1, 0], axis: [2, 0, 0], max_swing: 1, twist_limits: [-3, 3], name: shoulder}}
  - kind: hinge
    first: lower
    second: upper
    point: [1, 1, 0]
    axis: [0, 0, 2]
    limits: [-1, 2]
    damping: 0.5
    max_effort: 7
    motor: {{kind: position, target: {{times: [0, 1], values: [0, 0.5]}}, stiffness: 100, damping: 10, max_force: 8}}
  - {{kind: slider, first: slide, second: lower, axis: [1, 0, 0], max_velocity: 9,
     motor: {{kind: velocity, target: {{input: speed, value: 1}}, max_force: 30}}}}
  - {{kind: fixed, first: tool, second: slide}}
solver: {{kind: implicit, contact: null}}
dt: 0.01
steps: 3
"""


@pytest.fixture
def scene_file(tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text(SCENE)
    return path


def test_a_scene_file_describes_joints(scene_file):
    run = load_run(scene_file)
    shoulder, elbow, slider, fixed = run.scene.joints
    assert [type(joint) for joint in run.scene.joints] == [sp.BallJoint, sp.HingeJoint, sp.SliderJoint, sp.FixedJoint]
    assert [joint.name for joint in run.scene.joints] == ["shoulder", "HingeJoint 1", "SliderJoint 1", "FixedJoint 1"]
    assert (elbow.first, elbow.second, elbow.axis.tolist(), elbow.limits) == ("lower", "upper", [0, 0, 1], (-1, 2))
    assert (elbow.motor.at(0.5), elbow.motor.stiffness, elbow.motor.max_force) == (0.25, 100, 7)
    assert (slider.motor.at(0), slider.motor.max_force, slider.max_velocity) == (1, 30, 9)
    assert list(run.scene.inputs) == ["speed"]
    assert (shoulder.second, shoulder.max_swing, shoulder.axis.tolist(), fixed.point) == (None, 1, [1, 0, 0], None)
    assert shoulder.twist_limits == (-3, 3)
    data = read_yaml(scene_file).data
    Draft202012Validator(json_schema()).validate(data)
    again = scene_file.with_name("again.yaml")
    again.write_text(str(resolved_scene(run, solver=None, dt=run.dt, steps=run.steps)["scene.yaml"]))
    assert load_run(again).scene.joints[1].motor.at(0.5) == 0.25


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (
            "second: upper",
            "second: uper",
            ":10: joints[1].second: joint 'HingeJoint 1': body or obstacle 'uper' does not exist",
        ),
        ("limits: [-1, 2]", "limits: [2, -1]", ":13: joints[1].limits: "),
        ("[0, 0, 2]", "[0, 0, 0]", ":12: joints[1].axis: "),
        ("kind: velocity", "kind: speed", ":18: joints[2].motor"),
        ("max_velocity: 9", "max_velocity: 0", ":17: joints[2].max_velocity"),
        ("damping: 10", "damping: -1", ":16: joints[1].motor"),
    ],
)
def test_bad_joints_are_refused_with_their_line(scene_file, old, new, problem):
    scene_file.write_text(SCENE.replace(old, new))
    with pytest.raises(sp.SceneError) as error:
        load_run(scene_file)
    assert problem in str(error.value)


def test_motors_of_a_file_share_inputs_which_a_program_sets(scene_file):
    shared = SCENE.replace("target: {times: [0, 1], values: [0, 0.5]}", "target: {input: speed, value: 1}")
    scene_file.write_text(shared)
    run = load_run(scene_file)
    elbow, slider = (run.scene.motors[name] for name in ("HingeJoint 1", "SliderJoint 1"))
    assert elbow.script is slider.script is run.scene.inputs["speed"]
    frames = sp.simulate(run.scene, run.solver, run.dt, 2, control=lambda frame: {"speed": -2.0})
    assert [frame.report.joints["SliderJoint 1"].motor_force for frame in frames] == [-30.0, -30.0]
    scene_file.write_text(shared.replace("{input: speed, value: 1}, stiff", "{input: speed, value: 2}, stiff"))
    with pytest.raises(sp.SceneError, match=r":18: joints\[2\].motor.*: input 'speed' begins at 1 here and at 2 in a"):
        load_run(scene_file)


def test_info_run_recording_and_check_know_joints(scene_file, tmp_path, capsys):
    main(["info", str(scene_file)])
    printed = " ".join(capsys.readouterr().out.split())
    hinge = "HingeJoint of lower and upper, point (1, 1, 0), limits (-1, 2), motor PositionMotor(target Curve(times "
    motor = "(0, 1), values (0, 0.5)), stiffness 100, damping 10, max force 7), damping 0.5, max effort 7"
    assert hinge + motor in printed
    ball = "BallJoint of upper and the world, point (0, 1, 0), axis (1, 0, 0), max swing 1, "
    assert f"{ball}twist limits (-3, 3)" in printed
    out = tmp_path / "out"
    main(["run", str(scene_file), "-o", str(out), "--quiet"])
    with sp.read_recording(out / "recording.vtkhdf") as recording:
        details = recording[-1].report.details
        assert set(details.joint_forces) == {"shoulder", "HingeJoint 1", "SliderJoint 1", "FixedJoint 1"}
        assert recording[-1].report.joints["SliderJoint 1"].motor_force == 30.0
        assert [joint.second for joint in recording.scene.joints].count(None) == 1
        assert len(recording.scene.motors) == 2
    results = {result.name: result for result in sp.check_recording(out / "recording.vtkhdf").results}
    assert results["momentum"].message == "joints hold bodies"
    assert (results["energy"].verdict, results["balance"].verdict) == ("pass", "pass")
