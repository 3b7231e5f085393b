"""A fake simulation for tests of the page: it stores received commands, and sends given snapshots."""

import contextlib
import re
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
    bodies = [BodyDescription(one.body, one.number, one.vertices, one.tets, values, 1.0) for one in rows]
    n, m = rows[-1].vertices.stop, rows[-1].tets.stop
    x = np.concatenate([mesh.vertices for mesh in meshes])
    floor = sp.HalfSpace(name="floor")
    made = SceneDescription(
        generation=1,
        revision=1,
        bodies=tuple(bodies),
        obstacles=(floor,),
        solver="xpbd",
        values={"substeps": 20, "momentum_restore": True, "gravity": -9.81},
        up=np.array([0.0, 1.0, 0.0]),
        low=x.min(axis=0),
        high=x.max(axis=0),
        stitches=StitchEnds.of(no_stitching(n), things),
        n_vertices=n,
        n_tets=m,
        n_constraints=3 * m,
    )
    return replace(made, **changes)


def snapshot_of(description: SceneDescription, **changes) -> Snapshot:
    still, spins = np.zeros(3), np.zeros((len(description.bodies), 3))
    measures = Measures(0.9, 1.0, 2.0, 3.0, 0.0, None, still, still, "converged", "", spins, 0, None, 1)
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
    """A websocket client that sends the messages of a page, and may read or not."""

    def __init__(self, port: int, query: str = f"?token={TOKEN}", reads: bool = True) -> None:
        import viser
        from websockets.sync.client import connect

        self.taken = 0  # messages

        self.line = connect(
            f"ws://127.0.0.1:{port}/{query}",
            subprotocols=[f"viser-v{viser.__version__}"],
            max_size=None,
            close_timeout=0.5,
        )
        if reads:
            threading.Thread(target=self._read, daemon=True).start()
        # The server counts a visitor after it has sent its camera.
        self.report_camera(position=(0.0, 0.0, -5.0), look_at=(0.0, 0.0, 0.0))

    def report_camera(self, position, look_at) -> None:
        self.send(
            "ViewerCameraMessage",
            wxyz=(1.0, 0.0, 0.0, 0.0),
            position=_plain(position),
            fov=0.6,
            near=0.01,
            far=100.0,
            image_height=480,
            image_width=640,
            look_at=_plain(look_at),
            up_direction=(0.0, -1.0, 0.0),
        )

    def send(self, kind: str, **fields) -> None:
        import msgspec

        self.line.send(msgspec.msgpack.encode({"type": kind, **fields}))

    def set(self, handle, value) -> None:
        self.send("GuiUpdateMessage", uuid=handle._impl.uuid, updates={"value": value})

    def press(self, button) -> None:
        self.send("GuiUpdateMessage", uuid=button._impl.uuid, updates={"value": True})

    def drag(self, handle, phase: str, start, end) -> None:
        self.send(
            "SceneNodeDragMessage",
            phase=phase,
            name=handle.name,
            instance_index=None,
            start_position=_plain(start),
            start_screen_pos=(0.5, 0.5),
            end_position=_plain(end),
            end_screen_pos=(0.5, 0.5),
            button="left",
            modifier=None,
            owner="",
        )

    def click(self, handle, origin, direction, modifier=None) -> None:
        self.send(
            "SceneNodeClickMessage",
            name=handle.name,
            instance_index=None,
            ray_origin=_plain(origin),
            ray_direction=_plain(direction),
            screen_pos=(0.5, 0.5),
            modifier=modifier,
            owner="",
        )

    def leave(self) -> None:
        self.line.close()

    def _read(self) -> None:
        from websockets.exceptions import ConnectionClosed

        with contextlib.suppress(ConnectionClosed):
            for _ in self.line:
                self.taken += 1


def _plain(point) -> list[float]:
    return [float(x) for x in point]


@pytest.fixture(scope="session")
def visit():
    """Creates visitors: `visit(port)`."""
    return Visitor


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
def server():
    """A server of pages."""
    from supple.app.viewer.app import configure_page
    from supple.results.view.server import gated_server

    with gated_server(TOKEN) as made:
        configure_page(made, "boxes")
        yield made


@pytest.fixture
def live(server, fake):
    """A page of the fake simulation."""
    from supple.app.viewer.live_page import LivePage

    page = LivePage(server, fake, fake.snapshot)
    yield page
    page.stop()


@pytest.fixture
def visitor(live, server, visit, until):
    """A visitor of the page of the fake simulation."""
    made = visit(server.get_port())
    until(server.get_clients)
    yield made
    made.leave()


class Screen:
    """A browser with a page, and the actions of a person there.

    Attributes
    ----------
    tab : Playwright's page; server : viser's
    """

    def __init__(self, browser, pixels, url: str, server) -> None:
        self._pixels, self.server = pixels, server
        self.errors: list[str] = []
        self.tab = browser.new_page(viewport={"width": 720, "height": 420})
        self.tab.set_default_timeout(90_000)  # software rendering on a busy machine
        self.tab.on("pageerror", lambda error: self.errors.append(str(error)))
        self.tab.on("console", self._hear)
        self.tab.goto(url)
        self.tab.wait_for_selector("canvas")
        # A notification about software OpenGL has the color of a body.
        self.tab.locator(".mantine-Notification-closeButton").first.dispatch_event("click")
        self.wait(lambda: server.get_clients(), "the browser as a visitor")

    def close(self) -> None:
        """Must be called at the end of the test: software rendering would slow down the others."""
        self.tab.close()

    def wait(self, holds, what: str, seconds: float = 90.0):
        """Wait until a condition holds, while the browser runs."""
        end = time.monotonic() + seconds
        while not (found := holds()):
            if time.monotonic() > end:
                self.tab.screenshot(path="screenshot-of-failure.png")
                raise AssertionError(f"{what} did not come within {seconds:g} s")
            self.tab.wait_for_timeout(50)
        return found

    def _hear(self, message) -> None:
        # A known warning of sliders about their event listeners.
        if message.type == "error" and "passive event listener" not in message.text:
            self.errors.append(message.text)

    @property
    def client(self):
        return list(self.server.get_clients().values())[-1]

    def shot(self) -> np.ndarray:
        """(h, w, 3): the picture without the panel."""
        box = self.tab.locator("canvas").first.bounding_box()
        return self._pixels(self.tab, clip=box)

    def place(self, point) -> tuple[float, float]:
        """Position of a point on the screen [pixels]."""
        camera = self.client.camera
        eye, ahead = np.asarray(camera.position), np.asarray(camera.look_at) - np.asarray(camera.position)
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, np.asarray(camera.up_direction))
        right /= np.linalg.norm(right)
        away = np.asarray(point) - eye
        box = self.tab.locator("canvas").first.bounding_box()
        scale = 0.5 * box["height"] / np.tan(0.5 * camera.fov) / (away @ ahead)
        x, y = scale * (away @ right), scale * (away @ np.cross(right, ahead))
        return 0.5 * box["width"] + float(x), 0.5 * box["height"] - float(y)

    def press(self, name: str) -> None:
        """Click a button where it has come to rest: on a busy machine, a folder that opens moves it under the mouse."""
        named = self.tab.get_by_role("button", name=name, exact=True)
        # A label above the picture that presses a button gives it a name of its own.
        button = named.or_(self.tab.locator("button", has_text=re.compile(f"^{re.escape(name)}$"))).first
        button.scroll_into_view_if_needed()
        places = [button.bounding_box()]
        while len(places) < 4 or places[-1] != places[-4]:
            self.tab.wait_for_timeout(100)
            places.append(button.bounding_box())
        button.click()

    def choose(self, handle, option: str) -> None:
        self.tab.locator(f'[id="{handle._impl.uuid}"]').click()
        self.tab.get_by_role("option", name=option, exact=True).click()

    def slide(self, handle, key: str, times: int = 1) -> None:
        thumb = self._thumb(handle)
        for _ in range(times):
            thumb.press(key)

    def reads(self, handle) -> float:
        """The value of a slider in the browser."""
        return float(self._thumb(handle).get_attribute("aria-valuenow"))

    def _thumb(self, handle):
        return self.tab.locator(f'[id="{handle._impl.uuid}"] [role=slider]')


@pytest.fixture(scope="session")
def look(browser, pixels):
    """Opens pages in the browser: `look(url, server)`."""
    opened = []

    def open_page(url: str, server) -> Screen:
        opened.append(Screen(browser, pixels, url, server))
        return opened[-1]

    yield open_page
    for screen in opened:
        screen.close()


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
