"""Recordings, checks, checkpoints and exports of scenes with rigid bodies."""

import json

import h5py
import numpy as np
import pytest

import supple as sp
from supple.output.drawing import pictures, view_of
from supple.output.export.exporter import export

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
            n = len(file["supple/masses"])
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
        assert recording.body("palm").material == "rigid, 2 kg"
        assert [body.rigid for body in recording.bodies] == [False, True]


def test_the_surface_is_drawn(recorded):
    path, frames = recorded
    with sp.read_recording(path) as recording:
        picture = pictures(recording)[1]
        np.testing.assert_array_equal(picture.at(recording[-1]), frames[-1].positions["palm"])
        np.testing.assert_array_equal(picture.triangles, frames[0].system.bodies[1].body.surface.triangles)
        highest = max(frame.positions["palm"][:, 1].max() for frame in recording)
        assert view_of(recording).high[1] == highest


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
    solver = sp.Implicit(integrator="newmark")
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
        header = json.loads(file["supple/header"][()])
        header["bodies"][0]["rigid"] = True
        del file["supple/header"]
        file["supple/header"] = json.dumps(header)
    with pytest.raises(sp.OutputError, match="rigid body 'soft' does not have four vertices and a surface"):
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
    import pygltflib
    from scipy.spatial.transform import Rotation

    path, frames = recorded
    document = pygltflib.GLTF2().load(str(export(path, "glb", tmp_path / "r.glb")))
    data = document.binary_blob()

    def values(number, width):
        accessor = document.accessors[number]
        view = document.bufferViews[accessor.bufferView]
        return np.frombuffer(data, "<f4", accessor.count * width, view.byteOffset).reshape(-1, width).astype(float)

    node = next(k for k, one in enumerate(document.nodes) if one.name == "palm")
    (primitive,) = document.meshes[document.nodes[node].mesh].primitives
    assert not primitive.targets
    (animation,) = document.animations
    paths = {c.target.path: animation.samplers[c.sampler] for c in animation.channels if c.target.node == node}
    assert paths.keys() == {"translation", "rotation"}
    rest = values(primitive.attributes.POSITION, 3)
    shifts, turns = values(paths["translation"].output, 3), values(paths["rotation"].output, 4)
    for frame in (frames[0], frames[-1]):
        shown = rest @ Rotation.from_quat(turns[frame.index]).as_matrix().T + shifts[frame.index]
        np.testing.assert_allclose(shown, frame.positions["palm"], atol=2e-6)


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
