"""`supple view` and `supple demo --live`: what is served, at which address."""

import os
import signal
import socket
import stat
import subprocess
import sys
import urllib.request
from itertools import pairwise
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

import numpy as np
import pytest

import supple as sp
from supple.app.cli.app import main
from supple.app.cli.console import ExitCode
from supple.app.viewer.app import browser_at
from supple.app.viewer.protocol.live_source import LiveSource

SCENE = """
bodies:
  - name: cube
    shape: {kind: box, divisions: [1, 1, 1]}
    material: {kind: stable_neo_hookean, youngs: 1e5, poisson: 0.4}
    initial: {scale: [1, 0.5, 1]}
solver: {kind: xpbd, substeps: 3}
dt: 0.01
"""


class Calls(list):
    """What was served; and how the last one is read again."""

    again = None


@pytest.fixture
def served(monkeypatch):
    """The arguments of `serve`."""
    calls = Calls()

    def serve(read, title, port, *, open_browser, reload):
        source = read()
        assert source.title == title
        calls.append((source, port, open_browser))
        calls.again = read if reload else None

    monkeypatch.setattr("supple.app.viewer.app.serve", serve)
    return calls


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "cube.yaml"
    path.write_text(SCENE)
    return path


def test_a_scene_file_is_served_with_solver_time_step_and_initial_positions(scene, served):
    assert main(["view", str(scene), "--no-open"]) == ExitCode.OK
    [(source, port, open_browser)] = served
    assert isinstance(source, LiveSource)
    assert (source.title, source.dt, source.solver) == ("cube", 0.01, sp.XPBD(substeps=3))
    assert np.ptp(source.initial_positions["cube"], axis=0) == pytest.approx([1, 0.5, 1])
    assert port is None
    assert not open_browser


def test_the_solver_that_suits_is_served_and_said(scene, served, capsys):
    scene.write_text(SCENE.replace("{kind: xpbd, substeps: 3}", "{kind: auto}").replace("1e5", "1e9"))
    assert main(["view", str(scene), "--no-open"]) == ExitCode.OK
    assert served[0][0].solver == sp.Implicit()
    assert capsys.readouterr().out.startswith("solver implicit: XPBD needs ")


def test_another_solver_can_be_selected(scene, served):
    assert main(["view", str(scene), "--solver", "implicit"]) == ExitCode.OK
    assert isinstance(served[0][0].solver, sp.Implicit)
    assert served[0][2]


def test_a_browser_gets_the_address_from_a_file_of_this_user_alone(monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    with browser_at("http://localhost:1/?token=a&b"):
        [address] = opened
        assert "token" not in address
        path = Path(url2pathname(urlsplit(address).path))
        assert "url=http://localhost:1/?token=a&amp;b" in path.read_text()
        if os.name == "posix":
            assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    assert not path.exists()


def test_the_page_of_a_recording_is_written_beside_it_and_opened(tmp_path, served, monkeypatch, capsys):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    path, page = tmp_path / "recording.vtkhdf", tmp_path / "recording.html"
    scene = sp.Scene(
        [sp.Body("cube", sp.shapes.box((1, 1, 1), (1, 1, 1)), sp.StableNeoHookean(youngs=1e5, poisson=0.3))]
    )
    for _ in sp.simulate(scene, sp.XPBD(substeps=2), 0.01, 2, sinks=[sp.Recorder(path)]):
        pass
    for given in (tmp_path, path):
        page.unlink(missing_ok=True)
        assert main(["view", str(given)]) == ExitCode.OK
        assert "<title>cube" in page.read_text(encoding="utf-8")
        assert opened.pop() == page.as_uri()
        assert capsys.readouterr().out == f"{page}\n"
    assert main(["view", str(path), "--no-open"]) == ExitCode.OK
    for more in (["--solver", "xpbd"], ["--port", "0"], ["--full"], ["--shell"], [str(path)]):
        assert main(["view", str(path), *more]) == ExitCode.INPUT
    assert served == opened == []


def test_several_surfaces_stand_in_a_row_in_one_unit(tmp_path, served):
    """The larger one is in millimetres, as its size tells; so is the smaller one."""
    files = [tmp_path / "a.stl", tmp_path / "b.stl", tmp_path / "more" / "a.stl"]
    files[2].parent.mkdir()
    for path, size in zip(files, (6.0, 20.0, 6.0), strict=True):
        sp.shapes.box_surface((size, size, size), (1, 1, 1)).save(path)
    assert main(["view", *map(str, files), "--no-open"]) == ExitCode.OK
    scene = served[0][0].scene
    assert [body.name for body in scene.bodies] == ["a", "b", "a 2"]
    placed = [body.place(body.mesh.vertices) for body in scene.bodies]
    for x, size in zip(placed, (0.006, 0.02, 0.006), strict=True):
        assert np.ptp(x, axis=0) == pytest.approx([size] * 3, rel=1e-6)
        assert x[:, 1].min() > 0.0
    assert all(a[:, 0].max() < b[:, 0].min() for a, b in pairwise(placed))
    assert served[0][0].title == "a, b, a"
    assert main(["view", *map(str, files), "--shell", "--no-open"]) == ExitCode.OK
    assert all(isinstance(body, sp.Shell) for body in served[1][0].scene.bodies)


def test_reload_reads_the_scene_file_again(scene, served):
    assert main(["view", str(scene)]) == ExitCode.OK
    scene.write_text(SCENE.replace("name: cube", "name: block"))
    again = served.again()
    assert [body.name for body in again.scene.bodies] == ["block"]
    scene.write_text("bodies: [")
    with pytest.raises(sp.SceneError, match=r"cube.yaml"):
        served.again()


def test_a_live_demo_is_served_and_not_recorded(tmp_path, monkeypatch, served):
    monkeypatch.chdir(tmp_path)
    assert main(["demo", "squash", "--live", "--port", "0"]) == ExitCode.OK
    assert main(["demo", "squash", "--live", "--solver", "implicit", "--no-open"]) == ExitCode.OK
    (xpbd, port, opened), (implicit, _, closed) = served
    assert (xpbd.title, port, opened, closed) == ("squash", 0, True, False)
    assert isinstance(xpbd.solver, sp.XPBD)
    assert isinstance(implicit.solver, sp.Implicit)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name != "posix", reason="sends an interrupt as a terminal does")
def test_the_shell_serves_a_page_until_ctrl_c(scene):
    # SIGINT may be ignored where the tests run in the background; at a terminal it is not.
    heard = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)  # noqa: E731
    shell = subprocess.Popen(
        [sys.executable, "-m", "supple", "view", str(scene), "--port", "0", "--no-open"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=heard,
    )
    address = next(line.split()[0] for line in shell.stdout if line.startswith("http"))
    with urllib.request.urlopen(address, timeout=60) as response:
        assert response.status == 200
    os.killpg(shell.pid, signal.SIGINT)  # both processes receive it, as from a terminal
    out, err = shell.communicate(timeout=60)
    assert (shell.returncode, out, err) == (ExitCode.OK, "", "")


def test_errors_are_one_line(tmp_path, scene, served, capfd):
    (tmp_path / "mesh.stl").write_text("solid")
    outside = tmp_path / "inner" / "outside.yaml"
    outside.parent.mkdir()
    outside.write_text(SCENE.replace("shape: {kind: box, divisions: [1, 1, 1]}", "mesh: {file: ../mesh.stl}"))
    for arguments in (
        ["view", str(tmp_path / "missing.yaml")],
        ["view", str(tmp_path / "mesh.stl")],
        ["view", str(outside.parent)],
        ["view", str(outside)],
        ["view", str(scene), "--port", "70000"],
        ["view", str(scene), "--port", "http"],
        ["view", str(scene), str(scene)],
        ["demo", "teapot", "--live"],
    ):
        assert main(arguments) == ExitCode.INPUT, arguments
        assert len(capfd.readouterr().err.splitlines()) == 1, arguments
    assert served == []


def test_a_used_port_is_an_error_of_one_line(scene, capfd):
    with socket.create_server(("127.0.0.1", 0)) as other:
        assert main(["view", str(scene), "--port", str(other.getsockname()[1])]) == ExitCode.INPUT
    [line] = capfd.readouterr().err.splitlines()
    assert "choose another --port" in line
