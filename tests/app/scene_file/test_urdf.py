"""Robots from URDF files: what they become, and files that are refused in one line."""

import numpy as np
import pytest

import supple as sp
from supple.app.cli.app import main
from supple.app.scene_file.loader import load_run

ARM = """\
<?xml version="1.0"?>
<!-- a comment -->
<robot name="arm">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
  <link name="base_frame"/>
  <link name="base">
    <inertial><mass value="5"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial>
    <collision><origin xyz="0 0 0.05"/><geometry><box size="0.2 0.2 0.1"/></geometry></collision>
  </link>
  <link name="upper">
    <inertial><origin xyz="0 0 0.15" rpy="0 0 0.3"/><mass value="2"/>
      <inertia ixx="0.02" ixy="0.0005" ixz="0" iyy="0.0205" iyz="0" izz="0.002"/></inertial>
    <collision>
      <origin xyz="0 0 0.15" rpy="0.1 0 0"/><geometry><cylinder radius="0.03" length="0.2"/></geometry>
    </collision>
  </link>
  <link name="lower">
    <inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
    <collision>
      <geometry><mesh filename="package://arm/meshes/lower.stl" scale="0.001 0.001 0.001"/></geometry>
    </collision>
    <collision><geometry><sphere radius="0.1"/></geometry></collision>
  </link>
  <link name="tool"/>
  <link name="finger">
    <inertial><mass value="0.1"/><inertia ixx="1e-4" ixy="0" ixz="0" iyy="1.1e-4" iyz="0" izz="1.2e-4"/></inertial>
  </link>
  <joint name="mount" type="fixed"><parent link="base_frame"/><child link="base"/><origin xyz="0 0 1"/></joint>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.12" rpy="0 1.5707963267948966 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1.5" effort="10" velocity="1"/><dynamics damping="0.2"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/>
    <origin xyz="0 0 0.4"/><axis xyz="0 1 0"/><dynamics friction="0.3"/></joint>
  <joint name="flange" type="fixed"><parent link="lower"/><child link="tool"/><origin xyz="0 0 0.2"/></joint>
  <joint name="grip" type="prismatic"><parent link="tool"/><child link="finger"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.04"/><mimic joint="elbow"/></joint>
  <transmission name="t"/>
</robot>
"""


@pytest.fixture
def robot_file(tmp_path):
    folder = tmp_path / "arm"
    (folder / "meshes").mkdir(parents=True)
    sp.shapes.box_surface((60.0, 60.0, 200.0), (1, 1, 1)).save(folder / "meshes" / "lower.stl")
    path = folder / "arm.urdf"
    path.write_text(ARM)
    return path


def test_a_robot_becomes_rigid_bodies_and_joints(robot_file, caplog):
    scene = sp.load_scene(robot_file)
    assert [body.name for body in scene.bodies] == ["base", "upper", "lower", "finger"]
    kinds = {joint.name: (type(joint).__name__, joint.first, joint.second) for joint in scene.joints}
    assert kinds == {
        "mount": ("FixedJoint", "base", None),
        "shoulder": ("HingeJoint", "upper", "base"),
        "elbow": ("HingeJoint", "lower", "upper"),
        "grip": ("SliderJoint", "finger", "lower"),
    }
    shoulder, elbow, grip = scene.joints[1:]
    np.testing.assert_allclose(shoulder.point, [0, 0, 1.12], atol=1e-12)
    np.testing.assert_allclose(shoulder.axis, [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(elbow.point, [0.4, 0, 1.12], atol=1e-12)  # along the turned z axis
    np.testing.assert_allclose(grip.axis, [0, 0, -1], atol=1e-12)
    assert (shoulder.limits, elbow.limits, grip.limits) == ((-1, 1.5), None, (0, 0.04))
    assert (shoulder.damping, shoulder.friction, shoulder.max_effort, shoulder.motor) == (0.2, 0.0, 10.0, None)
    assert (elbow.damping, elbow.friction, elbow.max_effort) == (0.0, 0.3, None)
    assert [joint.max_velocity for joint in (shoulder, elbow, grip)] == [1.0, None, None]
    assert scene.gravity.tolist() == [0, 0, -9.81]
    for text in ("not used: <transmission>\n", "<mimic> is not simulated (it only gives the start): joint 'grip'\n"):
        assert f"arm.urdf: {text}" in caplog.text


def test_a_robot_is_shown_live(robot_file, monkeypatch):
    shown = []
    monkeypatch.setattr("supple.app.cli.commands.view.serve_page", lambda read, *_, **__: shown.append(read()))
    main(["view", str(robot_file), "--no-open"])
    (source,) = shown
    assert len(source.scene.joints) == 4


def test_inertia_and_places_are_those_of_the_links(robot_file):
    base, upper, lower, finger = sp.load_scene(robot_file).bodies
    assert [body.properties.mass for body in (base, upper, lower, finger)] == [5, 2, 1, 0.1]
    # The center of the upper link is 0.15 m along its z axis, which is x in the world.
    np.testing.assert_allclose(upper.place(upper.properties.center), [0.15, 0, 1.12], atol=1e-12)
    turn = np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]])  # of the shoulder, rpy = (0, pi / 2, 0)
    c, s = np.cos(0.3), np.sin(0.3)
    own = turn @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    given = np.array([[0.02, 0.0005, 0], [0.0005, 0.0205, 0], [0, 0, 0.002]])
    R = (upper.place(np.eye(3)) - upper.place(np.zeros((1, 3)))).T
    np.testing.assert_allclose(R @ upper.properties.inertia @ R.T, own @ given @ own.T, atol=1e-12)
    # Both collision geometries, the box of .06 x .06 x .2 m and the ball about the link's origin.
    parts = lower.surface.components
    assert parts.count == 2
    np.testing.assert_allclose(np.ptp(lower.place(lower.points), axis=0), [0.2, 0.2, 0.2], atol=0.01)
    np.testing.assert_allclose(np.linalg.eigvalsh(finger.properties.inertia), [1e-4, 1.1e-4, 1.2e-4], rtol=1e-6)


def test_a_robot_runs_and_its_run_folder_has_a_scene_file(robot_file, tmp_path, capsys):
    main(["info", str(robot_file)])
    printed = " ".join(capsys.readouterr().out.split())
    assert "HingeJoint of upper and base" in printed
    assert "limits (-1, 1.5)" in printed
    main(["run", str(robot_file), "-o", str(tmp_path / "out"), "--steps", "3", "--quiet", "--no-page", "--no-plot"])
    with sp.read_recording(tmp_path / "out" / "recording.vtkhdf") as recording:
        assert {str(status) for status in recording.statuses} == {"converged"}
        assert recording[-1].report.joints["shoulder"].violation < 1e-6
        assert recording[-1].report.joints["elbow"].motor_force is None
    (written,) = (tmp_path / "out").rglob("scene.yaml")
    again = load_run(written).scene
    assert [joint.name for joint in again.joints] == ["mount", "shoulder", "elbow", "grip"]


def test_a_floating_root_falls(tmp_path):
    path = tmp_path / "free.urdf"
    mass = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    path.write_text(
        f'<robot name="r"><link name="world"/><link name="a">{mass}</link>'
        '<joint name="j" type="floating"><parent link="world"/><child link="a"/></joint></robot>'
    )
    scene = sp.load_scene(path)
    assert scene.joints == ()
    (frame,) = sp.simulate(scene, sp.Implicit(contact=None), 0.01, 1)
    assert frame.poses["a"].velocity[2] == pytest.approx(-0.0981)


def _chain(count, mass=""):
    """Links, each the child of the next one."""
    links = "".join(f'<link name="l{i}">{mass}</link>' for i in range(count + 1))
    joints = "".join(
        f'<joint name="j{i}" type="fixed"><parent link="l{i + 1}"/><child link="l{i}"/></joint>' for i in range(count)
    )
    return f'<robot name="chain">{links}{joints}</robot>'


MASS = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'


BOMB = '<!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>\n'
BAD = {
    "empty": "",
    "no xml": "this is not XML",
    "truncated": ARM[: len(ARM) // 2],
    "no end": ARM.replace("</robot>", ""),
    "other root": "<model/>",
    "no links": "<robot name='r'/>",
    "entity bomb": ARM.replace("<robot", BOMB + "<robot", 1),
    "external entity": ARM.replace("<robot", '<!DOCTYPE x SYSTEM "file:///etc/passwd">\n<robot', 1),
    "unknown encoding": ARM.replace('version="1.0"', 'version="1.0" encoding="klingon"'),
    "undeclared entity": ARM.replace('mass value="5"', 'mass value="&big;"'),
    "link without name": ARM.replace('<link name="tool"/>', "<link/>"),
    "link twice": ARM.replace('<link name="tool"/>', '<link name="tool"/><link name="tool"/>'),
    "joint twice": ARM.replace('name="flange"', 'name="elbow"'),
    "joint without name": ARM.replace('joint name="flange"', "joint"),
    "joint without type": ARM.replace('name="elbow" type="continuous"', 'name="elbow"'),
    "unknown type": ARM.replace("continuous", "screw"),
    "macros": ARM.replace('<link name="tool"/>', '<xacro:property name="m" value="2"/>'),
    "a limit below the other by default": ARM.replace('lower="-1" upper="1.5"', 'lower="1"'),
    "nothing to simulate": '<robot name="r"><link name="a"/></robot>',
    "unknown parent": ARM.replace('parent link="upper"', 'parent link="nobody"'),
    "unknown child": ARM.replace('child link="lower"', 'child link="nobody"'),
    "no parent": ARM.replace('<parent link="upper"/>', ""),
    "no child": ARM.replace('<child link="lower"/>', ""),
    "self": ARM.replace('parent link="upper"', 'parent link="lower"'),
    "two parents": ARM.replace('child link="tool"', 'child link="upper"'),
    "two roots": ARM.replace('<link name="tool"/>', '<link name="tool"/><link name="lost"/>'),
    "cycle": ARM.replace('parent link="base_frame"/><child link="base"', 'parent link="tool"/><child link="base"'),
    "axis of zero length": ARM.replace('xyz="1 0 0"', 'xyz="0 0 0"'),
    "axis of two numbers": ARM.replace('xyz="1 0 0"', 'xyz="1 0"'),
    "axis of text": ARM.replace('xyz="1 0 0"', 'xyz="x y z"'),
    "NaN place": ARM.replace('xyz="0 0 0.4"', 'xyz="0 nan 0.4"'),
    "infinite place": ARM.replace('xyz="0 0 0.4"', 'xyz="0 inf 0.4"'),
    "no limit": ARM.replace('<limit lower="0" upper="0.04"/>', ""),
    "limits exchanged": ARM.replace('lower="-1" upper="1.5"', 'lower="1.5" upper="-1"'),
    "NaN limit": ARM.replace('lower="-1"', 'lower="nan"'),
    "negative effort": ARM.replace('effort="10"', 'effort="-1"'),
    "negative velocity": ARM.replace('velocity="1"', 'velocity="-1"'),
    "velocity of text": ARM.replace('velocity="1"', 'velocity="fast"'),
    "negative damping": ARM.replace('damping="0.2"', 'damping="-1"'),
    "two masses": ARM.replace('<mass value="2"/>', '<mass value="2"/><mass value="3"/>'),
    "two axes": ARM.replace('<axis xyz="1 0 0"/>', '<axis xyz="1 0 0"/><axis xyz="0 1 0"/>'),
    "two limits": ARM.replace('<limit lower="0" upper="0.04"/>', '<limit lower="0" upper="0.04"/>' * 2),
    "two parents of a joint": ARM.replace('<parent link="upper"/>', '<parent link="upper"/><parent link="base"/>'),
    "mass below all numbers": ARM.replace('mass value="2"', 'mass value="1e-320"'),
    "huge mass": ARM.replace('mass value="2"', 'mass value="1e300"'),
    "a separator of digits": ARM.replace('xyz="0 0 0.4"', 'xyz="0 0 1_0"'),
    "negative mass": ARM.replace('mass value="2"', 'mass value="-2"'),
    "mass of text": ARM.replace('mass value="2"', 'mass value="heavy"'),
    "NaN inertia": ARM.replace('iyy="0.0205"', 'iyy="nan"'),
    "half an inertia": ARM.replace('iyy="0.0205" ', ""),
    "mesh of nothing": ARM.replace("package://arm/meshes/lower.stl", ""),
    "unknown geometry": ARM.replace('<cylinder radius="0.03" length="0.2"/>', "<capsule/>"),
    "no geometry": ARM.replace('<cylinder radius="0.03" length="0.2"/>', ""),
    "two geometries": ARM.replace('<box size="0.2 0.2 0.1"/>', '<box size="1 1 1"/><box size="1 1 1"/>'),
    "negative radius": ARM.replace('radius="0.03"', 'radius="-0.03"'),
    "no length": ARM.replace(' length="0.2"', ""),
    "binary": "\x00\x01\x02",
    "huge inertia": ARM.replace('ixx="0.02" ixy="0.0005"', 'ixx="1e308" ixy="0.0005"'),
    "huge angle": ARM.replace('rpy="0 0 0.3"', 'rpy="0 0 1e308"'),
    "huge scale": ARM.replace('scale="0.001 0.001 0.001"', 'scale="1e200 1e200 1e200"'),
    "huge damping": ARM.replace('damping="0.2"', 'damping="1e300"'),
    "mass with a unit": ARM.replace('mass value="2"', 'mass value="2 kg"'),
    "limits with a unit": ARM.replace('lower="0" upper="0.04"', 'lower="0deg" upper="90deg"'),
    "scale of nothing": ARM.replace('scale="0.001 0.001 0.001"', 'scale="0 0 0"'),
    "part of a mesh": ARM.replace("lower.stl", "broken.stl"),
    "macro": ARM.replace('mass value="2"', 'mass value="${m}"'),
    "attribute twice": ARM.replace('mass value="2"', 'mass value="2" value="3"'),
    "deep": "<robot>" + "<link>" * 100_000 + "</link>" * 100_000 + "</robot>",
    "no end of depth": "<robot>" + "<a>" * 100_000,
    "long frames": _chain(5_000),
    "long loop below a frame": _chain(5_000).replace('parent link="l5000"', 'parent link="l1"'),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_robots_are_refused_in_one_line(what, robot_file, capsys):
    meshes = robot_file.parent / "meshes"
    (meshes / "lower.dae").write_text("<COLLADA/>")
    (meshes / "broken.stl").write_bytes((meshes / "lower.stl").read_bytes()[:100])
    robot_file.write_text(BAD[what])
    code = main(["run", str(robot_file), "-o", str(robot_file.parent / "out"), "--steps", "1", "--quiet"])
    printed = capsys.readouterr().err
    assert code == 2
    assert len(printed.strip().splitlines()) == 1, printed
    assert "arm.urdf" in printed or "joint" in printed, printed
    assert "Traceback" not in printed


def test_links_are_placed_in_one_pass(tmp_path, monkeypatch):
    """A file of a megabyte may have thousands of links in one line."""
    from supple.app.scene_file.urdf.robot import Placement

    asked = []
    then = Placement.then
    monkeypatch.setattr(Placement, "then", lambda outer, inner: asked.append(inner) or then(outer, inner))
    path = tmp_path / "chain.urdf"
    path.write_text(_chain(400).replace('<link name="l0">', f'<link name="l0">{MASS}'))
    (body,) = sp.load_scene(path).bodies
    assert body.name == "l0"
    assert len(asked) < 5 * 401


def test_more_links_than_a_scene_file_may_have_are_refused_before_they_are_described(tmp_path, monkeypatch):
    from supple.app.scene_file.urdf import describe

    monkeypatch.setattr(describe, "_MOST_BODIES", 3)
    path = tmp_path / "chain.urdf"
    path.write_text(_chain(3, MASS))
    with pytest.raises(sp.SceneError, match=r"chain.urdf: 4 links have a mass; at most 3 are read"):
        sp.load_scene(path)


def test_bytes_that_are_no_text_are_refused(robot_file):
    robot_file.write_bytes(b"\xff\xfe<robot>")
    with pytest.raises(sp.SceneError, match=r"arm.urdf: this is not UTF-8 text"):
        sp.load_scene(robot_file)
