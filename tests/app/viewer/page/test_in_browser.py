"""The live page in a browser with a real simulation: both state and picture are checked."""

from types import SimpleNamespace

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.app import opened_page
from supple.app.viewer.protocol.live_source import LiveSource

RADIUS, START = 0.3, 0.5
MASS = 1000.0 * 4.0 / 3.0 * np.pi * RADIUS**3


@pytest.fixture(scope="module")
def live(look, spot):
    """A page with a soft ball above a floor."""
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0, damping=0.02)
    ball = sp.Body("ball", sp.shapes.sphere(radius=RADIUS, edge_length=0.2), rubber, position=(0.0, START, 0.0))
    scene = sp.Scene([ball], obstacles=[sp.HalfSpace(friction=0.5)])
    source = LiveSource("ball", scene, sp.XPBD(substeps=8), 1 / 60)
    with opened_page(source, 0) as page:
        screen = look(page.url + "&fixedDpr=0.5", page.server)  # few pixels: they are drawn in software
        controller = page.content.controller
        made = SimpleNamespace(screen=screen, page=page.content, panel=page.content.panel)
        made.snapshot = lambda: controller.snapshot
        made.middle = lambda: controller.snapshot.positions.mean(axis=0)
        made.height = lambda: float(np.ptp(controller.snapshot.positions[:, 1]))
        made.red = lambda: spot(screen.shot(), "red")
        made.seen = lambda: made.red()[1]

        def drawn(holds, what):
            """Wait for the picture, which is later than the state."""
            return screen.wait(lambda: holds(made.red()), what)

        made.drawn = drawn
        yield made
        screen.close()


@pytest.fixture
def still(live):
    """The page at the start of time, paused."""
    if not live.snapshot().paused:
        live.screen.press("Pause")
        live.screen.wait(lambda: live.snapshot().paused, "the pause")
    live.screen.press("reset")
    live.screen.wait(lambda: live.snapshot().frame == 0 and abs(live.middle()[1] - START) < 1e-3, "the start")
    where = live.screen.place(live.middle())
    live.drawn(lambda red: red[0] > 300 and np.abs(red[1] - where).max() < 25, "the ball at its start")
    return live


@pytest.fixture
def resting(still):
    """The ball at rest on the floor, while time runs."""
    still.screen.press("Play")
    speed = lambda: np.sqrt(2.0 * still.snapshot().measures.kinetic_energy / MASS)  # noqa: E731
    still.screen.wait(
        lambda: still.snapshot().time > 0.6 and still.middle()[1] < 0.32 and speed() < 0.03, "the ball on the floor"
    )
    still.drawn(lambda red: abs(red[1][1] - still.screen.place(still.middle())[1]) < 25, "the ball on the floor")
    return still


def test_play_pause_step_and_reset(still):
    screen, before = still.screen, still.seen()
    screen.press("Play")
    screen.wait(lambda: still.middle()[1] < 0.35, "the fall")
    still.drawn(lambda red: red[1][1] > before[1] + 8, "the fall in the picture")
    screen.press("Pause")
    screen.wait(lambda: still.snapshot().paused, "the pause")
    frame = still.snapshot().frame
    screen.tab.wait_for_timeout(200)
    assert still.snapshot().frame == frame
    low = still.seen()
    screen.press("step")
    screen.wait(lambda: still.snapshot().frame == frame + 1, "one frame")
    screen.press("reset")
    screen.wait(lambda: still.snapshot().frame == 0, "the start")
    assert still.middle()[1] == pytest.approx(START, abs=1e-3)
    still.drawn(lambda red: np.abs(red[1] - before).max() < 4, "the picture of the start")
    assert low[1] > before[1] + 8
    assert screen.errors == []


def test_a_body_follows_the_mouse_until_it_is_released(resting):
    screen, mouse = resting.screen, resting.screen.tab.mouse
    low = resting.seen()
    grip, up = resting.middle() + np.array([0.0, 0.1, 0.0]), np.array([0.0, 0.2, 0.0])
    mouse.move(*screen.place(grip))
    mouse.down()
    mouse.move(*screen.place(grip + up), steps=3)
    screen.wait(lambda: resting.snapshot().grabs, "the spring")
    mouse.move(*screen.place(grip + 3.0 * up), steps=3)
    screen.wait(lambda: resting.middle()[1] > 0.45, "the ball in the air")
    resting.drawn(lambda red: red[1][1] < low[1] - 12, "the ball in the air in the picture")
    length = screen.tab.get_by_text(" cm").or_(screen.tab.get_by_text(" mm"))
    screen.wait(lambda: length.count() >= 1, "how long the spring is")
    mouse.up()
    screen.wait(lambda: not resting.snapshot().grabs, "the end of the spring")
    screen.wait(lambda: resting.middle()[1] < 0.35, "the fall")
    where = lambda: np.array(screen.place(resting.middle()))  # noqa: E731 - thrown, it may have rolled
    resting.drawn(lambda red: np.abs(red[1] - where()).max() < 25, "the fall in the picture")


@pytest.mark.slow
def test_a_click_pins_a_vertex_and_another_one_unpins_it(resting):
    screen, tab = resting.screen, resting.screen.tab
    top = resting.snapshot().positions[np.argmax(resting.snapshot().positions[:, 1])]
    x, y = screen.place(top - [0.0, 0.05, 0.0])

    def dark() -> int:
        shot = screen.shot()[int(y) - 30 : int(y) + 30, int(x) - 40 : int(x) + 40]
        return int((shot.max(axis=2) < 60).sum())

    screen.wait(lambda: dark() < 5, "a ball without a pin in the picture")
    tab.mouse.click(x, y)
    screen.wait(lambda: len(resting.snapshot().pinned) == 1, "the pin")
    screen.wait(lambda: dark() > 10, "the pin in the picture")
    tab.wait_for_timeout(500)  # two clicks within a shorter time are one double click
    tab.mouse.click(x, y)
    screen.wait(lambda: len(resting.snapshot().pinned) == 0, "no pin")
    screen.wait(lambda: dark() < 5, "no pin in the picture")


def test_a_body_is_added_and_removed(still, spot):
    screen, bodies = still.screen, still.panel.bodies
    blue = lambda: spot(screen.shot(), "blue")[0]  # noqa: E731
    assert blue() < 20
    screen.tab.get_by_text("Add a body").click()
    screen.press("Add")
    screen.wait(lambda: len(still.snapshot().description.bodies) == 2, "a second body")
    screen.wait(lambda: blue() > 60, "the second body in the picture")
    name = still.snapshot().description.bodies[1].name
    screen.wait(lambda: name in bodies.which.options, "its name")
    screen.choose(bodies.which, name)
    screen.press("remove")
    screen.wait(lambda: len(still.snapshot().description.bodies) == 1, "no second body")
    screen.wait(lambda: blue() < 20, "no second body in the picture")
    screen.tab.get_by_text("Add a body").click()


def test_the_browser_reported_no_errors(live):
    assert live.screen.errors == []
    assert np.isfinite(live.snapshot().positions).all()
