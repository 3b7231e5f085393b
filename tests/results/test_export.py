"""Exports are read with the readers of other programs, and must contain the data of the recording."""

import json
import struct

import numpy as np
import pytest

from supple.errors import OutputError
from supple.results.export import glb as export_glb
from supple.results.export.exporter import FORMATS, export
from supple.results.recording.reader import read_recording
from supple.results.view.from_recording import model_of_recording, render_frame_of
from supple.results.view.surfaces import body_surface, surfaces_of

_TYPES = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


class Glb:
    """A GLB file, read according to the specification."""

    def __init__(self, path):
        data = path.read_bytes()
        magic, version, length = struct.unpack_from("<III", data)
        assert (magic, version, length) == (0x46546C67, 2, len(data))
        size, kind = struct.unpack_from("<II", data, 12)
        assert kind == 0x4E4F534A
        self.json = json.loads(data[20 : 20 + size])
        blob_size, kind = struct.unpack_from("<II", data, 20 + size)
        assert kind == 0x004E4942
        assert size % 4 == blob_size % 4 == 0
        self.blob = data[28 + size :]
        assert len(self.blob) == blob_size
        assert self.json["buffers"][0]["byteLength"] <= blob_size

    def accessor(self, index: int) -> np.ndarray:
        accessor = self.json["accessors"][index]
        view = self.json["bufferViews"][accessor["bufferView"]]
        assert view["byteOffset"] % 4 == 0
        dtype = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
        width = _TYPES[accessor["type"]]
        values = np.frombuffer(self.blob, dtype, accessor["count"] * width, view["byteOffset"]).reshape(-1, width)
        assert values.nbytes == view["byteLength"]
        for key, measured in (("min", values.min(axis=0)), ("max", values.max(axis=0))):
            if key in accessor:
                np.testing.assert_array_equal(np.float32(accessor[key]), measured)
        return values

    def mesh(self, name: str) -> dict:
        return next(mesh for mesh in self.json["meshes"] if mesh["name"] == name)


@pytest.fixture
def model(recording):
    return model_of_recording(recording)


def test_glb_plays_every_frame(tmp_path, recorded, recording, model):
    glb = Glb(export(recorded[0], "glb", tmp_path / "bodies.glb"))
    animation = glb.json["animations"][0]
    for body in model.bodies:
        surface = body_surface(model, body).creased(model)
        mesh = glb.mesh(surface.name)
        primitive = mesh["primitives"][0]
        base = glb.accessor(primitive["attributes"]["POSITION"])
        assert "min" in glb.json["accessors"][primitive["attributes"]["POSITION"]]
        np.testing.assert_array_equal(glb.accessor(primitive["indices"]).reshape(-1, 3), surface.triangles)
        targets = primitive["targets"]
        assert len(targets) == len(mesh["weights"]) == len(recording) - 1
        node = next(i for i, n in enumerate(glb.json["nodes"]) if n["name"] == surface.name)
        channel = next(c for c in animation["channels"] if c["target"] == {"node": node, "path": "weights"})
        sampler = animation["samplers"][channel["sampler"]]
        assert sampler["interpolation"] == "LINEAR"
        times = glb.accessor(sampler["input"]).ravel()
        np.testing.assert_allclose(times, recording.times, atol=1e-6)
        weights = glb.accessor(sampler["output"]).reshape(len(times), len(targets))
        deltas = np.stack([glb.accessor(target["POSITION"]) for target in targets])
        turns = np.stack([glb.accessor(target["NORMAL"]) for target in targets])
        normals = glb.accessor(primitive["attributes"]["NORMAL"])
        for k, frame in enumerate(recording):
            shown = base + np.einsum("t,tvc->vc", weights[k], deltas)
            np.testing.assert_allclose(shown, surface.at(render_frame_of(model, frame)), atol=1e-5)
            lengths = np.linalg.norm(normals + np.einsum("t,tvc->vc", weights[k], turns), axis=1)
            np.testing.assert_allclose(lengths, 1.0, atol=1e-5)


def test_glb_moves_obstacles_rigidly(tmp_path, recorded, recording):
    glb = Glb(export(recorded[0], "glb", tmp_path / "bodies.glb"))
    names = [node["name"] for node in glb.json["nodes"]]
    assert len(names) == len(glb.json["scenes"][0]["nodes"]) == 6
    node = next(i for i, name in enumerate(names) if "Box" in name)
    channels = {c["target"]["path"]: c for c in glb.json["animations"][0]["channels"] if c["target"]["node"] == node}
    sampler = glb.json["animations"][0]["samplers"][channels["translation"]["sampler"]]
    np.testing.assert_allclose(glb.accessor(sampler["output"])[-1], [0.0, 0.0, 0.8], atol=1e-6)
    assert {"translation", "rotation"} == set(channels)


def test_glb_thins_long_recordings(tmp_path, recorded, monkeypatch, caplog):
    monkeypatch.setattr(export_glb, "_MOST_FRAMES", 7)
    glb = Glb(export(recorded[0], "glb", tmp_path / "thin.glb"))
    assert len(glb.mesh("slab")["primitives"][0]["targets"]) == 6
    assert "7 of 25 frames" in caplog.text


def test_glb_of_one_frame_has_no_animation(tmp_path, tools):
    tools.record(tmp_path / "start.vtkhdf", 0)
    glb = Glb(export(tmp_path / "start.vtkhdf", "glb"))
    assert not glb.json.get("animations")


def test_obj_folder_has_each_frame(tmp_path, recorded, recording, model):
    meshio = pytest.importorskip("meshio")
    folder = export(recorded[0], "obj", tmp_path / "frames")
    files = sorted(folder.iterdir())
    assert [f.name for f in files] == [f"frame_{k:05}.obj" for k in range(25)]
    mesh = meshio.read(files[20])
    drawn = surfaces_of(model)[:2]
    render_frame = render_frame_of(model, recording[20])
    expected = np.concatenate([surface.at(render_frame) for surface in drawn])
    np.testing.assert_allclose(mesh.points[: len(expected)], expected, atol=1e-8)
    faces = mesh.cells_dict["triangle"]
    np.testing.assert_array_equal(faces[: len(drawn[0].triangles)], drawn[0].triangles)
    assert files[0].read_text().count("\no ") == 6


def test_vtu_is_read_by_vtk_and_meshio(tmp_path, recorded, recording):
    meshio = pytest.importorskip("meshio")
    vtk = pytest.importorskip("vtk")

    from vtk.util.numpy_support import vtk_to_numpy

    path = export(recorded[0], "vtu", tmp_path / "last.vtu")
    frame = recording[-1]
    mesh = meshio.read(path)
    np.testing.assert_array_equal(mesh.points, frame.state.positions)
    np.testing.assert_array_equal(mesh.cells_dict["tetra"], recording.tets)
    np.testing.assert_array_equal(mesh.cell_data["det_F"][0], frame.det_F)
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    np.testing.assert_array_equal(vtk_to_numpy(grid.GetPointData().GetArray("velocities")), frame.state.velocities)


def test_usd_has_time_samples(tmp_path, recorded, recording, model):
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(export(recorded[0], "usd", tmp_path / "scene.usdc")))
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert stage.GetTimeCodesPerSecond() == pytest.approx(30.0)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, 24.0)
    meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    assert len(meshes) == 6
    for surface, mesh in zip(surfaces_of(model), meshes[:2], strict=False):
        assert mesh.GetPointsAttr().GetNumTimeSamples() == 25
        for k in (0, 11, 24):
            np.testing.assert_allclose(
                mesh.GetPointsAttr().Get(k), surface.at(render_frame_of(model, recording[k])), atol=1e-5
            )
        np.testing.assert_array_equal(np.reshape(mesh.GetFaceVertexIndicesAttr().Get(), (-1, 3)), surface.triangles)


@pytest.mark.parametrize(
    ("to", "module", "extra"),
    [("usd", "supple.results.export.usd", "usd"), ("mp4", "supple.results.export.video", "video")],
)
def test_a_missing_package_is_named(tmp_path, recorded, monkeypatch, to, module, extra):
    monkeypatch.setattr(f"{module}.find_spec", lambda name: None)
    with pytest.raises(OutputError, match=rf"not installed; pip install 'supple\[{extra}\]'"):
        export(recorded[0], to, tmp_path / f"x.{to}")
    assert list(tmp_path.iterdir()) == []


def test_exporting_repairs_the_recording_of_a_killed_writer(tmp_path, tools, recorded):
    """A killed writer leaves frames that VTK does not see, and unused room."""
    from supple.results.recording.recorder import Recorder
    from supple.simulate import simulate

    path = tmp_path / "killed.vtkhdf"
    stopped = pytest.MonkeyPatch()
    with stopped.context() as patch:
        patch.setattr(Recorder, "end", lambda self: None)
        for _ in simulate(tools.small_scene(), tools.Prescribed(), 1 / 30, 4, sinks=[Recorder(path)]):
            pass
    repaired = export(path, "vtkhdf", tmp_path / "repaired.vtkhdf")
    with read_recording(repaired) as recording:
        assert len(recording) == 5
        np.testing.assert_array_equal(recording[4].positions["slab"], recorded[1][3].positions["slab"])
    vtk = pytest.importorskip("vtk")
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(repaired))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == 5
    times = reader.GetOutputInformation(0).Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    np.testing.assert_allclose(times, np.arange(5) / 30, atol=1e-12)


def test_a_failed_export_leaves_the_old_output(tmp_path, recorded, monkeypatch):
    folder = tmp_path / "frames"
    export(recorded[0], "obj", folder)
    before = {f.name: f.stat().st_mtime_ns for f in folder.iterdir()}
    (tmp_path / "old.glb").write_bytes(b"old")

    def fail(*_, **__):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("supple.results.export.obj.np.savetxt", fail)
        patch.setattr("supple.results.export.glb._Glb.to_bytes", fail)
        for to, output in (("obj", folder), ("glb", tmp_path / "old.glb")):
            with pytest.raises(OutputError, match="No space left"):
                export(recorded[0], to, output)
    assert {f.name: f.stat().st_mtime_ns for f in folder.iterdir()} == before
    assert (tmp_path / "old.glb").read_bytes() == b"old"
    assert sorted(f.name for f in tmp_path.iterdir()) == ["frames", "old.glb"]
    export(recorded[0], "obj", folder)  # a folder that Supple wrote is replaced


def test_files_of_other_programs_are_not_replaced(tmp_path, recorded):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("words")
    with pytest.raises(OutputError, match=r"thesis\.txt.*which Supple did not write"):
        export(recorded[0], "obj", tmp_path / "mine")
    assert (tmp_path / "mine" / "thesis.txt").read_text() == "words"
    (tmp_path / "mine.glb").mkdir()
    with pytest.raises(OutputError, match="is a folder"):
        export(recorded[0], "glb", tmp_path / "mine.glb")
    with pytest.raises(OutputError, match="is a file"):
        export(recorded[0], "obj", tmp_path / "mine" / "thesis.txt")
    with pytest.raises(OutputError, match="itself, which is read"):
        export(recorded[0], "vtkhdf", recorded[0])


def test_unknown_formats_are_refused(recorded):
    with pytest.raises(OutputError, match="format 'stl' does not exist; take one of glb, obj, vtu"):
        export(recorded[0], "stl")


@pytest.mark.parametrize(
    ("to", "output", "text"),
    [
        ("glb", "x.obj", r"x\.obj: a file in format glb must end in \.glb; name it x\.glb"),
        ("GLB", "x", r"x: a file in format glb must end in \.glb; name it x\.glb"),
        ("usd", "x.html", r"must end in \.usdc or \.usda or \.usd; name it x\.usdc"),
        ("vtkhdf", "x.vtu", r"must end in \.vtkhdf or "),
        ("obj", "x.obj", r"x\.obj: format obj is a folder of files; name it x"),
        ("obj", "x.glb", r"x\.glb: format obj is a folder of files; name it x"),
    ],
)
def test_a_suffix_of_another_format_is_refused(tmp_path, recorded, to, output, text):
    (tmp_path / "x.obj").write_text("mine")
    with pytest.raises(OutputError, match=text):
        export(recorded[0], to, tmp_path / output)
    assert [path.name for path in tmp_path.iterdir()] == ["x.obj"]
    assert (tmp_path / "x.obj").read_text() == "mine"


def test_a_suffix_of_the_format_is_accepted_in_any_case(tmp_path, recorded):
    assert export(recorded[0], "vtu", tmp_path / "last.VTU").is_file()
    assert export(recorded[0], "obj", tmp_path / "frames.v2").is_dir()


def test_every_format_has_its_writer():
    for known in FORMATS.values():
        assert callable(known.writer())
