"""A fake simulation for tests of the page: it stores received commands, and sends given snapshots."""

import contextlib
import json
import struct
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.protocol.commands import Watch
from supple.app.viewer.protocol.snapshots import BodyDescription, Measures, SceneDescription, Snapshot, Timing
from supple.scene.rows import rows_of
from supple.scene.stitches.measures import StitchEnds
from supple.scene.stitches.stitching import no_stitching

TOKEN = "the-token-of-the-tests"


class FakeSimulation:
    """The interface of a simulation. `received` are the commands, `snapshot` is the newest one."""

    def __init__(self, snapshot: Snapshot) -> None:
        self.snapshot, self.received, self.error = snapshot, [], None
        self.sent = 0  # number of commands; the test sets `snapshot.applied`
        self.progress, self.watched, self.starts, self.again = None, True, 0, None

    @property
    def heard_at(self) -> float:
        return time.monotonic()

    def wait_for_news(self, seconds: float) -> None:
        time.sleep(0.002)

    def restart(self) -> None:
        self.error, self.starts = None, self.starts + 1

    def reload(self) -> None:
        self.again()
        self.restart()

    def send(self, command):
        if isinstance(command, Watch):
            self.watched = command.watched
            return 0
        self.received.append(command)
        self.sent += 1
        return self.sent

    def latest(self):
        return self.snapshot

    def show(self, **changes) -> Snapshot:
        self.snapshot = replace(self.snapshot, frame=self.snapshot.frame + 1, **changes)
        return self.snapshot


def describe(*meshes: sp.TetMesh, skin=None, **changes) -> SceneDescription:
    material = sp.StableNeoHookean(youngs=1e5, poisson=0.4)
    values = {"youngs": 1e5, "poisson": 0.4, "damping": 0.0, "density": 1000.0, "friction": 0.0}
    surface = None if skin is None else sp.SurfaceMesh(*skin)
    things = [sp.Body(f"body {i}", mesh, material, skin=None if i else surface) for i, mesh in enumerate(meshes)]
    rows = rows_of(things)
    bodies = [BodyDescription(one.body, one.number, one.vertices, one.tets, values) for one in rows]
    n, m = rows[-1].vertices.stop, rows[-1].tets.stop
    x = np.concatenate([mesh.vertices for mesh in meshes])
    floor = sp.HalfSpace(name="floor")
    made = SceneDescription(
        revision=1,
        bodies=tuple(bodies),
        obstacles=(floor,),
        solver="xpbd",
        values={"substeps": 20, "momentum_restore": True, "gravity": -9.81},
        up=np.array([0.0, 1.0, 0.0]),
        low=x.min(axis=0),
        high=x.max(axis=0),
        stitches=StitchEnds.of(no_stitching(n), things),
        n_tets=m,
    )
    return replace(made, **changes)


def snapshot_of(description: SceneDescription, **changes) -> Snapshot:
    still = np.zeros(3)
    measures = Measures(0.9, 1.0, 2.0, 3.0, 0.0, None, still, still, "converged", "", 0, None, 1)
    made = Snapshot(
        description=description,
        frame=0,
        time=0.0,
        positions=np.concatenate([body.body.mesh.vertices for body in description.bodies]),
        obstacle_poses=(np.eye(3)[None], np.zeros((1, 3))),
        pinned=np.zeros(0, dtype=np.int32),
        grabs=(),
        paused=True,
        speed=1.0,
        measures=measures,
        timing=Timing(1.0, 60.0, 1.0),
    )
    return replace(made, **changes)


def two_boxes() -> FakeSimulation:
    """A fake simulation of two small boxes above a floor."""
    mesh = sp.shapes.box(size=(1.0, 1.0, 1.0), divisions=(2, 2, 2))
    other = sp.TetMesh(mesh.vertices + np.array([2.0, 0.0, 0.0]), mesh.tets)
    return FakeSimulation(snapshot_of(describe(mesh, other)))


@pytest.fixture
def fake():
    """See `two_boxes`."""
    return two_boxes()


class Visitor:
    """A websocket client as the page is one. It reads messages, and says that it has drawn frames, or not.

    Attributes
    ----------
    scenes, frames, statuses, notices, files : what came, as dictionaries
    """

    def __init__(self, port: int, query: str = f"?token={TOKEN}", reads: bool = True) -> None:
        from websockets.sync.client import connect

        self.scenes, self.frames, self.statuses, self.notices, self.files = [], [], [], [], []
        self.arrays = []  # for each frame, reads the arrays to which it refers
        self.line = connect(f"ws://127.0.0.1:{port}/{query}", max_size=None, close_timeout=0.5, compression=None)
        if reads:
            threading.Thread(target=self._read, daemon=True).start()

    def send(self, act: str, **values) -> None:
        self.line.send(json.dumps({"act": act, **values}))

    def leave(self) -> None:
        self.line.close()

    def _read(self) -> None:
        from websockets.exceptions import ConnectionClosed

        with contextlib.suppress(ConnectionClosed):
            for message in self.line:
                told, array = (json.loads(message), None) if isinstance(message, str) else read_block(message)
                if told["kind"] == "frame":
                    self.arrays.append(array)
                if told["kind"] == "file":
                    told["content"] = array(told["bytes"]).tobytes()
                by_kind = {"scene": self.scenes, "frame": self.frames, "status": self.statuses, "file": self.files}
                by_kind.get(told["kind"], self.notices).append(told)
                if told["kind"] == "frame":
                    self.send("drawn")


def read_block(block: bytes):
    """The description in a block, and the arrays to which it refers."""
    (length,) = struct.unpack("<I", block[:4])

    def array(ref):
        return np.frombuffer(block, "<" + ref["type"], ref["count"], 4 + length + ref["at"])

    return json.loads(block[4 : 4 + length]), array


@pytest.fixture(scope="session")
def until():
    """Waits until a condition holds; fails after a time limit."""

    def wait(holds, seconds: float = 20.0, what: str = "what was waited for"):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if found := holds():
                return found
            time.sleep(0.01)
        raise AssertionError(f"{what} did not come within {seconds:g} s")

    return wait


@pytest.fixture
def live(fake):
    """A served page of the fake simulation; its `port`."""
    with served_page(fake) as made:
        yield made


@contextlib.contextmanager
def served_page(simulation, port: int = 0):
    from supple.app.viewer.gate import Gate
    from supple.app.viewer.live_page import LivePage
    from supple.app.viewer.server import served
    from supple.results.page.client import client

    page = LivePage({"title": "boxes", "command": "supple view boxes.yaml"})
    if simulation is not None:
        page.attach(simulation)
    with served(Gate(TOKEN, client("boxes")), page.visit, port) as server:
        page.start(server)
        page.port = server.port
        try:
            yield page
        finally:
            page.stop()


@pytest.fixture
def visitor(live, until):
    """A visitor of the page of the fake simulation, who has the first frame."""
    made = Visitor(live.port)
    until(lambda: made.frames)
    yield made
    made.leave()


class Screen:
    """A browser with a page, and the actions of a person there; `tab` is Playwright's page."""

    def __init__(self, browser, pixels, url: str, shown: str = "globalThis.supplePage?.pictures > 0") -> None:
        self._pixels = pixels
        self.errors: list[str] = []
        self.tab = browser.new_page(viewport={"width": 720, "height": 420})
        self.tab.set_default_timeout(90_000)  # software rendering on a busy machine
        self.tab.on("pageerror", lambda error: self.errors.append(str(error)))
        self.tab.on("console", lambda said: self.errors.append(said.text) if said.type == "error" else None)
        self.tab.goto(url)
        self.holds(shown)

    def wait(self, holds, what: str, seconds: float = 90.0):
        """Wait until a condition holds, while the browser runs."""
        end = time.monotonic() + seconds
        while not (found := holds()):
            if time.monotonic() > end:
                raise AssertionError(f"{what} did not come within {seconds:g} s")
            self.tab.wait_for_timeout(50)
        return found

    def holds(self, condition: str) -> None:
        """Wait for a condition in JavaScript, which the page's own policy does not let it evaluate."""
        self.wait(lambda: self.tab.evaluate(f"Boolean({condition})"), condition)

    def shot(self) -> np.ndarray:
        """(h, w, 3): the picture without the panel and the bar."""
        return self._pixels(self.tab, clip={"x": 0, "y": 30, "width": 460, "height": 320})

    def place(self, point) -> tuple[float, float]:
        """Position of a point on the screen [pixels]."""
        at = """(x) => {
          const camera = supplePage.view.camera;
          const p = camera.position.clone().set(...x).project(camera);
          return [(0.5 + 0.5 * p.x) * innerWidth, (0.5 - 0.5 * p.y) * innerHeight];
        }"""
        return tuple(self.tab.evaluate(at, [float(x) for x in point]))


@pytest.fixture(scope="session")
def look(browser, pixels):
    """Opens pages in the browser: `look(url)`."""
    opened = []

    def open_page(url: str, *shown: str) -> Screen:
        opened.append(Screen(browser, pixels, url, *shown))
        return opened[-1]

    yield open_page
    for screen in opened:
        screen.tab.close()


@pytest.fixture(scope="session")
def spot():
    """Finds a body by its color in a picture: number of pixels, their center (x, y), and their height."""

    def find(shot: np.ndarray, color: str) -> tuple[int, np.ndarray, int]:
        r, g, b = (shot[..., k] for k in range(3))
        mask = (r - b > 70) & (r - g > 60) if color == "red" else (b - r > 60) & (b - r > g - r)
        y, x = np.nonzero(mask)
        if len(y) == 0:
            return 0, np.zeros(2), 0
        return len(y), np.array([x.mean(), y.mean()]), int(np.percentile(y, 99) - np.percentile(y, 1))

    return find
