"""What surfaces look like: in scenes, recordings, scene files and glb."""

import json
import struct

import numpy as np
import pytest

import supple as sp
from supple.results.export.exporter import export
from supple.results.view.from_recording import model_of_recording
from supple.results.view.look import LOOKS
from supple.results.view.surfaces import rim_of, surfaces_of
from supple.scene.body import LOOKS as NAMES


def test_looks_reach_recordings_and_glb(tmp_path):
    mesh, soft = sp.shapes.box(divisions=(1, 1, 1)), {"youngs": 1e5, "poisson": 0.3}
    bodies = [
        sp.Body("bear", mesh, sp.StableNeoHookean(**soft), look="gummy"),
        sp.Body("pad", mesh, sp.StableNeoHookean(**soft, density=60.0), position=(3, 0, 0)),
        sp.RigidBody("tool", mesh, density=7800.0, position=(6, 0, 0), look="steel"),
    ]
    sink = sp.Recorder(tmp_path / "r.vtkhdf")
    list(sp.simulate(sp.Scene(bodies, gravity=(0, 0, 0)), sp.XPBD(substeps=1), 0.01, 1, sinks=[sink]))
    with sp.read_recording(sink.path) as recording:
        assert [body.body.drawn_look for body in recording.bodies] == ["gummy", "foam", "steel"]
        red, green, blue = surfaces_of(model_of_recording(recording))[2].color
        assert max(red, green, blue) - min(red, green, blue) < 80  # metal is nearly grey
        data = export(recording, "glb").read_bytes()
    materials = json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])["materials"]
    shown = [m["pbrMetallicRoughness"]["roughnessFactor"] for m in materials]
    assert shown == [LOOKS[name].roughness for name in ("gummy", "foam", "steel")]


def test_an_unknown_look_is_refused():
    assert set(NAMES) == set(LOOKS)
    with pytest.raises(sp.SceneError, match="body 'a': look is 'chrome'; give 'rubber', 'gummy', 'foam' or 'steel'"):
        sp.Body("a", sp.shapes.box(divisions=(1, 1, 1)), sp.StableNeoHookean(youngs=1.0, poisson=0.3), look="chrome")


def test_a_rim_is_a_closed_tube_about_the_opening():
    surface = sp.shapes.box_surface((2.0, 2.0, 2.0), (1, 1, 1))
    top = (surface.vertices[surface.triangles][:, :, 1] > 0.9).all(axis=1)
    points, triangles = rim_of(surface.vertices, surface.triangles[~top], np.array([0.0, 1.0, 0.0]), 0.1)
    assert sp.SurfaceMesh(points, triangles).volume > 0.1
    np.testing.assert_allclose([points[:, 1].min(), points[:, 1].max()], [0.9, 1.1], atol=1e-9)
    assert rim_of(surface.vertices, surface.triangles, np.array([0.0, 1.0, 0.0]), 0.1) is None
