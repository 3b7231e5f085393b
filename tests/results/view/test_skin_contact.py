"""Drawn skins stay out of obstacles where they reach beyond tets, and only there."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.results.view.from_recording import model_of_recording, render_frame_of
from supple.results.view.surfaces import body_surface

MESH = sp.shapes.box((1.0, 1.0, 1.0), (1, 1, 1))
SOFT = sp.StableNeoHookean(youngs=1e5, poisson=0.3)


def lowest(tmp_path, scale: float, height: float) -> float:
    """The lowest drawn point of a cube whose skin is larger by a factor, with its lowest tet at a height."""
    skin = sp.SurfaceMesh(scale * MESH.vertices, MESH.surface.triangles)
    body = sp.Body("cube", MESH, SOFT, position=(0, 1.5, 0), skin=skin)
    floor = sp.HalfSpace(point=(0, 0, 0), normal=(0, 1, 0))
    sink = sp.Recorder(tmp_path / "r.vtkhdf")
    list(sp.simulate(sp.Scene([body], [floor], gravity=(0, 0, 0)), sp.XPBD(substeps=1), 0.01, 1, sinks=[sink]))
    with sp.read_recording(sink.path) as recording:
        model = model_of_recording(recording)
        frame = render_frame_of(model, recording[0])
        frame = replace(frame, positions=frame.positions + np.array([0.0, height - 1.0, 0.0]))
        return float(body_surface(model, model.bodies[0]).at(frame)[:, 1].min())


@pytest.mark.parametrize(
    ("scale", "height", "drawn"),
    [
        (1.2, 0.5, 0.4),  # above the floor
        (1.2, 0.02, 0.0),  # the skin would reach through the floor
        (0.9, -0.2, -0.15),  # a penetration of the simulation stays visible
        (1.2, -0.9, -1.0),  # so does one that is deeper than a skin reaches
    ],
)
def test_only_what_is_outside_of_tets_is_moved(tmp_path, scale, height, drawn):
    assert lowest(tmp_path, scale, height) == pytest.approx(drawn, abs=0.01)
