"""What was recorded comes along: fields, materials and the rate in files of other programs; connections in films."""

import json
import struct

import meshio
import numpy as np
import pytest

import supple as sp
from supple.errors import OutputError
from supple.results.export.exporter import export
from supple.results.export.render_worker import Tracer
from supple.results.export.video import Film
from supple.results.export.video_worker import Studio, connections
from supple.results.view.fields import nodal_values
from supple.results.view.from_recording import model_of_recording, render_frame_of

FIELDS = ["von_mises", "stress", "contact_force"]
MESH = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
RUBBER = sp.StableNeoHookean(youngs=1e4, poisson=0.3)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Two cubes that stitches join, on a floor, beside a rigid pendulum; at 48 frames per second."""
    path = tmp_path_factory.mktemp("fields") / "recording.vtkhdf"
    bodies = [
        sp.Body("low", MESH, RUBBER, position=(0, 0.0505, 0)),
        sp.Body("high", MESH, RUBBER, position=(0, 0.152, 0)),
    ]
    bodies.append(
        sp.RigidBody("bob", sp.shapes.box_surface((0.1, 0.1, 0.1), (1, 1, 1)), mass=1, position=(0.4, 0.2, 0))
    )
    stitch = sp.VertexVertexStitch("high", "low", max_distance=0.005, stiffness=1e3)
    scene = sp.Scene(
        bodies, [sp.HalfSpace(name="floor")], stitches=[stitch], joints=[sp.BallJoint("bob", point=(0.4, 0.4, 0))]
    )
    for _ in sp.simulate(scene, sp.Implicit(), 1 / 48, 3, sinks=[sp.Recorder(path, fields=FIELDS)]):
        pass
    return path


def test_vtu_has_the_recorded_fields_of_the_last_frame(recorded, tmp_path):
    mesh = meshio.read(export(recorded, "vtu", tmp_path / "last.vtu"))
    with sp.read_recording(recorded) as recording:
        frame = recording[-1]
        own = [mesh.cell_data["von_mises"][k] for k, block in enumerate(mesh.cells) if block.type == "tetra"]
        expected = [frame.field("von_mises")[name] for name in ("low", "high")]
        np.testing.assert_array_equal(np.concatenate(own), np.concatenate(expected))
        stress = [mesh.cell_data["stress"][k] for k, block in enumerate(mesh.cells) if block.type == "tetra"]
        np.testing.assert_array_equal(stress[0].reshape(-1, 3, 3)[:6], frame.field("stress")["low"])
        forces = mesh.point_data["contact_force"]
        np.testing.assert_array_equal(forces[:8], frame.field("contact_force")["low"])
        assert forces[:8, 1].sum() > 1.0
        assert np.isnan(forces[16:]).all(), "a recording has no fields of a rigid body's surface"


def test_glb_has_the_recorded_fields_of_every_frame(recorded, tmp_path):
    data = export(recorded, "glb", tmp_path / "r.glb").read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    document, blob = json.loads(data[20 : 20 + length]), data[28 + length :]
    (mesh,) = [mesh for mesh in document["meshes"] if mesh["name"] == "low"]
    (primitive,) = mesh["primitives"]

    def values(number):
        accessor = document["accessors"][number]
        view = document["bufferViews"][accessor["bufferView"]]
        width = {"SCALAR": 1, "VEC3": 3}[accessor["type"]]
        return np.frombuffer(blob, "<f4", accessor["count"] * width, view["byteOffset"]).reshape(-1, width)

    assert {"_VON_MISES", "_STRESS_0", "_STRESS_2", "_CONTACT_FORCE"} <= primitive["attributes"].keys()
    first, last = values(primitive["attributes"]["_VON_MISES"]), values(primitive["targets"][-1]["_VON_MISES"])
    with sp.read_recording(recorded) as recording:
        model = model_of_recording(recording)
        render_frame = render_frame_of(model, recording[-1])
        nodal = nodal_values(render_frame, recording[-1].field("von_mises").values_of_all)
    assert (first + last).max() == pytest.approx(nodal[:8].max(), rel=1e-5)
    (rigid,) = [mesh for mesh in document["meshes"] if mesh["name"] == "bob"]
    assert rigid["primitives"][0]["attributes"].keys() == {"POSITION", "NORMAL"}


def test_usd_has_fields_materials_and_the_rate_of_the_recording(recorded, tmp_path):
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom, UsdShade

    stage = Usd.Stage.Open(str(export(recorded, "usd", tmp_path / "r.usda")))
    assert (stage.GetTimeCodesPerSecond(), stage.GetEndTimeCode()) == (48.0, 3.0)
    prim = next(prim for prim in stage.Traverse() if prim.GetName() == "low_0" and prim.IsA(UsdGeom.Mesh))
    primvars = UsdGeom.PrimvarsAPI(prim)
    assert primvars.GetPrimvar("von_mises").GetAttr().GetTimeSamples() == [0.0, 1.0, 2.0, 3.0]
    assert primvars.GetPrimvar("stress").GetElementSize() == 9
    forces = np.array(primvars.GetPrimvar("contact_force").Get(3.0))
    assert forces[:, 1].max() > 0.1
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    shader = UsdShade.Shader(material.ComputeSurfaceSource()[0])
    assert shader.GetIdAttr().Get() == "UsdPreviewSurface"
    assert shader.GetInput("roughness").Get() == pytest.approx(0.55)


def test_films_draw_stitches_and_joints(recorded):
    with sp.read_recording(recorded) as recording:
        model = model_of_recording(recording)
        render_frame = render_frame_of(model, recording[-1])
        lines = [(segments(render_frame), color) for segments, color in connections(model)]
    (stitches, _), (joints, _) = lines
    assert stitches.shape == (4, 2, 3)
    assert np.abs(np.diff(stitches, axis=1)).max() < 0.01
    np.testing.assert_allclose(joints[:3].mean(axis=(0, 1)), (0.4, 0.4, 0), atol=2e-3)


def test_traced_pictures_draw_stitches_and_joints(recorded, monkeypatch):
    """They are inside of the bodies here, which are left out."""
    pytest.importorskip("mitsuba")
    monkeypatch.setattr(Tracer, "_mesh", lambda *_: {"type": "sphere", "radius": 1e-6})
    shown = []
    with sp.read_recording(recorded) as recording:
        model = model_of_recording(recording)
        render_frame = render_frame_of(model, recording[-1])
        for drawn in (False, True):
            near = {"eye": (0.4, 0.42, 0.08), "target": (0.4, 0.4, 0.0)}  # to a joint
            film = Film(render=True, samples=4, size=(240, 180), connections=drawn, **near)
            shown.append(Tracer(model, [render_frame], film).picture(render_frame, 0.0).astype(int))
    lines = np.abs(shown[1] - shown[0]).max(axis=2) > 40
    assert 20 < lines.sum() < 0.2 * lines.size
    r, g, b = shown[1][lines].T
    assert ((r > g) & (g > b + 20)).sum() > 10  # the orange of joints


def test_the_ends_of_a_scale_are_those_given_and_rigid_bodies_are_grey(recorded):
    pytest.importorskip("pyvista")
    with sp.read_recording(recorded) as recording:
        model = model_of_recording(recording)
        render_frames = [render_frame_of(model, recording[-1])]
        try:
            studio = Studio(model, render_frames, Film(color="von_mises", range=(0.0, 123.0), size=(160, 120)))
        except Exception as error:  # of drivers: another one on each machine
            pytest.skip(str(error))
    assert studio._ends(render_frames) == (0.0, 123.0)
    colors = {surface.name: surface.color for _, surface in studio._meshes}
    assert np.ptp(colors["bob"]) < 10
    assert np.ptp(colors["low"]) > 50


@pytest.mark.parametrize(
    ("film", "words"),
    [
        ({"range": (0.0, 1.0)}, "range is that of a field; give color too: J, von_mises, energy"),
        ({"range": (1.0, 0.0), "color": "J"}, "export: range are .*the first is not below the second"),
        ({"range": (0.0, np.inf), "color": "J"}, "range .* finite"),
    ],
)
def test_ranges_that_cannot_be_are_errors(recorded, tmp_path, film, words):
    with pytest.raises(OutputError, match=words):
        export(recorded, "png", tmp_path / "p.png", **film)
