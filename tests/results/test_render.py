"""Pictures with traced light show what the others show; what they need is named."""

from types import SimpleNamespace

import numpy as np
import pytest

from supple.app.cli.app import main
from supple.errors import OutputError
from supple.results.export import video
from supple.results.export.render_worker import _without_grain
from supple.results.export.video import Film


def test_a_missing_renderer_is_named(tmp_path, tools, capsys, monkeypatch):
    tools.record(tmp_path / "r.vtkhdf", 2)
    found = video.find_spec
    monkeypatch.setattr(video, "find_spec", lambda name: None if name == "mitsuba" else found(name))
    for command in (["picture"], ["export", "--to", "gif"]):
        assert main([*command, str(tmp_path / "r.vtkhdf"), "--render"]) == 2
        error = capsys.readouterr().err
        assert "needs mitsuba, which is not installed; pip install 'supple[render]'" in error
        assert error.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["r.vtkhdf"]


def test_a_killed_renderer_is_not_the_fault_of_opengl(tmp_path, tools, capsys, monkeypatch):
    tools.record(tmp_path / "r.vtkhdf", 2)
    killed = SimpleNamespace(returncode=-9, stderr="")
    monkeypatch.setattr(video, "find_spec", lambda name: name)
    monkeypatch.setattr(video, "subprocess", SimpleNamespace(run=lambda *_, **__: killed, PIPE=-1, DEVNULL=-3))
    assert main(["picture", str(tmp_path / "r.vtkhdf"), "--render"]) == 2
    error = capsys.readouterr().err
    assert "the drawing process ended with code -9" in error
    assert "OpenGL" not in error
    assert [path.name for path in tmp_path.iterdir()] == ["r.vtkhdf"]


@pytest.mark.parametrize(
    ("film", "reason"),
    [
        ({"samples": 16}, "give render too"),
        ({"render": True, "samples": 0}, "from 1 to 65536"),
        ({"render": True, "samples": 2.5}, "from 1 to 65536"),
        ({"render": True, "shadows": False}, "casts shadows"),
    ],
)
def test_options_that_would_do_nothing_are_refused(film, reason):
    with pytest.raises(OutputError, match=reason):
        Film(**film)


def test_grain_goes_and_edges_stay():
    """Two areas of different light and features, with noise, and a bright point in one pass."""
    light = np.full((32, 48, 3), 0.2)
    light[:, 24:] = 0.7
    features = np.zeros((32, 48, 5))
    features[:, 24:, 0] = 1.0
    passes = (light * np.random.default_rng(1).gamma(16.0, 1 / 16, (8, 32, 48, 1))).astype(np.float32)
    passes[3, 10, 10] = 500.0
    shown = _without_grain(passes, features)
    assert np.abs(shown - light).max() < 0.15  # of 0.5 across the edge
    for side in (np.s_[:, :24], np.s_[:, 24:]):
        assert shown[side].mean() == pytest.approx(light[side].mean(), rel=0.03)
        assert shown[side].std() < 0.4 * passes.mean(axis=0)[side][12:].std()
    one = passes[:1]
    np.testing.assert_array_equal(_without_grain(one, features), one[0])  # nothing says how much it varies


@pytest.mark.usefixtures("own_interpreters")
def test_a_traced_picture_shows_the_bodies_and_the_legend(tmp_path, tools):
    pytest.importorskip("mitsuba")
    image = pytest.importorskip("PIL.Image")
    tools.record(tmp_path / "r.vtkhdf", 2)
    shown = []
    for k, look in enumerate(([], [], ["--color", "J", "--dark"])):
        path = tmp_path / f"{k}.png"
        options = ["--render", "--samples", "4", "--size", "64x64", *look]
        assert main(["picture", str(tmp_path / "r.vtkhdf"), "-o", str(path), *options]) == 0
        with image.open(path) as page:
            shown.append(np.asarray(page.convert("RGB")).astype(int))
    np.testing.assert_array_equal(shown[0], shown[1])  # the same again
    assert shown[0].shape == (64, 64, 3)
    assert shown[0][:3].mean() > 200  # the bright background
    red = (shown[0][..., 0] - shown[0][..., 2]) > 60
    assert red.sum() > 20  # the red body is seen
    assert shown[2][:3].mean() < 80
    bar = shown[2][20:50, 50:]  # of the legend: red, white and blue
    assert np.ptp(bar[..., 0] - bar[..., 2]) > 100
