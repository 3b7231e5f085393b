"""`sp.view`: the live page from scripts and notebooks."""

import contextlib
import http.server
import json
import os
import re
import signal
import subprocess
import sys
import textwrap
import threading
import urllib.error
import urllib.request

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

import supple as sp
from supple.errors import OutputError, SceneError, SolverError

from .conftest import small_source

TIMEOUT = 120.0
SCRIPT = """
import sys
import supple as sp

def lift(t):
    return (0.0, speed * t, 0.0)

speed = 0.1
rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.3)
body = sp.Body("cube", sp.shapes.box((1, 1, 1), (2, 2, 2)), rubber, position=(0, 1, 0))
scene = sp.Scene([body], [sp.HalfSpace(motion=lift), sp.HalfSpace(point=(0, -1, 0), motion=lambda t: lift(t))])
print("begin", flush=True)
"""


def fetched(url):
    with urllib.request.urlopen(url, timeout=TIMEOUT) as response:
        return response.headers, response.read()


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"scene": "scene.yaml"}, SceneError, "view: the scene is a str; give a Scene"),
        ({"solver": "xpbd"}, SolverError, r"view: the solver is 'xpbd'; give XPBD\(...\) or Implicit\(...\)"),
        ({"dt": 0.0}, SolverError, "view: dt is 0.0; it must be finite and above zero"),
        ({"port": 80_000}, OutputError, "view: port is 80000; give a whole number from 0 to 65535"),
        ({"height": 1.5}, OutputError, "view: height is 1.5; give a whole number from 100 to 4000"),
        ({"block": "no"}, OutputError, "view: block is 'no'; give True or False"),
        ({"initial_positions": {"cube": np.zeros((3, 3))}}, SceneError, "shape"),
    ],
)
def test_wrong_arguments_are_told_before_anything_opens(given, error, message):
    scene = small_source().scene
    with pytest.raises(error, match=message):
        sp.view(**({"scene": scene, "block": False, "open_browser": False} | given))


def test_a_scene_that_cannot_be_simulated_leaves_nothing_open():
    springs = sp.Body("springs", sp.shapes.box(), sp.EdgesAndVolume())
    with pytest.raises(SolverError, match="'springs'"):
        sp.view(sp.Scene([springs]), sp.Implicit(), block=False, open_browser=False)


def test_a_view_is_open_until_it_is_closed():
    source = small_source()
    with sp.view(source.scene, source.solver, source.dt, block=False, open_browser=False, port=0) as view:
        assert re.fullmatch(r"http://localhost:\d+/\?token=.{20,}", view.url)
        headers, page = fetched(view.url)
        assert headers["X-Frame-Options"] == "DENY"
        assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
        assert b"<title>cube, block" in page
        assert view.url in repr(view)
        tag = re.fullmatch(r"<iframe src=\"([^\"]+)\" .*height:600px.*</iframe>", view._repr_html_())
        assert tag[1] == view.url
    with pytest.raises(urllib.error.URLError):
        fetched(view.url)
    view.close()


def test_a_page_in_a_notebook_may_be_framed_by_pages_of_this_machine_only(monkeypatch):
    monkeypatch.setattr("supple.app.viewer.view._in_notebook", lambda: True)
    source = small_source()
    view = sp.view(source.scene, source.solver, port=0, height=300)
    try:
        headers, _ = fetched(view.url)
        (rule,) = re.findall(r"frame-ancestors ([^;]+);", headers["Content-Security-Policy"])
        assert {re.sub(r"^https?://|:\*?$", "", one) for one in rule.split()} == {
            "localhost",
            "127.0.0.1",
            "vscode-webview",
        }
        assert "height:300px" in view._repr_html_()
    finally:
        view.close()


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_ends_the_view_of_a_script_without_a_trace_and_the_script_goes_on(tmp_path):
    """The script has no guard, functions of its own, and lambdas."""
    path = tmp_path / "look.py"
    path.write_text(SCRIPT + "sp.view(scene, sp.XPBD(substeps=2), open_browser=False, port=0)\nprint('after')\n")
    script = subprocess.Popen(
        [sys.executable, str(path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # What a shell starts in the background ignores Ctrl-C.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    try:
        assert script.stdout.readline() == "begin\n"
        line = script.stdout.readline()
        assert line.endswith("  (press Ctrl+C to end)\n")
        assert fetched(line.split()[0])[1]
        os.killpg(script.pid, signal.SIGINT)
        out, err = script.communicate(timeout=TIMEOUT)
    finally:
        script.kill()
    assert (out, err, script.returncode) == ("after\n", "", 0)


def test_a_script_without_a_guard_simulates_its_functions(tmp_path):
    path = tmp_path / "look.py"
    steps = """
    from supple.app.viewer.protocol.commands import Step
    import numpy as np
    view = sp.view(scene, sp.XPBD(substeps=2), block=False, open_browser=False, port=0, full=True)
    engine = view.engine
    engine.send(Step(3))
    while engine.latest().frame < 3:
        engine.wait_for_news(1.0)
    *_, last = sp.simulate(scene, sp.XPBD(substeps=2), 1 / 60, 3)
    print(np.array_equal(engine.latest().positions, last.state.positions))
    """
    path.write_text(SCRIPT + textwrap.dedent(steps))
    done = subprocess.run([sys.executable, str(path)], capture_output=True, text=True, timeout=TIMEOUT, check=True)
    assert (done.stdout, done.stderr) == ("begin\nTrue\n", "")


@contextlib.contextmanager
def page_at(body):
    """A server of this machine with one page."""

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(body.encode())

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://localhost:{server.server_port}/"
    server.shutdown()
    server.server_close()


def test_in_a_notebook_and_its_page_in_a_real_browser(browser, pixels):
    """A kernel of Jupyter runs the cell; another page of this machine shows its output, as notebooks do."""
    cell = "view = sp.view(scene, sp.XPBD(substeps=2), port=0, height=300)\nview"
    notebook = nbformat.v4.new_notebook(
        cells=[nbformat.v4.new_code_cell(part) for part in (SCRIPT, cell, "view.close()")]
    )
    client = NotebookClient(notebook, timeout=int(TIMEOUT))
    with client.setup_kernel():
        for k in (0, 1):
            client.execute_cell(notebook.cells[k], k)
        (output,) = notebook.cells[1].outputs
        assert output.output_type == "execute_result", "no banner of a server"
        with page_at(output.data["text/html"]) as address:
            tab = browser.new_page(viewport={"width": 600, "height": 320})
            try:
                tab.goto(address)
                frame = tab.frames[1]
                frame.wait_for_function("() => window.supplePage && supplePage.view", timeout=1000 * TIMEOUT)
                frame.wait_for_selector("#play", timeout=1000 * TIMEOUT)
                tab.wait_for_timeout(1500)
                assert len(np.unique(pixels(tab).reshape(-1, 3), axis=0)) > 100, "something is drawn"
            finally:
                tab.close()
        client.execute_cell(notebook.cells[2], 2)
    assert json.dumps(notebook.cells[2].outputs) == "[]"
