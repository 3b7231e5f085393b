"""Films and pictures of recordings are what was asked for."""

import os
import subprocess
import sys

import numpy as np
import pytest

import supple as sp
from supple.app.cli.app import main
from supple.errors import OutputError
from supple.results.export import video
from supple.results.export.exporter import export
from supple.results.export.video_worker import Studio
from supple.results.view.fields import nodal_values
from supple.results.view.from_recording import model_of_recording, render_frame_of
from supple.results.view.surfaces import SoftSurface, body_surface, surfaces_of


@pytest.mark.usefixtures("own_interpreters")
def test_gif_shows_motion_before_a_dark_background(tmp_path, tools, capsys):
    image = pytest.importorskip("PIL.Image")
    pytest.importorskip("pyvista")
    tools.record(tmp_path / "short.vtkhdf", 6)
    code = main(["export", str(tmp_path / "short.vtkhdf"), "--to", "gif", "--view", "front", "--dark"])
    error = capsys.readouterr().err
    if "OpenGL" in error and not os.environ.get("CI"):
        pytest.skip(error)
    assert code == 0, error
    with image.open(tmp_path / "short.gif") as pages:
        assert pages.n_frames == 5  # 0.2 s, at 20 frames per second
        shown = []
        for k in (0, 4):
            pages.seek(k)
            shown.append(np.asarray(pages.convert("RGB")).astype(int))
    assert shown[0].shape == (360, 640, 3)
    assert shown[0][:5].mean() < 60
    red = (shown[0][..., 0] - shown[0][..., 2]) > 80
    assert red.sum() > 200  # the red body is seen
    assert np.abs(shown[0] - shown[1]).max(axis=2).astype(bool).mean() > 0.01


def test_mp4_plays_every_frame_at_the_speed_of_the_simulation(tmp_path, tools):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    pytest.importorskip("pyvista")
    tools.record(tmp_path / "short.vtkhdf", 4)
    try:
        path = export(tmp_path / "short.vtkhdf", "mp4")
    except OutputError as error:
        if "OpenGL" not in str(error) or os.environ.get("CI"):
            raise
        pytest.skip(str(error))
    assert ffmpeg.count_frames_and_secs(str(path)) == (5, pytest.approx(5 / 30, abs=0.01))
    frames = ffmpeg.read_frames(str(path))
    facts = next(frames)
    assert (facts["size"], facts["codec"], facts["fps"]) == ((1280, 720), "h264", 30.0)
    shown = [np.frombuffer(frame, np.uint8).reshape(720, 1280, 3).astype(int) for frame in frames]
    red = (shown[0][..., 0] - shown[0][..., 2]) > 80
    assert red.sum() > 800  # the red body is seen
    assert (np.abs(shown[0] - shown[4]).max(axis=2) > 30).mean() > 0.01


def test_a_picture_is_colored_by_a_field_has_a_legend_and_a_shadow(tmp_path, tools, capsys):
    image = pytest.importorskip("PIL.Image")
    pytest.importorskip("pyvista")
    tools.record(tmp_path / "r.vtkhdf", 4)
    looks = ["--color J --camera follow", "--color J --camera follow --no-shadows"]
    shown = []
    for k, look in enumerate(looks):
        path = tmp_path / f"{k}.png"
        code = main(["picture", str(tmp_path / "r.vtkhdf"), "-o", str(path), "--size", "320x200", *look.split()])
        error = capsys.readouterr().err
        if "OpenGL" in error and not os.environ.get("CI"):
            pytest.skip(error)
        assert code == 0, error
        with image.open(path) as page:
            shown.append(np.asarray(page.convert("RGB")).astype(int))
    assert all(picture.shape == (200, 320, 3) for picture in shown)
    assert shown[0][:5].mean() > 220  # the bright background
    legend = shown[0][40:160, 270:320]
    assert (legend[..., 0] - legend[..., 2] > 80).any()
    assert (legend[..., 2] - legend[..., 0] > 80).any()
    darker = (shown[1] - shown[0]).sum(axis=2) > 30
    assert 0.002 < darker.mean() < 0.3
    assert ((shown[1] - shown[0]).sum(axis=2) < -30).mean() < 1e-3  # a shadow makes nothing brighter


def test_a_picture_is_drawn_from_a_place_and_of_the_simulated_surface(tmp_path, recorded, capsys):
    """Of the cube, whose skin is within; from straight above, where gravity gives the picture no upward direction."""
    image = pytest.importorskip("PIL.Image")
    pytest.importorskip("pyvista")
    metre = 120 / (2.0 * np.tan(np.radians(15.0)))  # in pixels, where it is 1 m away
    # Heights of the eye and of what is drawn: the tips of an octahedron, or the upper side of the cube.
    for surface, height, area in (
        ("skin", 6, 2.0 * (0.45 * metre / 4.5) ** 2),
        ("tets", 9, (metre / 7.0) ** 2),
    ):
        places = f"--time 0 --no-shadows --eye 0.5 {height} 0.5 --target 0.5 1.5 0.5 --surface {surface}"
        output = ["-o", str(tmp_path / "x.png"), "--size", "160x120"]
        code = main(["picture", str(recorded[0]), *output, *places.split()])
        error = capsys.readouterr().err
        if "OpenGL" in error and not os.environ.get("CI"):
            pytest.skip(error)
        assert code == 0, error
        with image.open(tmp_path / "x.png") as page:
            pixels = np.asarray(page.convert("RGB")).astype(int)
        assert ((pixels[..., 0] - pixels[..., 2]) > 60).sum() == pytest.approx(area, rel=0.12), surface


def test_the_sides_of_a_cube_are_flat_and_its_edges_sharp(tmp_path, capsys):
    image = pytest.importorskip("PIL.Image")
    pytest.importorskip("pyvista")
    cube = sp.Body("cube", sp.shapes.box(divisions=(2, 2, 2)), sp.StableNeoHookean(youngs=1e4, poisson=0.3))
    scene, recorder = sp.Scene([cube], gravity=(0, 0, 0)), sp.Recorder(tmp_path / "r.vtkhdf")
    list(sp.simulate(scene, sp.XPBD(substeps=4), 0.01, 1, sinks=[recorder]))
    code = main(["picture", str(recorder.path), "-o", str(tmp_path / "cube.png"), "--size", "160x120"])
    error = capsys.readouterr().err
    if "OpenGL" in error and not os.environ.get("CI"):
        pytest.skip(error)
    assert code == 0, error
    with image.open(tmp_path / "cube.png") as page:
        red, _, blue = np.moveaxis(np.asarray(page.convert("RGB")).astype(int), 2, 0)
    drawn = red - blue > 60
    within = drawn & np.roll(drawn, 3, 1) & np.roll(drawn, -3, 1) & np.roll(drawn, 3, 0) & np.roll(drawn, -3, 0)
    steps = np.abs(np.diff(red, axis=1))[within[:, 1:]]
    assert (steps <= 2).mean() > 0.9  # 0.77 where normals are smooth across the edges
    assert steps.max() > 10


def test_a_field_of_quadratic_tets_has_values_at_middle_nodes(tmp_path):
    path = tmp_path / "q.vtkhdf"
    mesh = sp.shapes.box(divisions=(2, 1, 1), order=2)
    body = sp.Body("q", mesh, sp.StableNeoHookean(youngs=1e4, poisson=0.3))
    list(sp.simulate(sp.Scene([body], gravity=(0, 0, 0)), sp.Implicit(), 0.01, 1, sinks=[sp.Recorder(path)]))
    with sp.read_recording(path) as recording:
        model = model_of_recording(recording)
        render_frame = render_frame_of(model, recording[-1])
        values = np.repeat(nodal_values(render_frame, np.linspace(2.0, 3.0, len(model.tets)))[:, None], 3, axis=1)
        surface = body_surface(model, model.bodies[0])
        assert isinstance(surface, SoftSurface)
        drawn = surface.of(values)
    assert len(drawn) > len(np.unique(mesh.tets))
    assert 2.0 <= drawn.min() < drawn.max() <= 3.0


@pytest.mark.parametrize(
    ("to", "film", "words"),
    [
        ("mp4", {"camera": "fly"}, "camera is 'fly'; give one of fit, follow, orbit"),
        ("mp4", {"size": (1281, 720)}, r"size is \(1281, 720\); give even pixels"),
        ("gif", {"rate": 0}, "rate is 0; give a number above zero"),
        ("png", {"colour": "J"}, "colour does not exist; there are size, rate"),
        ("png", {"surface": "cut"}, "surface is 'cut'; give one of skin, tets"),
        ("png", {"eye": (1, 2, 3)}, "target is missing; give eye and target together"),
        ("png", {"eye": (1, 2), "target": (0, 0, 0)}, r"eye has shape \(2,\); give three numbers"),
        ("mp4", {"eye": (1, 2, 3), "target": (0, 0, 0), "camera": "follow"}, "leave out view, and camera follow"),
        ("csv", {"size": (64, 64)}, "size: only gif, mp4, png are drawn"),
    ],
)
def test_a_film_that_cannot_be_is_an_error(recorded, tmp_path, to, film, words):
    with pytest.raises(OutputError, match=words):
        export(recorded[0], to, tmp_path / f"x.{to}", **film)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("places", "words"),
    [
        ("--eye 1 2 --target 0 0 0", "--eye requires 3"),
        ("--eye 1 2 -3 --target 1 2 -3", "eye and target are the same place; move one"),
        ("--eye 1 2 nan --target 1 2 -3", "eye is [1.0, 2.0, nan]; it must be finite"),
    ],
)
@pytest.mark.parametrize("command", ["picture", "export --to gif"])
def test_places_of_a_camera_that_cannot_be_are_errors_of_one_line(recorded, tmp_path, capsys, command, places, words):
    name, *to = command.split()
    output = ["-o", str(tmp_path / f"x.{to[1] if to else 'png'}")]
    assert main([name, str(recorded[0]), *to, *output, *places.split()]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_crash_of_the_drawing_process_is_an_error_of_one_line(tmp_path, recorded, monkeypatch):
    """Where OpenGL is missing, VTK aborts its process; here another process does."""
    die = "import os, sys; sys.stderr.write('libEGL warning: no display\\nvtkEGLRenderWindow failed\\n'); os.abort()"
    real = subprocess.run
    monkeypatch.setattr(video.subprocess, "run", lambda _, **options: real([sys.executable, "-c", die], **options))
    with pytest.raises(OutputError, match=r"apt install libegl1 .*code -6"):
        export(recorded[0], "gif", tmp_path / "x.gif")
    assert list(tmp_path.iterdir()) == []


def test_a_picture_is_drawn_again_only_where_something_has_moved(recording, monkeypatch):
    model = model_of_recording(recording)
    first, later = (render_frame_of(model, recording[k]) for k in (0, 9))
    studio = object.__new__(Studio)
    vars(studio).update(_meshes=[(None, one) for one in surfaces_of(model)], _bodies=2, _field=None)
    vars(studio).update(_image=None, _seen=[], _lines=[], _legend=None)
    monkeypatch.setattr(Studio, "_aim", lambda self, points, share: np.array([share]))
    monkeypatch.setattr(Studio, "_drawn", lambda self, points, nodal: np.zeros((1, 1, 3), np.uint8))
    shown = [studio.picture(*one) for one in ((first, 0.0), (first, 0.0), (later, 0.0), (later, 0.5))]
    assert shown[0] is shown[1]
    assert len({id(one) for one in shown}) == 3  # bodies moved, and then the camera
