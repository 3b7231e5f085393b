"""Stitches in reports, recordings, pages and plots."""

import h5py
import numpy as np
import pytest
from tests.recordings import set_in_scene

import supple as sp
from supple.model.system import initial_state
from supple.results.plots import plot_recording
from supple.results.view.from_recording import model_of_recording, render_frame_of
from supple.scene.stitches.measures import largest_stitch_stretch, stitch_energy

SOFT = sp.StableNeoHookean(youngs=1e4, poisson=0.3)
SHEET = sp.SurfaceMesh([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 2, 1], [0, 3, 2]])


def scene():
    """A box on a rising sheet, and a box joined to it by all kinds of stitches."""
    mesh = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
    bodies = [sp.Body("low", mesh, SOFT, position=(0, 0.06, 0)), sp.Body("high", mesh, SOFT, position=(0, 0.18, 0))]
    up = sp.Keyframes([0.0, 1.0], [[0, 0, 0], [0, 0.5, 0]])
    stitches = [
        sp.SoftVertexTriangleStitch("low", "sheet", max_distance=0.0101, youngs=1e4, poisson=0.3),
        sp.VertexEdgeStitch("high", "low", max_distance=0.0201, stiffness=10.0),
    ]
    return sp.Scene(bodies, [sp.obstacles.TriangleObstacle(name="sheet", surface=SHEET, motion=up)], stitches=stitches)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path = tmp_path_factory.mktemp("stitches") / "r.vtkhdf"
    frames = list(sp.simulate(scene(), sp.XPBD(substeps=20), 1 / 30, 8, sinks=[sp.Recorder(path)]))
    return path, frames


def test_stitch_energy_is_zero_at_rest_and_positive_when_stretched():
    one = scene()
    stitching = one.stitching
    x = initial_state(one).positions
    points = stitching.points(x, 0.0)
    assert stitch_energy(stitching, points) == pytest.approx(0.0, abs=1e-15)
    assert largest_stitch_stretch(stitching, points) == pytest.approx(1.0, abs=1e-9)
    # The upper box 1 cm up: four springs from 2 cm to 3 cm.
    x[8:, 1] += 0.01
    points = stitching.points(x, 0.0)
    assert stitch_energy(stitching, points) == pytest.approx(4 * 0.5 * 10.0 * 0.01**2)
    assert largest_stitch_stretch(stitching, points) == pytest.approx(1.5)
    # All 1 cm up: tets twice as high, J = 2, Ic = 6 at once.
    x[:8, 1] += 0.01
    x[8:, 1] -= 0.01 - 0.01
    points = stitching.points(x, 0.0)
    tets = stitching.tets
    wanted = float((0.5 * tets.mu * 3.0 - tets.mu + 0.5 * tets.lam) @ tets.rest_volumes)
    assert stitch_energy(stitching, points) == pytest.approx(wanted)
    assert largest_stitch_stretch(stitching, points) == pytest.approx(2.0)


def test_reports_and_recordings_agree(recorded):
    path, frames = recorded
    with sp.read_recording(path) as recording:
        assert len(recording.stitches) == 8
        for frame, kept in zip(frames, recording[1:], strict=True):
            assert kept.report.stitch_energy == frame.report.stitch_energy > 0.0
            assert kept.report.largest_stitch_stretch == frame.report.largest_stitch_stretch
        assert recording.series("stitch_energy")[0] == pytest.approx(0.0, abs=1e-15)
        for kept in (recording[0], recording[8]):
            segments = recording.stitches.segments(kept.state.positions, kept.obstacle_poses)
            assert segments.shape == (8, 2, 3)
            nodes = frames[0].system.stitching.tets.vertices[:, 0]
            assert np.array_equal(segments[:4, 0], kept.state.positions[nodes])
            # The sheet rises by half a metre a second; under each corner of the box is where it was stitched.
            assert np.allclose(segments[:4, 1, 1], 0.5 * kept.time)
            assert np.allclose(np.abs(segments[:4, 1, [0, 2]]), 0.05)
        first = recording.stitches.segments(recording[0].state.positions, recording[0].obstacle_poses)
        assert np.allclose(np.linalg.norm(first[:, 0] - first[:, 1], axis=1), [0.01] * 4 + [0.02] * 4)


def test_broken_stitches_are_not_drawn(tmp_path):
    one = scene()
    weak = sp.VertexEdgeStitch("high", "low", max_distance=0.0201, stiffness=10.0, strength=0.01)
    path = tmp_path / "r.vtkhdf"
    torn = sp.Scene(one.bodies, one.obstacles, stitches=[one.stitches[0], weak])
    *_, last = sp.simulate(torn, sp.XPBD(substeps=20), 1 / 30, 8, sinks=[sp.Recorder(path)])
    broken = np.isin(np.arange(8), last.state.broken_stitches)
    assert broken.any()
    assert not broken[:4].any()
    with sp.read_recording(path) as recording:
        model = model_of_recording(recording)
        first, end = (render_frame_of(model, recording[k]).stitch_segments for k in (0, -1))
        lengths = [np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1) for ends in (first, end)]
    assert first.shape == end.shape == (8, 2, 3)
    assert (lengths[0] > 0.0).all()
    assert np.array_equal(lengths[1] == 0.0, broken)


def test_the_plot_has_energy_and_stretch_of_stitches(recorded, tmp_path, monkeypatch):
    from matplotlib.axes import Axes

    lines, plot = {}, Axes.plot

    def spy(self, *args, **named):
        lines[named.get("label", named.get("color"))] = np.asarray(args[1], dtype=float)
        return plot(self, *args, **named)

    monkeypatch.setattr(Axes, "plot", spy)
    plot_recording(recorded[0], tmp_path / "plot.png")
    reports = [frame.report for frame in recorded[1]]
    assert np.array_equal(lines["stitch"][1:], [report.stitch_energy for report in reports])
    from supple.results.plots import STITCH_LINE

    assert np.array_equal(lines[STITCH_LINE][1:], [report.largest_stitch_stretch for report in reports])


def test_invalid_stitches_in_a_recording_are_an_error(recorded, tmp_path):
    path = tmp_path / "broken.vtkhdf"
    path.write_bytes(recorded[0].read_bytes())
    with h5py.File(path, "r+") as file:
        set_in_scene(file, "scene/stitches/1", sp.VertexVertexStitch("high", "low", pairs=[(10_000, 0)], stiffness=1.0))
    with pytest.raises(sp.OutputError, match="10000"):
        sp.read_recording(path)
