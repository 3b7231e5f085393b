"""The page in a browser, with a fake simulation: what is above the picture, keys, themes, phones, values with units."""

import random
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.app.viewer.page.conftest import two_boxes

from supple.app.viewer.app import configure_page
from supple.app.viewer.live_page import LivePage
from supple.app.viewer.protocol.commands import Grab, Pause, Play, ReleaseGrab, Reset, SetParameter, Step
from supple.app.viewer.protocol.snapshots import GrabState, Timing
from supple.app.viewer.server.gate import gate
from supple.app.viewer.server.page.served_page import ServedPage
from supple.results.viser_server import start_server, stop_server

WIDE, PHONE = {"width": 1200, "height": 800}, {"width": 400, "height": 800}


@pytest.fixture(scope="module")
def page(look):
    """A served page with two boxes."""
    fake = two_boxes()
    with gate("127.0.0.1", None, ServedPage("boxes & <more>")):
        server = start_server("127.0.0.1", 0)
    configure_page(server)
    live = LivePage(server, fake, fake.snapshot)
    # Few pixels, because they are drawn in software.
    screen = look(f"http://127.0.0.1:{server.get_port()}/?fixedDpr=0.3", server)
    made = SimpleNamespace(screen=screen, tab=screen.tab, live=live, fake=fake, start=fake.snapshot)

    def received(kind):
        """Wait for a command of this kind."""
        screen.wait(lambda: any(isinstance(each, kind) for each in fake.received), kind.__name__)
        found = next(each for each in fake.received if isinstance(each, kind))
        fake.received.clear()
        return found

    made.received = received
    yield made
    screen.close()
    live.stop()
    stop_server(server)


@pytest.fixture
def fresh(page):
    """The page on a wide screen in the light, with the simulation at its start."""
    page.tab.set_viewport_size(WIDE)
    page.tab.emulate_media(color_scheme="light")
    page.tab.locator("#supple-keys").evaluate_all("all => all.forEach(each => each.remove())")
    page.tab.locator(".mantine-Notification-closeButton").evaluate_all("all => all.forEach(each => each.click())")
    page.fake.snapshot = page.start
    page.fake.received.clear()
    page.screen.wait(lambda: page.tab.locator("#supple-start button").count() == 1, "the start")
    yield page
    assert page.screen.errors == []


def test_viser_s_client_is_changed_in_every_place(fresh):
    assert fresh.tab.evaluate("suppleMissing") == []
    assert fresh.tab.title() == "boxes & <more> · Supple"


def test_a_large_button_starts_the_time(fresh):
    button = fresh.tab.locator("#supple-start button")
    assert button.inner_text() == "▶ Play, then drag the body 0"
    assert button.bounding_box()["height"] > 40
    button.click()
    fresh.received(Play)
    fresh.fake.show(paused=False)
    fresh.screen.wait(lambda: button.count() == 0, "no button while time runs")


def test_keys(fresh):
    keyboard = fresh.tab.keyboard
    fresh.tab.mouse.move(300, 700)
    for key, kind in ((" ", Play), ("ArrowRight", Step), ("r", Reset)):
        keyboard.press(key)
        fresh.received(kind)
    fresh.fake.show(paused=False)
    fresh.screen.wait(lambda: not fresh.live.controller.snapshot.paused, "the running time")
    fresh.screen.tab.get_by_role("button", name="Pause", exact=True).focus()
    keyboard.press(" ")  # once, though the button has the focus
    fresh.received(Pause)
    fresh.tab.wait_for_timeout(300)
    assert fresh.fake.received == []
    slider = fresh.tab.locator("[role=slider]:visible").first
    for use in (fresh.tab.get_by_role("tab", name="Bodies").click, slider.focus):
        use()
        keyboard.press(" ")
        fresh.received(Pause)
    camera = lambda: np.asarray(fresh.screen.client.camera.position)  # noqa: E731
    keyboard.press("4")
    center = fresh.live.stage.model.view.center
    fresh.screen.wait(
        lambda: camera()[1] > 4.0 and np.abs(camera() - center)[[0, 2]].max() < 0.1, "the view from above"
    )
    far = camera()
    keyboard.press("f")
    fresh.screen.wait(lambda: camera()[1] < far[1] - 0.1, "the picture to fit")
    keyboard.press("1")
    fresh.screen.wait(lambda: abs(camera()[0] - center[0]) > 0.5, "the view from the corner")
    keyboard.press("?")
    shown = fresh.tab.locator("#supple-keys")
    shown.wait_for()
    text = shown.inner_text()
    for line in ("Space", "Play or pause", "→", "One frame", "View from: top", "Fit the picture"):
        assert line in text
    keyboard.press("Escape")
    assert shown.count() == 0


def test_values_have_units_and_are_typed_with_them(fresh):
    youngs = fresh.live.panel.bodies.inputs["youngs"]
    box = fresh.tab.locator(f'[id="{youngs.handle._impl.uuid}"] ~ input.supple-value')
    fresh.screen.wait(lambda: box.count() == 1 and box.input_value() == "100 kPa", "the value with its unit")
    row = fresh.tab.locator(f'[id="{youngs.handle._impl.uuid}"]')
    assert ("100 Pa" in row.inner_text(), "1 GPa" in row.inner_text()) == (True, True)
    for typed, pascals, shown in (("30 kPa", 3e4, "30 kPa"), ("2e6", 2e6, "2 MPa")):
        box.fill(typed)
        box.press("Enter")
        assert fresh.received(SetParameter) == SetParameter("youngs", pascals)
        fresh.tab.wait_for_timeout(500)  # the page looks for new values every 80 ms
        fresh.screen.wait(lambda: box.input_value() == shown, shown)  # noqa: B023
        place = np.log10(pascals)
        fresh.screen.wait(lambda: abs(fresh.screen.reads(youngs.handle) - place) < 0.06, "the slider")  # noqa: B023
    box.fill("30 newton")
    box.press("Enter")
    fresh.tab.get_by_text("is no value of Young's modulus; type for example 30 kPa").wait_for()
    fresh.screen.wait(lambda: box.input_value() == "2 MPa", "the value as it was")
    # Nothing is wider than its place.
    clipped = (
        "all => all.filter(each => each.clientWidth && each.scrollWidth > each.clientWidth).map(each => each.value)"
    )
    assert fresh.tab.locator("input.supple-value").evaluate_all(clipped) == []


# Pairs of texts of sliders that touch: of the label, the two ends, and the value. Only what is displayed.
TOUCHING = """sliders => sliders.flatMap(slider => {
  const around = element => {
    if (!element) return [];
    const range = document.createRange();
    range.selectNodeContents(element);
    const box = element.matches("input") ? element.getBoundingClientRect() : range.getBoundingClientRect();
    return box.width ? [{ text: element.textContent || element.value, box }] : [];
  };
  const texts = [
    ...around(document.querySelector(`label[for="${slider.id}"]`)),
    ...[...slider.querySelectorAll(".mantine-Slider-markLabel")].flatMap(around),
    ...around(slider.parentElement.querySelector("input.supple-value")),
  ];
  return texts.flatMap((a, i) => texts.slice(i + 1)
    .filter(b => a.box.left < b.box.right && b.box.left < a.box.right)
    .filter(b => a.box.top < b.box.bottom && b.box.top < a.box.bottom)
    .map(b => `${a.text} | ${b.text}`));
})"""


def test_no_text_of_a_slider_touches_another_one(fresh):
    sliders = fresh.tab.locator(".mantine-Slider-root")
    for name in ("View", "Solver", "Bodies"):
        fresh.screen.show_tab(name)
        fresh.screen.wait(lambda: sliders.count() > 0, "sliders")
        assert sliders.evaluate_all(TOUCHING) == []


def test_every_input_has_a_tooltip(fresh):
    for handle in fresh.screen.server.gui._gui_input_handle_from_uuid.values():
        assert handle.hint or handle.label.startswith("beside "), handle.label


def test_a_drag_draws_one_line_and_a_thin_outline_of_the_held_body_only(fresh):
    screen, mouse = fresh.screen, fresh.tab.mouse
    middle = fresh.start.positions[fresh.start.description.bodies[0].vertices].mean(axis=0)
    where = screen.place(middle + np.array([0.0, 0.2, 0.5]))
    shot = lambda: screen.shot()[120:]  # noqa: E731 - below the energies
    yellow = lambda: int(np.count_nonzero((shot()[..., :2].min(axis=2) > 190) & (shot()[..., 2] < 150)))  # noqa: E731
    orange = lambda: int(  # noqa: E731 - viser's arrow
        np.count_nonzero(np.abs(screen.shot() - [255, 140, 66]).max(axis=2) < 12)
    )
    mouse.move(*where)
    fresh.tab.wait_for_timeout(300)
    assert yellow() < 5  # not outlined under the pointer only
    mouse.down()
    mouse.move(where[0] + 60, where[1] - 60, steps=4)
    grab = fresh.received(Grab)
    assert grab.body == "body 0"
    screen.wait(lambda: yellow() > 30, "the outline")
    area = int(np.count_nonzero(screen.shot().max(axis=2) - screen.shot().min(axis=2) > 60))
    assert yellow() < 0.2 * area
    assert orange() < 5
    fresh.fake.show(grabs=(GrabState(grab.grab, "body 0", tuple(middle), tuple(middle + np.array([0.0, 1.0, 0.0]))),))
    screen.wait(
        lambda: "Paused: the spring pulls when time runs" in fresh.tab.locator("#supple-start").inner_text(),
        "why nothing moves",
    )
    mouse.up()
    fresh.received(ReleaseGrab)
    screen.wait(lambda: yellow() < 5, "no outline")


def test_the_theme_follows_the_system(fresh):
    corner = lambda: fresh.screen.shot()[5:40, 500:700].mean()  # noqa: E731
    assert corner() > 240
    fresh.tab.emulate_media(color_scheme="dark")
    fresh.screen.wait(lambda: corner() < 50, "the dark picture")
    assert fresh.tab.evaluate("document.documentElement.dataset.mantineColorScheme") == "dark"
    fresh.tab.emulate_media(color_scheme="light")
    fresh.screen.wait(lambda: corner() > 240, "the light picture")


def test_a_phone_has_a_drawer_and_buttons_for_time(fresh):
    tab = fresh.tab
    transport = tab.locator("#supple-transport button")
    assert not transport.first.is_visible()
    tab.set_viewport_size(PHONE)
    fresh.screen.wait(lambda: transport.first.is_visible(), "the buttons")
    boxes = [transport.nth(k).bounding_box() for k in range(3)]
    assert all(box["width"] >= 44 and box["height"] >= 44 and box["x"] + box["width"] <= 400 for box in boxes)
    for k, kind in enumerate((Play, Step, Reset)):
        transport.nth(k).click()
        fresh.received(kind)
    play = tab.get_by_role("button", name="Play", exact=True).last
    connected = tab.get_by_text("Connected")
    drawer = lambda: connected.bounding_box()["y"]  # noqa: E731
    fresh.screen.wait(lambda: drawer() > 730, "the closed drawer")
    connected.click()
    fresh.screen.wait(lambda: drawer() < 500 and play.is_visible(), "the open drawer")
    assert tab.locator(".mantine-Slider-root").evaluate_all(TOUCHING) == []
    connected.click()
    fresh.screen.wait(lambda: drawer() > 730, "the closed drawer")


def test_notifications_do_not_cover_the_state_and_the_warning(fresh):
    tab, fake = fresh.tab, fresh.fake
    measures = replace(fresh.start.measures, iterations=20)
    fake.show(paused=False, timing=Timing(40.0, 25.0, 0.42, keeps_up=False), measures=measures)
    fresh.screen.wait(lambda: tab.locator("#supple-warning button").count() == 1, "the warning")
    fresh.screen.client.add_notification("viser", "as where there is no graphics card", auto_close_seconds=None)
    notification = tab.locator(".mantine-Notification-root").last
    for size in (WIDE, PHONE):
        tab.set_viewport_size(size)
        boxes = [tab.locator(name).bounding_box() for name in ("#supple-state", "#supple-warning")]
        fresh.screen.wait(lambda: notification.bounding_box()["width"] > 0.5 * PHONE["width"], "the notification")
        assert all(notification.bounding_box()["y"] >= box["y"] + box["height"] for box in boxes)


# Texts above the picture with less contrast than 4.5 (WCAG 2.1, 1.4.3) where the picture behind is black or white.
PALE = """parts => parts.flatMap(part => [part, ...part.querySelectorAll("*")].flatMap(element => {
  const own = [...element.childNodes].filter(node => node.nodeType === Node.TEXT_NODE).map(node => node.data).join("");
  const colors = text => text.match(/[\\d.]+/g).map(Number);
  const linear = c => c <= 10.31 ? c / 3294.6 : ((c / 255 + 0.055) / 1.055) ** 2.4;
  const luminance = ([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
  let ground = element;
  const under = () => getComputedStyle(ground).backgroundColor;
  while (ground !== part && under() === "rgba(0, 0, 0, 0)") ground = ground.parentElement;
  const [r, g, b, alpha = 1] = colors(under());
  const text = luminance(colors(getComputedStyle(element).color));
  return !own.trim() ? [] : [0, 255].filter(behind => {
    const back = luminance([r, g, b].map(c => alpha * c + (1 - alpha) * behind));
    return (Math.max(text, back) + 0.05) / (Math.min(text, back) + 0.05) < 4.5;
  }).map(() => own);
}))"""


def test_texts_above_the_picture_are_readable_on_any_picture(fresh):
    tab, views = fresh.tab, fresh.live.panel.views
    slow = Timing(40.0, 25.0, 0.42, keeps_up=False)
    fresh.fake.show(paused=False, timing=slow, tet_values=np.full(96, 12_300.0), tet_quantity="von_mises")
    views.color_by.value = "von Mises stress"
    views.apply()
    tab.keyboard.press("?")
    for name in ("state", "warning", "legend", "keys"):
        tab.locator(f"#supple-{name}").wait_for()
    for theme in ("light", "dark"):
        tab.emulate_media(color_scheme=theme)
        tab.wait_for_function(f"document.documentElement.dataset.mantineColorScheme === '{theme}'")
        assert tab.locator("#supple-layer > *").evaluate_all(PALE) == []
    views.color_by.value = "body"
    views.apply()


def test_the_bodies_stay_in_the_picture_of_a_window_that_becomes_a_phone(fresh):
    tab, screen = fresh.tab, fresh.screen
    points = fresh.start.positions[np.linspace(0, len(fresh.start.positions) - 1, 40).astype(int)]

    def shares():
        box = tab.locator("canvas").first.bounding_box()
        return max(abs(screen.place(point)[0] / box["width"] - 0.5) for point in points)

    tab.keyboard.press("1")
    tab.keyboard.press("f")
    screen.wait(lambda: shares() < 0.5 and screen.client.camera.aspect > 1.0, "the bodies in the wide window")
    tab.wait_for_timeout(500)
    away = lambda: float(np.linalg.norm(screen.client.camera.position - screen.client.camera.look_at))  # noqa: E731
    before = away()
    tab.set_viewport_size(PHONE)
    screen.wait(lambda: screen.client.camera.aspect < 1.0 and away() > 1.3 * before, "a camera farther away")
    screen.wait(lambda: shares() < 0.5, "all bodies in the narrow picture")
    tab.set_viewport_size(WIDE)
    screen.wait(lambda: abs(away() - before) < 0.01 * before, "the camera where it was")
    reset = "suppleViewer.mutable.current.resetCameraPose(false), suppleViewer.mutable.current.cameraControl.distance"
    wide = tab.evaluate(reset)  # viser does so for a new visitor, too
    tab.set_viewport_size(PHONE)
    screen.wait(lambda: abs(tab.evaluate(reset) - 1.93 * wide) < 0.01 * wide, "the camera of a phone")


def test_the_legend_in_the_picture_and_the_value_at_the_pointer(fresh):
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
    value = tab.locator("#supple-value")
    screen.wait(lambda: value.count() == 1 and value.inner_text() == "12.3 kPa · body 0", "the value")
    place = value.bounding_box()
    assert (abs(place["x"] - x) < 30, abs(place["y"] - y) < 30) == (True, True)
    tab.mouse.move(5, 5)
    screen.wait(lambda: value.count() == 0, "no value beside the bodies")
    views.color_by.value = "body"
    views.apply()
    screen.wait(lambda: legend.count() == 0, "no legend")


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


LONG = [
    pytest.param(size, scheme, 250, marks=pytest.mark.slow) for size in (WIDE, PHONE) for scheme in ("light", "dark")
]


@pytest.mark.parametrize(("size", "scheme", "count"), [(PHONE, "dark", 12), *LONG])
def test_random_events(fresh, size, scheme, count):
    """Keys, moves, clicks and drags anywhere, while the simulation changes: no exception, and the page goes on.

    Without a browser, tests/app/viewer/page/controls/test_random_events.py sends a thousand.
    """
    tab, rng = fresh.tab, random.Random(f"{size} {scheme}")
    tab.set_viewport_size(size)
    tab.emulate_media(color_scheme=scheme)
    keys = (" ", "ArrowRight", "r", "f", "1", "2", "3", "4", "5", "?", "Escape", "Tab", "Enter", "w", "ArrowUp", "7")
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
    fresh.screen.wait(lambda: fresh.live.controller.snapshot.time == 77.0, "the page to go on")
    assert fresh.screen.errors == []
