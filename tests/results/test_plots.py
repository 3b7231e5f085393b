"""The plot is a picture of the numbers in the recording."""

import numpy as np
import pytest

import supple as sp
from supple.errors import OutputError
from supple.results import plots
from supple.results.plots import plot_recording, volume_ratios
from supple.runtime.figures import REST_COLOR, legend_below, paper_figure


def test_a_plot_is_a_picture_with_lines(tmp_path, recorded):
    image = pytest.importorskip("PIL.Image")
    path = plot_recording(recorded[0], tmp_path / "new" / "plot.png")
    with image.open(path) as opened:
        assert opened.format == "PNG"
        pixels = np.asarray(opened.convert("RGB")).astype(int)
    assert pixels.shape == (1215, 1350, 3)
    colored = np.ptp(pixels, axis=2) > 60
    for row in range(3):  # each panel has colored lines, but that of the time of a step, which is grey
        for column in range(2 if row < 2 else 1):
            panel = colored[row * 395 : (row + 1) * 405, column * 675 : (column + 1) * 675]
            assert np.count_nonzero(panel) > 100


@pytest.fixture
def drawn(monkeypatch):
    """The figures that are written, as they are laid out."""
    from matplotlib.figure import Figure

    kept, save = [], Figure.savefig

    def spy(self, *args, **named):
        save(self, *args, **named)
        kept.append(self)

    monkeypatch.setattr(Figure, "savefig", spy)
    return kept


def test_twelve_bodies_leave_room_for_the_axes(tmp_path, drawn):
    box = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
    soft = sp.StableNeoHookean(youngs=1e5, poisson=0.4)
    names = [f"a body with a long name, number {k}" for k in range(12)]
    scene = sp.Scene([sp.Body(name, box, soft, position=(0.2 * k, 0, 0)) for k, name in enumerate(names)])
    path = tmp_path / "r.vtkhdf"
    list(sp.simulate(scene, sp.XPBD(substeps=1), 1 / 60, 2, sinks=[sp.Recorder(path)]))
    plot_recording(path, tmp_path / "plot.png")
    (figure,) = drawn
    volume = figure.axes[1]
    legend = volume.get_legend()
    texts = [text.get_text() for text in legend.get_texts()]
    assert len(volume.lines) == 12
    assert texts == ["a body with a long name, nu…"] * 6 + ["… and 6 more"]
    assert {line.get_color() for line in volume.lines[6:]} == {REST_COLOR}
    assert len({line.get_color() for line in volume.lines[:6]}) == 6
    renderer = figure.canvas.get_renderer()
    for axis in figure.axes:
        box, whole = axis.get_window_extent(renderer), axis.get_tightbbox(renderer)
        assert box.width > 0.7 * figure.bbox.width / 2
        assert box.height > 0.4 * figure.bbox.height / 4
        assert figure.bbox.x0 <= whole.x0 < whole.x1 <= figure.bbox.x1
        if axis.get_legend() is not None:
            assert axis.get_legend().get_window_extent(renderer).y1 < axis.xaxis.label.get_window_extent(renderer).y0
            assert len(axis.get_legend().get_texts()) <= 7
    boxes = [axis.get_tightbbox(renderer) for axis in figure.axes]
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])
    share = sum(axis.get_position().width * axis.get_position().height for axis in figure.axes)
    assert share > 0.3


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
    assert pixels.shape == (2430, 1350, 3)  # works, four of cavities and cables, one of sensors
    colored = np.ptp(pixels, axis=2) > 60
    for row in range(3, 6):
        for column in range(2):
            assert np.count_nonzero(colored[row * 405 : (row + 1) * 405, column * 675 : (column + 1) * 675]) > 100


def test_volume_ratios_are_those_of_the_motion(recording):
    expected = 1.0 + 0.3 * np.sin(4.0 * recording.times)
    np.testing.assert_allclose(volume_ratios(recording), np.column_stack([expected, expected]), atol=1e-12)


def test_plots_that_cannot_be_written(tmp_path, recorded):
    with pytest.raises(OutputError, match="is a folder"):
        plot_recording(recorded[0], tmp_path)
    with pytest.raises(OutputError, match=r"picture format .* does not exist"):
        plot_recording(recorded[0], tmp_path / "plot.docx")
    with pytest.raises(OutputError, match="the file does not exist"):
        plot_recording(tmp_path / "none.vtkhdf", tmp_path / "plot.png")
    assert list(tmp_path.iterdir()) == []


def test_pyplot_is_not_used(tmp_path, recorded):
    import matplotlib.pyplot as plt

    plot_recording(recorded[0], tmp_path / "plot.png")
    assert plt.get_fignums() == []


@pytest.mark.parametrize("size", [1.0, 1e-7, 1e9])
def test_the_legend_does_not_cover_the_power_of_ten(size, tmp_path, drawn):
    with paper_figure(tmp_path / "plot.png", 6.0, 3.0) as figure:
        axis = figure.subplots()
        plots._momentum(axis, np.arange(3.0), size * np.arange(9.0).reshape(3, 3), "momentum")
        legend_below(axis)
    (figure,) = drawn
    power = axis.yaxis.get_offset_text()
    assert bool(power.get_text()) == (size != 1.0)
    legend = axis.get_legend().get_window_extent()
    assert not power.get_text() or not legend.overlaps(power.get_window_extent())
