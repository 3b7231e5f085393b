"""`supple view` and `supple demo --live`: what is served, at which address."""

import os
import signal
import socket
import stat
import subprocess
import sys
import urllib.request
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

import numpy as np
import pytest

import supple as sp
from supple.app.cli.app import main
from supple.app.cli.exit_codes import ExitCode
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


@pytest.fixture
def served(monkeypatch):
    """The arguments of `serve`."""
    calls = []

    def serve(source, address, *, open_browser):
        calls.append((source, address, open_browser))

    monkeypatch.setattr("supple.app.viewer.app.serve", serve)
    return calls


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "cube.yaml"
    path.write_text(SCENE)
    return path


def test_a_scene_file_is_served_with_solver_time_step_and_initial_positions(scene, served):
    assert main(["view", str(scene), "--no-open"]) == ExitCode.OK
    [(source, address, open_browser)] = served
    assert isinstance(source, LiveSource)
    assert (source.title, source.dt, source.solver) == ("cube", 0.01, sp.XPBD(substeps=3))
    assert np.ptp(source.initial_positions["cube"], axis=0) == pytest.approx([1, 0.5, 1])
    assert address.host == "127.0.0.1"
    assert len(address.token) >= 24
    assert address.port >= 8080
    assert not open_browser


def test_another_solver_can_be_selected(scene, served):
    assert main(["view", str(scene), "--solver", "implicit"]) == ExitCode.OK
    assert isinstance(served[0][0].solver, sp.Implicit)
    assert served[0][2]


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_for_other_machines_the_address_contains_a_new_token(scene, served, host):
    if host == "::" and not socket.has_ipv6:
        pytest.skip("no IPv6")
    for _ in range(2):
        assert main(["view", str(scene), "--host", host, "--port", "0"]) == ExitCode.OK
    tokens = {address.token for _, address, _ in served}
    assert len(tokens) == 2
    assert all(token is not None and len(token) >= 24 for token in tokens)


def test_a_token_may_be_left_out_on_this_machine_only(scene, served, capsys):
    assert main(["view", str(scene), "--no-token"]) == ExitCode.OK
    assert served[0][1].token is None
    assert main(["view", str(scene), "--no-token", "--host", "0.0.0.0", "--port", "0"]) == ExitCode.INPUT
    assert "needs its token; remove --no-token" in capsys.readouterr().err
    assert len(served) == 1


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


def test_a_recording_is_found_by_its_file_or_folder(tmp_path, served):
    (tmp_path / "recording.vtkhdf").write_bytes(b"")
    for path in (tmp_path, tmp_path / "recording.vtkhdf"):
        assert main(["view", str(path)]) == ExitCode.OK
        assert served[-1][0] == tmp_path / "recording.vtkhdf"
    assert main(["view", str(tmp_path), "--solver", "xpbd"]) == ExitCode.INPUT


def test_a_live_demo_is_served_and_not_recorded(tmp_path, monkeypatch, served):
    monkeypatch.chdir(tmp_path)
    assert main(["demo", "squash", "--live", "--port", "0"]) == ExitCode.OK
    assert main(["demo", "squash", "--live", "--solver", "implicit", "--no-open"]) == ExitCode.OK
    (xpbd, address, opened), (implicit, _, closed) = served
    assert (xpbd.title, address.port, opened, closed) == ("squash", 0, True, False)
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
    address = shell.stdout.readline().split()[0]
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
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = str(other.getsockname()[1])
        for arguments in (
            ["view", str(tmp_path / "missing.yaml")],
            ["view", str(tmp_path / "mesh.stl")],
            ["view", str(outside.parent)],
            ["view", str(outside)],
            ["view", str(scene), "--port", taken],
            ["view", str(scene), "--port", "70000"],
            ["view", str(scene), "--port", "http"],
            ["view", str(scene), "--host", "192.0.2.1"],
            ["view", str(scene), "--host", "no such host"],
            ["demo", "teapot", "--live"],
        ):
            assert main(arguments) == ExitCode.INPUT, arguments
            assert len(capfd.readouterr().err.splitlines()) == 1, arguments
    assert served == []
