"""Recordings, checks, checkpoints and exports of scenes with rigid bodies."""

import json

import h5py
import numpy as np
import pytest
from tests.recordings import set_in_scene

import supple as sp
from supple.results.export.exporter import export
from supple.results.view.from_recording import model_of_recording, render_frame_of
from supple.results.view.surfaces import body_surface, split_at_creases

FLOOR = sp.HalfSpace(friction=0.3, name="floor")
POINTS = "VTKHDF/Points"


def scene(**rigid):
    cube = sp.shapes.box_surface((0.1, 0.1, 0.1), (1, 1, 1))
    soft = sp.Body("soft", sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), sp.StableNeoHookean(youngs=1e5, poisson=0.3))
    values = {"mass": 2.0, "position": (0, 0.165, 0), "rotation": (0.1, 0.3, 0), "angular_velocity": (1, 2, 3)}
    palm = sp.RigidBody("palm", cube, **(values | rigid))
    return sp.Scene([soft.changed(position=(0, 0.051, 0)), palm], obstacles=[FLOOR])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path = tmp_path_factory.mktemp("rigid") / "r.vtkhdf"
    frames = list(sp.simulate(scene(), sp.Implicit(), 0.01, 12, sinks=[sp.Recorder(path, solver=sp.Implicit())]))
    return path, frames


@pytest.fixture
def corrupted(recorded, tmp_path):
    """corrupted(change): a copy of the recording whose control points in frame 5 are changed by change(x)."""

    def corrupt(change):
        copy = tmp_path / "corrupted.vtkhdf"
        copy.write_bytes(recorded[0].read_bytes())
        with h5py.File(copy, "r+") as file:
            n = int(file["VTKHDF/NumberOfPoints"][0])
            rows = slice(6 * n - 4, 6 * n)
            file[POINTS][rows] = change(file[POINTS][rows])
        return {result.name: result for result in sp.check_recording(copy).failures}

    return corrupt


def test_frames_read_back_equal(recorded):
    path, frames = recorded
    with sp.read_recording(path) as recording:
        for read, frame in zip(recording[1:], frames, strict=True):
            for name in ("soft", "palm"):
                np.testing.assert_array_equal(read.positions[name], frame.positions[name])
                np.testing.assert_array_equal(read.velocities[name], frame.velocities[name])
            pose, known = read.poses["palm"], frame.poses["palm"]
            for key in ("rotation", "translation", "velocity", "angular_velocity"):
                np.testing.assert_array_equal(getattr(pose, key), getattr(known, key))
            errors = read.report.details.orthogonality_errors
            assert errors == frame.report.details.orthogonality_errors
            assert 0.0 < errors["palm"] < 1e-3
        assert recording.body("palm").body.properties.mass == pytest.approx(2.0)
        assert [body.rigid for body in recording.bodies] == [False, True]


def test_fields_of_soft_bodies_are_in_the_table(tmp_path):
    path = tmp_path / "r.vtkhdf"
    recorder = sp.Recorder(path, fields=["von_mises", "contact_pressure"])
    list(sp.simulate(scene(), sp.Implicit(), 0.01, 2, sinks=[recorder]))
    export(path, "csv", tmp_path / "r.csv")
    columns = (tmp_path / "r.csv").read_text().splitlines()[0].split(",")
    assert {"von_mises.soft.max", "contact_pressure.soft.max"} <= set(columns)
    assert not any(".palm.max" in column for column in columns)


def test_the_surface_is_drawn(recorded):
    path, frames = recorded
    with sp.read_recording(path) as recording:
        model = model_of_recording(recording)
        surface = body_surface(model, model.bodies[1])
        drawn = surface.at(render_frame_of(model, recording[-1]))
        np.testing.assert_allclose(drawn, frames[-1].positions["palm"], rtol=0, atol=1e-13)
        np.testing.assert_array_equal(surface.triangles, frames[0].system.bodies[1].body.surface.triangles)
        highest = max(frame.positions["palm"][:, 1].max() for frame in recording)
        assert model.view.high[1] == highest


def test_a_run_goes_on_from_a_recorded_frame_and_from_a_checkpoint(recorded, tmp_path):
    path, frames = recorded
    with sp.read_recording(path) as recording:
        on = list(sp.simulate(scene(), sp.Implicit(), 0.01, 6, start=recording[6]))
    np.testing.assert_allclose(on[-1].positions["palm"], frames[-1].positions["palm"], atol=1e-6)


def test_good_recordings_pass(recorded, tmp_path):
    report = sp.check_recording(recorded[0])
    assert report.ok, report.failures
    assert str(report["rigidity"].verdict) == "pass"
    assert 0.0 < report["rigidity"].worst < 1e-3
    free = tmp_path / "free.vtkhdf"
    body = sp.RigidBody("free", sp.shapes.torus_surface(0.5, 0.2, 0.2), density=100.0, angular_velocity=(1, 2, 3))
    solver = sp.XPBD()
    list(sp.simulate(sp.Scene([body]), solver, 0.01, 20, sinks=[sp.Recorder(free, solver=solver)]))
    report = sp.check_recording(free)
    assert report.ok, report.failures
    assert {name: str(report[name].verdict) for name in ("momentum", "spin", "energy")} == dict.fromkeys(
        ("momentum", "spin", "energy"), "pass"
    )


@pytest.mark.parametrize("integrator", ["backward_euler", "bdf2"])
def test_the_error_of_an_integrator_is_no_failure(tmp_path, integrator):
    body = sp.RigidBody("free", sp.shapes.torus_surface(0.5, 0.2, 0.2), density=100.0, angular_velocity=(1, 5, 3))
    solver, path = sp.Implicit(integrator=integrator), tmp_path / "free.vtkhdf"
    list(sp.simulate(sp.Scene([body]), solver, 0.01, 20, sinks=[sp.Recorder(path, solver=solver)]))
    assert sp.check_recording(path).ok


def test_a_soft_body_that_calls_itself_rigid_is_an_error(recorded, tmp_path):
    copy = tmp_path / "wrong.vtkhdf"
    copy.write_bytes(recorded[0].read_bytes())
    with h5py.File(copy, "r+") as file:
        tree = json.loads(file["supple/header"][()])
        tree["fields"]["scene"]["fields"]["bodies"]["tuple"][0]["class"] = "RigidBody"
        del file["supple/header"]
        file["supple/header"] = json.dumps(tree)
    with pytest.raises(sp.OutputError, match="RigidBody has other fields in this version"):
        sp.read_recording(copy)


def test_a_deformed_body_is_found(corrupted):
    found = corrupted(lambda x: x.mean(axis=0) + 1.02 * (x - x.mean(axis=0)))
    assert found["rigidity"].first_failure == 5
    assert found["rigidity"].worst == pytest.approx((1.02**2 - 1.0) * np.sqrt(3.0), rel=1e-3)
    assert found["rigidity"].where == "palm"


def test_a_mirrored_body_is_found(corrupted):
    assert "palm, mirrored" in corrupted(lambda x: x * [-1.0, 1.0, 1.0])["rigidity"].where


def test_a_body_in_another_and_in_the_floor_is_found(corrupted):
    found = corrupted(lambda x: x - [0.0, 0.1, 0.0])
    assert {"intersection", "distance"} <= found.keys()
    assert "palm" in found["intersection"].where
    assert "rigidity" not in found
    found = corrupted(lambda x: x - [-1.0, 0.2, 0.0])
    assert found["obstacles"].where.startswith("vertex ")
    assert "of palm and floor" in found["obstacles"].where


def test_vtu_has_the_surface_in_place_of_the_control_points(recorded, tmp_path):
    import meshio

    path, frames = recorded
    mesh = meshio.read(export(path, "vtu", tmp_path / "last.vtu"))
    assert [block.type for block in mesh.cells] == ["tetra", "triangle"]
    assert len(mesh.cells[1].data) == 12
    corners = np.unique(mesh.cells[1].data)
    np.testing.assert_allclose(mesh.points[corners], frames[-1].positions["palm"], atol=1e-12)
    assert set(mesh.cell_data["body"][1].tolist()) == {1}


def transformed(points, matrix):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def test_glb_animates_the_node_of_a_rigid_body(recorded, tmp_path):
    from scipy.spatial.transform import Rotation

    path, frames = recorded
    data = export(path, "glb", tmp_path / "r.glb").read_bytes()
    size = int.from_bytes(data[12:16], "little")
    document, blob = json.loads(data[20 : 20 + size]), data[28 + size :]

    def values(number, width):
        accessor = document["accessors"][number]
        start = document["bufferViews"][accessor["bufferView"]]["byteOffset"]
        return np.frombuffer(blob, "<f4", accessor["count"] * width, start).reshape(-1, width).astype(float)

    node = next(k for k, one in enumerate(document["nodes"]) if one["name"] == "palm")
    (primitive,) = document["meshes"][document["nodes"][node]["mesh"]]["primitives"]
    assert "targets" not in primitive
    (animation,) = document["animations"]
    channels = [c for c in animation["channels"] if c["target"]["node"] == node]
    paths = {c["target"]["path"]: animation["samplers"][c["sampler"]] for c in channels}
    assert paths.keys() == {"translation", "rotation"}
    rest = values(primitive["attributes"]["POSITION"], 3)
    surface = frames[0].system.bodies[1].body.surface
    rows, _ = split_at_creases(surface.vertices, surface.triangles)
    shifts, turns = values(paths["translation"]["output"], 3), values(paths["rotation"]["output"], 4)
    for frame in (frames[0], frames[-1]):
        shown = rest @ Rotation.from_quat(turns[frame.index]).as_matrix().T + shifts[frame.index]
        np.testing.assert_allclose(shown, frame.positions["palm"][rows], atol=2e-6)


def test_usd_animates_the_transform_of_a_rigid_body(recorded, tmp_path):
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    path, frames = recorded
    stage = Usd.Stage.Open(str(export(path, "usd", tmp_path / "r.usda")))
    mesh = next(UsdGeom.Mesh(p) for p in stage.Traverse() if p.GetDisplayName() == "palm")
    points = mesh.GetPointsAttr()
    assert points.GetNumTimeSamples() == 0
    for frame in (frames[0], frames[-1]):
        matrix = np.array(mesh.ComputeLocalToWorldTransform(Usd.TimeCode(frame.index))).T
        shown = transformed(np.array(points.Get(), dtype=float), matrix)
        np.testing.assert_allclose(shown, frame.positions["palm"], atol=2e-6)


def jointed_scene():
    """A bar that swings on a hinge with another on a ball, one in a slider with a motor, one clamped to a wheel."""
    bar = sp.shapes.box_surface((0.2, 0.02, 0.02), (1, 1, 1))
    places = {"a": (0.1, 0, 0), "b": (0.3, 0, 0), "c": (0, 0.5, 0), "d": (0.6, 0.5, 0)}
    bodies = [sp.RigidBody(name, bar, density=1000.0, position=place) for name, place in places.items()]
    wheel = sp.obstacles.Sphere(
        radius=0.1, center=(0.7, 0.8, 0), name="wheel", motion=sp.Keyframes([0, 1], angles=[0, 2.0])
    )
    motor = sp.PositionMotor(0.05, stiffness=50.0, damping=5.0, max_force=2.0)
    joints = [
        sp.HingeJoint("a", point=(0, 0, 0), limits=(-0.3, 8.0), name="hinge"),
        sp.BallJoint("b", "a", point=(0.2, 0, 0), name="ball"),
        sp.SliderJoint("c", axis=(1, 1, 0), motor=motor, limits=(-0.1, 0.1), name="slider"),
        sp.FixedJoint("d", "wheel", name="clamp"),
    ]
    return sp.Scene(bodies, obstacles=[wheel], joints=joints)


@pytest.fixture(scope="module")
def jointed(tmp_path_factory):
    path, solver = tmp_path_factory.mktemp("joints") / "r.vtkhdf", sp.Implicit()
    list(sp.simulate(jointed_scene(), solver, 0.02, 12, sinks=[sp.Recorder(path, solver=solver)]))
    return path


def test_a_recording_keeps_its_joints_and_they_hold(jointed):
    report = sp.check_recording(jointed)
    assert report.ok, report.failures
    assert 0.0 < report["joints"].worst < 1e-6
    with sp.read_recording(jointed) as recording:
        hinge, ball, _, clamp = recording.joints
        assert (hinge.name, hinge.sides) == ("hinge", (0, None))
        assert type(recording.scene.joints[0]) is sp.HingeJoint
        assert hinge.conditions.coordinate.limits == (-0.3, 8.0)
        assert (ball.sides, clamp.sides, recording.scene.joints[2].motor.max_force) == ((1, 0), (3, 4), 2.0)
        assert recording[-1].report.joints["hinge"].coordinate == pytest.approx(-0.3, abs=1e-6)


@pytest.mark.parametrize(
    ("body", "change", "where", "worst"),
    [
        # A bar of 0.2 m has a diameter of gyration of 0.1166 m.
        ("b", lambda x: np.add(x, (0.0, 0.001, 0.0)), "ball", 0.001 / 0.1166),
        ("a", lambda x: np.add(x, (0.0, 0.0, 0.001)), "hinge", 0.001 / 0.1166),
        ("c", lambda x: np.add(x, (-0.002, 0.002, 0.0)), "slider", 0.002828 / 0.1166),
        ("c", lambda x: np.add(x, (0.3, 0.3, 0.0)), "slider, its recorded coordinate", 0.4243 / 0.1166),
        ("d", lambda x: x.mean(axis=0) + (x - x.mean(axis=0)) @ np.diag([1.0, -1.0, -1.0]), "clamp", 2.0),
        ("a", lambda x: x * [1.0, -1.0, -1.0], "hinge, its recorded coordinate", np.pi),
    ],
)
def test_joints_that_do_not_hold_are_found(jointed, tmp_path, body, change, where, worst):
    copy = tmp_path / "corrupted.vtkhdf"
    copy.write_bytes(jointed.read_bytes())
    with h5py.File(copy, "r+") as file:
        rows = slice(4 * "abcd".index(body), 4 * "abcd".index(body) + 4)
        file[POINTS][rows] = change(file[POINTS][rows])
    found = sp.check_recording(copy, only=["joints"])["joints"]
    assert (found.failed_frames, found.first_failure) == (1, 0)
    assert found.where.startswith(where)
    assert found.worst == pytest.approx(worst, rel=1e-3)


@pytest.mark.parametrize(
    ("number", "values", "where"),
    [
        (2, {"motor/max_force": 1e-3}, "slider, its motor exceeds its largest effort"),
        (2, {"limits": (-0.1, 0.01)}, "slider"),
        (2, {"max_velocity": 1e-3}, "slider, its rate"),
        (2, {"axis": np.array([0.6, 0.8, 0.0])}, "slider"),
        (0, {"axis": np.array([0.0, 0.1, 0.99**0.5])}, "hinge"),
        (1, {"axis": np.array([1.0, 0.0, 0.0]), "max_swing": 0.01}, "ball"),
    ],
)
def test_joints_beyond_their_limits_and_efforts_are_found(jointed, tmp_path, number, values, where):
    """The recording is left as it is, and what it says about a joint changed."""
    changed = with_joint(jointed, tmp_path, number, values)
    report = sp.check_recording(changed, only=["joints"])
    assert not report.ok
    assert report["joints"].where == where


def with_joint(recording, folder, number, values):
    """A copy with other values in the description of a joint."""
    copy = folder / "changed.vtkhdf"
    copy.write_bytes(recording.read_bytes())
    with h5py.File(copy, "r+") as file:
        for key, value in values.items():
            set_in_scene(file, f"scene/joints/{number}/{key}", value)
    return copy


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("first", "soft", "joint 'hinge': body 'soft' does not exist"),
        ("second", "a", "it joins body 'a' to itself"),
        ("name", 3, "name is 3; give a non-empty text"),
        ("limits", 3, "limits is 3; give two numbers"),
        ("limits", (1.0, -1.0), "the first is not below the second"),
        ("axis", np.zeros(3), "axis has no length"),
        ("axis", np.full(3, np.nan), "it must be finite"),
        ("point", np.zeros(2), r"point has shape \(2,\)"),
    ],
)
def test_joints_that_make_no_sense_are_an_error(jointed, tmp_path, key, value, message):
    with pytest.raises(sp.OutputError, match=message):
        sp.read_recording(with_joint(jointed, tmp_path, 0, {key: value}))
