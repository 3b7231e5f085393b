"""The page in a browser, with a fake simulation: what is above the picture, keys, themes, values with units."""

import random
from contextlib import ExitStack
from types import SimpleNamespace

import numpy as np
import pytest
from tests.app.viewer.page.conftest import TOKEN, two_boxes

from supple.app.viewer.app import configure_page
from supple.app.viewer.live_page import LivePage
from supple.app.viewer.protocol.commands import Grab, Pause, Play, ReleaseGrab, Reset, SetParameter, Step
from supple.app.viewer.protocol.snapshots import GrabState
from supple.results.view.server import gated_server

WIDE = {"width": 1200, "height": 800}


@pytest.fixture(scope="module")
def page(look):
    """A served page with two boxes."""
    fake = two_boxes()
    ends = ExitStack()
    server = ends.enter_context(gated_server(TOKEN))
    configure_page(server, "boxes & <more>")
    live = LivePage(server, fake, fake.snapshot)
    # Few pixels, because they are drawn in software.
    screen = look(f"http://127.0.0.1:{server.get_port()}/?token={TOKEN}&fixedDpr=0.3", server)
    made = SimpleNamespace(screen=screen, tab=screen.tab, live=live, fake=fake, start=fake.snapshot)

    def received(kind):
        """Wait for a command of this kind."""
        screen.wait(lambda: any(isinstance(item, kind) for item in fake.received), kind.__name__)
        found = next(item for item in fake.received if isinstance(item, kind))
        fake.received.clear()
        return found

    made.received = received
    yield made
    screen.close()
    live.stop()
    ends.close()


@pytest.fixture
def fresh(page):
    """The page on a wide screen in the light, with the simulation at its start."""
    page.tab.set_viewport_size(WIDE)
    page.tab.locator(".mantine-Notification-closeButton").evaluate_all("all => all.forEach(each => each.click())")
    page.fake.snapshot = page.start
    page.fake.received.clear()
    page.screen.wait(lambda: page.tab.locator("#supple-start label").count() == 1, "the start")
    yield page
    assert page.screen.errors == []


def test_a_large_button_starts_the_time(fresh):
    button = fresh.tab.locator("#supple-start label")
    assert button.inner_text() == "▶ Play, then drag the body 0"
    assert button.bounding_box()["height"] > 40
    button.click()
    fresh.received(Play)
    fresh.fake.show(paused=False)
    fresh.screen.wait(lambda: button.count() == 0, "no button while time runs")


def test_keys(fresh):
    keyboard = fresh.tab.keyboard
    fresh.tab.mouse.move(300, 700)
    for key, kind in ((" ", Play), ("n", Step), ("r", Reset)):
        keyboard.press(key)
        fresh.received(kind)
    fresh.fake.show(paused=False)
    fresh.screen.wait(lambda: not fresh.live.controller.snapshot.paused, "the running time")
    fresh.screen.tab.get_by_role("button", name="Pause", exact=True).focus()
    keyboard.press(" ")  # once, though the button has the focus
    fresh.received(Pause)
    fresh.tab.wait_for_timeout(300)
    assert fresh.fake.received == []
    camera = lambda: np.asarray(fresh.screen.client.camera.position)  # noqa: E731
    keyboard.press("4")
    center = fresh.live.stage.model.view.center
    fresh.screen.wait(
        lambda: camera()[1] > 4.0 and np.abs(camera() - center)[[0, 2]].max() < 0.1, "the view from above"
    )
    near = camera()
    fresh.screen.client.camera.position = tuple(near + np.array([0.0, 3.0, 0.0]))
    fresh.screen.wait(lambda: camera()[1] > near[1] + 2.9, "the camera to rise")
    keyboard.press("f")
    fresh.screen.wait(lambda: camera()[1] < near[1] + 1.0, "the picture to fit")
    keyboard.press("1")
    fresh.screen.wait(lambda: abs(camera()[0] - center[0]) > 0.5, "the view from the corner")
    keyboard.press("Control+k")  # viser's list of all of them
    for line in ("Play or pause", "One frame", "View from: top", "Fit the picture"):
        fresh.tab.get_by_text(line).first.wait_for()
    keyboard.press("Escape")


def test_numbers_have_their_unit_in_the_label_and_count_when_they_are_typed(fresh):
    youngs = fresh.live.panel.bodies.inputs["youngs"].handle
    box = fresh.tab.locator(f'input[id="{youngs._impl.uuid}"]')
    fresh.tab.get_by_text("Young's modulus [kPa]").first.wait_for()
    fresh.screen.wait(lambda: box.input_value() == "100", "the value")
    for typed, pascals in (("30", 3e4), ("2000.5", 2000.5e3)):
        box.fill("")
        box.press_sequentially(typed, delay=20)
        assert fresh.received(SetParameter) == SetParameter("youngs", pascals)
    box.fill("")
    box.press_sequentially("0.01", delay=20)
    fresh.tab.get_by_text("it must be from 0.1 to 1e+08").wait_for()
    fresh.screen.wait(lambda: box.input_value() == "2000.5", "the value as it was")


def test_a_drag_pulls_and_a_paused_page_tells_why_nothing_moves(fresh):
    screen, mouse = fresh.screen, fresh.tab.mouse
    middle = fresh.start.positions[fresh.start.description.bodies[0].vertices].mean(axis=0)
    where = screen.place(middle + np.array([0.0, 0.2, 0.5]))
    mouse.move(*where)
    mouse.down()
    mouse.move(where[0] + 60, where[1] - 60, steps=4)
    grab = fresh.received(Grab)
    assert grab.body == "body 0"
    fresh.fake.show(grabs=(GrabState(grab.grab, "body 0", tuple(middle), tuple(middle + np.array([0.0, 1.0, 0.0]))),))
    screen.wait(
        lambda: "Paused: the spring pulls when time runs" in fresh.tab.locator("#supple-start").inner_text(),
        "why nothing moves",
    )
    mouse.up()
    fresh.received(ReleaseGrab)


def test_the_legend_in_the_picture_and_the_value_at_a_place(fresh):
    tab, screen, views = fresh.tab, fresh.screen, fresh.live.panel.views
    body = fresh.start.description.bodies[0]
    fresh.fake.show(tet_values=np.full(96, 12_300.0), tet_quantity="von_mises")
    views.color_by.value = "von Mises stress"
    views.apply()
    legend = tab.locator("#supple-legend")
    screen.wait(lambda: legend.count() == 1 and "20 kPa" in legend.inner_text(), "the legend")
    box = legend.bounding_box()
    assert (box["x"] < 40, box["y"] + box["height"] > 750) == (True, True)
    bar = legend.locator(".bar").bounding_box()
    pixels = screen.shot()[int(bar["y"] + 5), int(bar["x"]) + 4 : int(bar["x"] + bar["width"]) - 4]
    np.testing.assert_allclose(pixels[0], (68, 1, 84), atol=12)  # viridis, from dark
    np.testing.assert_allclose(pixels[-1], (253, 231, 37), atol=12)  # to bright
    x, y = screen.place(fresh.start.positions[body.vertices].mean(axis=0))
    tab.mouse.move(x, y)
    tab.keyboard.down("Shift")
    tab.mouse.click(x, y)
    tab.keyboard.up("Shift")
    probe = views.probe
    screen.wait(lambda: probe._label and probe._label.text == "12.3 kPa · body 0", "the value")
    place = screen.place(probe._label.position)
    assert (abs(place[0] - x) < 120, abs(place[1] - y) < 120) == (True, True)
    views.color_by.value = "body"
    views.apply()
    screen.wait(lambda: legend.count() == 0 and probe._label is None, "no legend")


def test_a_cut_has_a_plane_section_in_the_picture(fresh):
    """Seen along the cut axis, the section fills the outline of the box with one color."""
    tab, screen, views = fresh.tab, fresh.screen, fresh.live.panel.views
    views.surface.value, views.cut_axis.value, views.cut_place.value = "cut", "z", 0.4
    views.apply()
    tab.keyboard.press("2")
    look = lambda: np.asarray(screen.client.camera.look_at) - np.asarray(screen.client.camera.position)  # noqa: E731
    screen.wait(lambda: abs(look()[2]) > 0.9 * np.linalg.norm(look()), "the view along the axis")
    if look()[2] > 0.0:
        tab.keyboard.press("5")
        screen.wait(lambda: look()[2] < 0.0, "the view from the other side")
    body = fresh.start.description.bodies[0]
    x = fresh.start.positions[body.vertices]
    middle = 0.5 * (x.min(axis=0) + x.max(axis=0))
    middle[2] = x[:, 2].min() + 0.4 * np.ptp(x[:, 2])
    corners = [screen.place(middle + np.array([a, b, 0.0])) for a in (-0.42, 0.42) for b in (0.05, 0.42)]
    (left, top), (right, bottom) = np.min(corners, axis=0), np.max(corners, axis=0)

    def section():
        return screen.shot()[int(top) : int(bottom), int(left) : int(right)].reshape(-1, 3)

    red = np.array([230, 92, 60])
    screen.wait(lambda: np.ptp(section(), axis=0).max() < 30, "one flat color")
    assert section().mean(axis=0) @ red / np.linalg.norm(section().mean(axis=0)) / np.linalg.norm(red) > 0.95
    views.surface.value = "skin"
    views.apply()
    tab.keyboard.press("1")


@pytest.mark.parametrize("count", [12, pytest.param(250, marks=pytest.mark.slow)])
def test_random_events(fresh, count):
    """Keys, moves, clicks and drags anywhere, while the simulation changes: no exception, and the page continues.

    Without a browser, tests/app/viewer/page/controls/test_random_events.py sends a thousand.
    """
    tab, rng, size = fresh.tab, random.Random(f"{WIDE}"), WIDE
    keys = (" ", "n", "r", "f", "1", "2", "3", "4", "5", "?", "Escape", "Tab", "Enter", "w", "ArrowUp", "7")
    for k in range(count):
        x, y = rng.uniform(0, size["width"]), rng.uniform(0, size["height"])
        what = rng.random()
        if what < 0.35:
            tab.keyboard.press(rng.choice(keys))
        elif what < 0.6:
            tab.mouse.move(x, y)
        elif what < 0.7:
            tab.mouse.click(x, y)
        elif what < 0.8:
            tab.mouse.down() if rng.random() < 0.5 else tab.mouse.up()
        else:
            tab.mouse.wheel(0.0, rng.choice((-120.0, 120.0)))
        if k % 6 == 0:
            fresh.fake.show(time=0.01 * k, paused=bool(k % 2))
    tab.mouse.up()
    fresh.fake.show(time=77.0)
    fresh.screen.wait(lambda: fresh.live.controller.snapshot.time == 77.0, "the page to continue")
    assert fresh.screen.errors == []
