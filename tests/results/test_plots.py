"""The plot is a picture of the numbers in the recording."""

from __future__ import annotations

import numpy as np
import pytest

import supple as sp
from supple.errors import OutputError
from supple.results import plots
from supple.results.plots import plot_recording, volume_ratios


def test_a_plot_is_a_picture_with_lines(tmp_path, recorded):
    image = pytest.importorskip("PIL.Image")
    path = plot_recording(recorded[0], tmp_path / "new" / "plot.png")
    with image.open(path) as opened:
        assert opened.format == "PNG"
        pixels = np.asarray(opened.convert("RGB")).astype(int)
    assert pixels.shape == (990, 1320, 3)
    colored = np.ptp(pixels, axis=2) > 60
    for row in range(3):  # each panel has colored lines, but that of the time of a step, which is grey
        for column in range(2 if row < 2 else 1):
            panel = colored[row * 320 : (row + 1) * 330, column * 660 : (column + 1) * 660]
            assert np.count_nonzero(panel) > 100


def test_works_cavities_cables_and_sensors_have_panels(tmp_path):
    image = pytest.importorskip("PIL.Image")
    shell = sp.shapes.spherical_shell(inner_radius=0.1, outer_radius=0.15, edge_length=0.1)
    scene = sp.Scene(
        [sp.Body("ball", shell, sp.StableNeoHookean(youngs=1e5, poisson=0.4), position=(0, 0.16, 0))],
        [sp.HalfSpace()],
        cavities=[sp.Cavity("ball", pressure=1e3)],
        cables=[sp.Cable([("ball", 0), (None, (0, 1, 0))], tension=1.0)],
        sensors=[sp.ForceSensor("skin", "ball"), sp.Taxels("palm", "ball", (-1, -1, 0), (2, 0, 0), (0, 2, 0), (2, 2))],
    )
    path = tmp_path / "r.vtkhdf"
    list(sp.simulate(scene, sp.XPBD(substeps=4), 1 / 60, 3, sinks=[sp.Recorder(path)]))
    with image.open(plot_recording(path, tmp_path / "plot.png")) as opened:
        pixels = np.asarray(opened.convert("RGB")).astype(int)
    assert pixels.shape == (
        2310,
        1320,
        3,
    )  # works, four of cavities and cables, two of sensors
    colored = np.ptp(pixels, axis=2) > 60
    for row in range(3, 6):
        for column in range(2):
            assert np.count_nonzero(colored[row * 330 : (row + 1) * 330, column * 660 : (column + 1) * 660]) > 100


def test_volume_ratios_are_those_of_the_motion(recording):
    expected = 1.0 + 0.3 * np.sin(4.0 * recording.times)
    np.testing.assert_allclose(volume_ratios(recording), np.column_stack([expected, expected]), atol=1e-12)


def test_plots_that_cannot_be_written(tmp_path, recorded):
    with pytest.raises(OutputError, match="is a folder"):
        plot_recording(recorded[0], tmp_path)
    with pytest.raises(OutputError, match="no picture format"):
        plot_recording(recorded[0], tmp_path / "plot.docx")
    with pytest.raises(OutputError, match="no such file"):
        plot_recording(tmp_path / "none.vtkhdf", tmp_path / "plot.png")
    assert list(tmp_path.iterdir()) == []


def test_pyplot_is_not_used(tmp_path, recorded):
    import matplotlib.pyplot as plt

    plot_recording(recorded[0], tmp_path / "plot.png")
    assert plt.get_fignums() == []


@pytest.mark.parametrize("size", [1.0, 1e-7, 1e9])
def test_the_legend_does_not_cover_the_power_of_ten(size):
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0, 3.0), layout="constrained")
    canvas = FigureCanvasAgg(figure)
    axis = figure.subplots()
    plots._momentum(axis, np.arange(3.0), size * np.arange(9.0).reshape(3, 3), "momentum")
    canvas.draw()
    power = axis.yaxis.get_offset_text()
    assert bool(power.get_text()) == (size != 1.0)
    legend = axis.get_legend().get_window_extent()
    assert not power.get_text() or not legend.overlaps(power.get_window_extent())
