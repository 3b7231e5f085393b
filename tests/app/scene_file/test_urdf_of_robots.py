"""What files of real robots contain beside the plain case: what it becomes, and which line of the log says so."""

import re

import numpy as np
import pytest

import supple as sp
from supple.app.cli.app import main

CUBE = '<collision><geometry><box size=".1 .1 .1"/></geometry></collision>'
HINGE = '<limit lower="-1" upper="1" effort="9" velocity="9"/>'


def inertial(mass=1.0, ixx=2e-3, iyy=2e-3, izz=2e-3, place="0 0 0"):
    return (
        f'<inertial><origin xyz="{place}"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )


def link(name, inside=None, shape=CUBE):
    return f'<link name="{name}">{inertial() if inside is None else inside}{shape}</link>'


def joint(name, kind, parent, child, inside="", place="0 0 .5", axis="0 1 0"):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{place}"/>'
        f'<axis xyz="{axis}"/>{inside}</joint>'
    )


@pytest.fixture
def scene_of(tmp_path):
    def load(*parts):
        path = tmp_path / "robot.urdf"
        path.write_text("<robot name='r'>\n" + "\n".join(parts) + "\n</robot>")
        return sp.load_scene(path)

    return load


def joints_of(scene):
    return {joint.name: (joint.kind, joint.first, joint.second) for joint in scene.joints}


def test_frames_without_mass_belong_to_the_body_above_them_also_in_chains(scene_of):
    """Such as tools, sensors and the footprint of a base; one of mass 0 is such a frame, too."""
    scene = scene_of(
        link("world", "", ""),
        joint("a", "fixed", "world", "base"),
        link("base"),
        joint("b", "revolute", "base", "frame", HINGE),
        link("frame", inertial(mass=0), ""),
        joint("c", "fixed", "frame", "arm", place="0 0 .1"),
        link("arm"),
        joint("d", "fixed", "arm", "flange", place="0 0 .1"),
        link("flange", inertial(mass=0), ""),
        joint("e", "fixed", "flange", "pad", place="0 0 .1"),
        link("pad", ""),
        joint("f", "prismatic", "pad", "finger", HINGE, place="0 0 .2"),
        link("finger"),
    )
    assert joints_of(scene) == {
        "a": ("fixed", "base", None),
        "b": ("hinge", "arm", "base"),
        "f": ("slider", "finger", "arm"),
    }
    # The box of the pad is a part of the arm.
    low, high = scene.body("arm").surface.bounds
    np.testing.assert_allclose([low[2], high[2]], [-0.05, 0.25], atol=1e-12)
    np.testing.assert_allclose(scene.joints[1].point, [0, 0, 1.0], atol=1e-12)
    np.testing.assert_allclose(scene.body("finger").position, [0, 0, 1.5], atol=1e-12)


def test_links_without_mass_between_movable_joints_are_light(scene_of, caplog):
    """Two axes of one joint: the link between them is in most files without mass."""
    scene = scene_of(
        link("a"),
        joint("x", "revolute", "a", "cross", HINGE, axis="1 0 0"),
        link("cross", "", ""),
        joint("y", "revolute", "cross", "b", HINGE, place="0 0 0"),
        link("b"),
        joint("wheel", "continuous", "b", "rim", place=".3 0 0"),
        link("rim", "", '<collision><geometry><cylinder radius=".1" length=".02"/></geometry></collision>'),
        joint("eye", "revolute", "b", "lens", HINGE),
        link("lens", "", ""),
    )
    masses = {body.name: body.properties.mass for body in scene.bodies}
    assert masses == pytest.approx({"a": 1, "cross": 0.01, "b": 1, "rim": 20 * np.pi * 0.01}, rel=0.05)
    assert list(joints_of(scene)) == ["a to the world", "x", "y", "wheel"]
    for text in (
        "link that moves, has no mass and carries others: a hundredth of theirs: cross",
        "link that moves and has no mass: that of its collision geometry, of 1000 kg/m^3: rim",
        "link that moves, has no mass and carries nothing, left out: lens",
    ):
        assert text in caplog.text
    for solver in (sp.Implicit(), sp.XPBD()):
        frames = list(sp.simulate(scene, solver, dt=0.01, steps=3))
        assert [str(frame.report.status) for frame in frames] == ["converged"] * 3
        assert frames[-1].report.joints["y"].coordinate == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize(
    ("moments", "text", "squares"),
    [
        ((1e-3, 1e-3, 2.05e-3), "replaced by the nearest one", (1.025e-3, 1.025e-3, 1e-4 * 1.025e-3)),
        ((0.0, 1e-3, 1e-3), "replaced by the nearest one", (1e-3, 1e-7, 1e-7)),  # a rod
        ((-1e-5, 1e-3, 1e-3), "replaced by the nearest one", (1.005e-3, 1.005e-7, 1.005e-7)),
        ((0.0, 0.0, 0.0), "that of its collision geometry", (0.01 / 12,) * 3),
        ((1e-35, 0.0, -1e-35), "that of its collision geometry", (0.01 / 12,) * 3),
    ],
)
def test_inertia_that_no_solid_has_is_replaced(scene_of, caplog, moments, text, squares):
    scene = scene_of(
        link("a"), joint("j", "revolute", "a", "b", HINGE), link("b", inertial(1, *moments, place=".1 0 0"))
    )
    properties = scene.body("b").properties
    np.testing.assert_allclose(np.diag(properties.second_moment), squares, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(properties.center, [0.1, 0, 0], atol=1e-12)
    assert text in caplog.text


def test_inertia_that_a_solid_has_stays_as_it_is(scene_of, caplog):
    scene = scene_of(link("a"), joint("j", "revolute", "a", "b", HINGE), link("b", inertial(1, 1e-6, 1e-3, 1.0005e-3)))
    np.testing.assert_allclose(scene.body("b").properties.inertia, np.diag([1e-6, 1e-3, 1.0005e-3]), rtol=1e-12)
    assert "nearest" not in caplog.text


def test_mass_without_inertia_or_shape_is_that_of_a_ball(scene_of, caplog):
    scene = scene_of(link("a"), joint("j", "fixed", "a", "imu"), link("imu", inertial(0.1, 0, 0, 0), ""))
    radius = (0.3 / (4000 * np.pi)) ** (1 / 3)
    np.testing.assert_allclose(scene.body("imu").properties.inertia, 0.04 * radius**2 * np.eye(3), rtol=1e-9)
    assert "inertia is zero: that of a ball of 1000 kg/m^3: link 'imu'" in caplog.text
    assert "link without collision geometry: it touches nothing: imu" in caplog.text


def test_flat_and_long_cylinders_capsules_and_points(scene_of, caplog):
    shapes = (
        '<collision><geometry><cylinder radius=".05" length=".01"/></geometry></collision>',
        '<collision><geometry><cylinder radius=".001" length="2"/></geometry></collision>',
        '<collision><origin xyz="1 0 0"/><geometry><capsule radius=".1" length=".4"/></geometry></collision>',
        '<collision><geometry><sphere radius="0"/></geometry></collision>',
        '<collision><geometry><box size="0 1 1"/></geometry></collision>',
    )
    (body,) = scene_of(link("a", shape="".join(shapes))).bodies
    assert body.surface.components.count == 5
    assert len(body.triangles) < 4000
    low, high = body.surface.bounds
    np.testing.assert_allclose([low[0], high[0]], [-0.05, 1.1], atol=0.003)
    np.testing.assert_allclose([low[2], high[2]], [-1, 1], atol=1e-9)
    capsule = body.points[body.points[:, 0] > 0.5]
    np.testing.assert_allclose(np.ptp(capsule, axis=0), [0.2, 0.2, 0.6], atol=0.01)
    assert "collision geometry of size 0, left out: link 'a'" in caplog.text


def test_limits_without_travel_hold_the_joint(scene_of, caplog):
    """Ends that are not given are 0, as the format says."""
    scene = scene_of(
        link("a"),
        joint("j", "revolute", "a", "b", '<limit effort="9" velocity="9"/>'),
        link("b"),
        joint("k", "prismatic", "b", "c", '<limit lower=".2" upper=".2"/>', axis="1 0 0"),
        link("c"),
    )
    assert joints_of(scene) == {
        "a to the world": ("fixed", "a", None),
        "j": ("fixed", "b", "a"),
        "k": ("fixed", "c", "b"),
    }
    np.testing.assert_allclose(scene.body("c").position, [0.2, 0, 1.0], atol=1e-12)
    assert (
        "fixed, since its limits leave no travel (those that are not given are 0): joint 'j', joint 'k'" in caplog.text
    )


def test_joints_begin_within_their_limits_and_mimics_follow(scene_of, caplog):
    scene = scene_of(
        link("a"),
        joint("elbow", "revolute", "a", "b", '<limit lower="-3" upper="-.5"/>'),
        link("b"),
        joint(
            "other",
            "revolute",
            "a",
            "c",
            '<limit lower="-3" upper="3"/><mimic joint="elbow" multiplier="-2"/>',
            "9 0 0",
        ),
        link("c"),
        joint("slide", "prismatic", "b", "d", '<limit lower=".1" upper=".2"/>', "0 0 1", axis="1 0 0"),
        link("d"),
    )
    elbow, other, slide = scene.joints[1:]
    assert (elbow.start, other.start, slide.start) == (-0.5, 1.0, 0.1)
    c, s = np.cos(-0.5), np.sin(-0.5)
    np.testing.assert_allclose(scene.body("d").position, [s + 0.1 * c, 0, 0.5 + c - 0.1 * s], atol=1e-12)
    assert "zero is outside of the limits: it begins at their nearest end: joint 'elbow', joint 'slide'" in caplog.text
    for solver in (sp.Implicit(), sp.XPBD()):
        (frame,) = sp.simulate(scene, solver, dt=1e-3, steps=1)
        found = {name: frame.report.joints[name].coordinate for name in ("elbow", "other", "slide")}
        assert found == pytest.approx({"elbow": -0.5, "other": 1.0, "slide": 0.1}, abs=1e-3)


def test_names_that_are_not_allowed_are_replaced(scene_of, caplog):
    scene = scene_of(
        link("ns/a"), joint("ns/j", "revolute", "ns/a", "arm left", HINGE), link("arm left"),
        joint("k", "fixed", "arm left", "ns_a"), link("ns_a"), joint("l", "fixed", "ns_a", "bras supérieur"),
        link("bras supérieur"),
    )  # fmt: skip
    assert [body.name for body in scene.bodies] == ["ns_a", "arm left", "ns_a_2", "bras supérieur"]
    assert list(joints_of(scene)) == ["ns_a to the world", "ns_j", "k", "l"]
    assert "renamed: link 'ns/a' is 'ns_a', link 'ns_a' is 'ns_a_2', joint 'ns/j' is 'ns_j'" in caplog.text


def test_links_that_overlap_at_the_start_do_not_touch(scene_of, caplog):
    """As the links on both sides of a wrist; those that are joined do not touch in any case."""
    scene = scene_of(
        link("a"), joint("j", "revolute", "a", "b", HINGE, "0 0 .04"), link("b"),
        joint("k", "revolute", "b", "c", HINGE, "0 0 .04"), link("c"),
        joint("l", "revolute", "c", "d", HINGE, "0 0 .5"), link("d"),
    )  # fmt: skip
    assert "links that overlap at the start do not touch each other: a and c\n" in caplog.text
    assert [(pair.first, pair.second) for pair in scene.contact_pairs] == [(("a",), ("c",))]
    for solver in (sp.Implicit(), sp.XPBD()):
        (frame,) = sp.simulate(scene, solver, dt=1e-3, steps=1)
        assert str(frame.report.status) == "converged"


def test_a_planar_joint_holds_a_plane(scene_of):
    scene = scene_of(link("world", "", ""), joint("j", "planar", "world", "a", axis="0 1 1"), link("a"))
    for solver in (sp.Implicit(), sp.XPBD()):
        frame = list(sp.simulate(scene, solver, dt=0.01, steps=20))[-1]
        start = scene.body("a").position
        moved = frame.poses["a"].translation - start
        assert moved @ [0, 1, 1] == pytest.approx(0.0, abs=1e-5)
        # Down the slope of 45 degrees: half of g along z.
        assert frame.poses["a"].velocity == pytest.approx([0, 0.981 / 1, -0.981], rel=1e-3, abs=1e-6)


def test_meshes_of_packages_and_models_are_found_above(tmp_path, caplog):
    box = sp.shapes.box_surface((1.0, 2.0, 3.0), (1, 1, 1))
    for folder in ("share/arm_description/meshes", "share/gripper/meshes", "share/arm_description/urdf"):
        (tmp_path / folder).mkdir(parents=True)
    box.save(tmp_path / "share/arm_description/meshes/arm.stl")
    box.save(tmp_path / "share/gripper/meshes/grip.stl")
    opened = sp.SurfaceMesh(box.vertices, box.triangles[:-1])
    opened.save(tmp_path / "share/arm_description/meshes/open.stl")
    flat = sp.SurfaceMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 3, 2]])
    flat.save(tmp_path / "share/arm_description/meshes/flat.stl")
    (tmp_path / "share/arm_description/meshes/notes.xyz").write_text("no mesh")
    names = {
        "a": 'package://arm_description/meshes/arm.stl" scale="1 -1 1',
        "b": "package://gripper/meshes/grip.stl",
        "c": "model://arm_description/meshes/arm.stl",
        "d": "../meshes/arm.stl",
        "e": "$(find gripper)/meshes/grip.stl",
        "f": "package://arm_description/meshes/open.stl",
        "g": "package://arm_description/meshes/flat.stl",
        "h": "package://elsewhere/none.stl",
        "i": "package://arm_description/meshes/notes.xyz",
        "j": "http://localhost:1/lower.stl",
    }
    parts = [
        link(name, shape=f'<collision><geometry><mesh filename="{file}"/></geometry></collision>')
        for name, file in names.items()
    ]
    joints = [joint(f"to {name}", "fixed", "a", name) for name in names if name != "a"]
    path = tmp_path / "share/arm_description/urdf/robot.urdf"
    path.write_text(f"<robot name='r'>{''.join(parts)}{''.join(joints)}</robot>")
    scene = sp.load_scene(path)
    for name in "abcdef":
        np.testing.assert_allclose(np.ptp(scene.body(name).points, axis=0), [1, 2, 3], atol=1e-6)
        assert scene.body(name).surface.volume == pytest.approx(6.0)  # also the mirrored one faces outwards
    for name in "ghij":
        assert np.ptp(scene.body(name).points) < 0.3  # the box of its inertia
    for text in (
        "mesh that is not closed, or inside out: its convex hull is used: package://arm_description/meshes/open.stl of",
        "mesh that contains no volume, left out: package://arm_description/meshes/flat.stl of",
        "mesh that does not exist, left out: package://elsewhere/none.stl of link 'h', http://localhost:1/lower.stl of",
        "left out (convert it to STL or OBJ): package://arm_description/meshes/notes.xyz of link 'i'",
    ):
        assert text in caplog.text


@pytest.mark.parametrize(
    ("old", "new", "where"),
    [
        ('type="revolute"', 'type="screw"', "3: joint 'j': its type 'screw' is not supported"),
        ('value="1.0"', 'value="-1"', "2: link 'a': its mass is -1 kg"),
        ('upper="1"', 'upper="-2"', "3: joint 'j': its limits are -1 and -2"),
        ('child link="b"', 'child link="c"', "3: joint 'j': link 'c' does not exist"),
        ('size=".1 .1 .1"', 'size="${s} .1 .1"', "2: link 'a': size of its <box> is '${s} .1 .1', a macro; expand it"),
        (
            'xyz="0 0 .5"',
            'xyz="$(optenv AT 0 0 0)"',
            "3: joint 'j': xyz of its <origin> is '$(optenv AT 0 0 0)', a macro;",
        ),
        ("<inertial>", "<xacro:box/><inertial>", "2: <xacro:box> is a macro; expand it first: xacro robot.urdf.xacro"),
        ("<robot", "<!DOCTYPE x SYSTEM 'http://localhost:1'><robot", "1: it has a document type declaration"),
    ],
)
def test_errors_have_the_line(tmp_path, old, new, where):
    text = [link("a"), joint("j", "revolute", "a", "b", HINGE), link("b")]
    whole = "<robot name='r'>\n" + "\n".join(text) + "\n</robot>"
    path = tmp_path / "robot.urdf"
    path.write_text(whole.replace(old, new, 1))
    with pytest.raises(sp.SceneError, match="^" + re.escape(f"{path}:{where}")):
        sp.load_scene(path)


def test_a_macro_file_is_told_from_a_robot(tmp_path, capsys):
    path = tmp_path / "robot.urdf.xacro"
    path.write_text('<robot name="r" xmlns:xacro="x">\n<xacro:include filename="a.xacro"/></robot>')
    assert main(["info", str(path)]) == 2
    assert "robot.urdf.xacro:2: <xacro:include> is a macro; expand it first" in capsys.readouterr().err
