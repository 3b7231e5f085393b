"""The live page in a browser with a real simulation: both state and picture are checked."""

import logging
import threading
from types import SimpleNamespace

import numpy as np
import pytest
from tests.app.viewer.page.conftest import TOKEN, served_page

import supple as sp
from supple.app.viewer.app import opened_page, serve
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
    with opened_page("ball", 0) as page, page.simulating(source):
        screen = look(page.url)
        made = SimpleNamespace(screen=screen, tab=screen.tab, content=page.content)
        made.snapshot = lambda: page.content.simulation.latest()
        made.middle = lambda: made.snapshot().positions.mean(axis=0)
        made.red = lambda: spot(screen.shot(), "red")
        made.drawn = lambda holds, what: screen.wait(lambda: holds(made.red()), what)
        yield made
        screen.tab.close()


@pytest.fixture
def still(live):
    """The page at the start of time, paused."""
    if not live.snapshot().paused:
        live.tab.locator("#play").click()
        live.screen.wait(lambda: live.snapshot().paused, "the pause")
    live.tab.locator("#reset").click()
    live.screen.wait(lambda: live.snapshot().frame == 0 and abs(live.middle()[1] - START) < 1e-3, "the start")
    x, y = live.screen.place(live.middle())
    live.drawn(lambda red: red[0] > 300 and np.abs(red[1] - [x, y - 30]).max() < 25, "the ball at its start")
    return live


@pytest.fixture
def resting(still):
    """The ball at rest on the floor, while time runs."""
    still.tab.locator("#play").click()
    speed = lambda: np.sqrt(2.0 * still.snapshot().measures.kinetic_energy / MASS)  # noqa: E731
    still.screen.wait(
        lambda: still.snapshot().time > 0.6 and still.middle()[1] < 0.32 and speed() < 0.03, "the ball on the floor"
    )
    return still


def test_play_pause_step_and_reset(still):
    screen, before = still.screen, still.red()[1]
    still.tab.locator("#play").click()
    screen.wait(lambda: still.middle()[1] < 0.35, "the fall")
    still.drawn(lambda red: red[1][1] > before[1] + 8, "the fall in the picture")
    still.tab.keyboard.press(" ")
    screen.wait(lambda: still.snapshot().paused, "the pause")
    frame = still.snapshot().frame
    still.tab.wait_for_timeout(200)
    assert still.snapshot().frame == frame
    still.tab.keyboard.press("n")
    screen.wait(lambda: still.snapshot().frame == frame + 1, "one frame")
    still.tab.keyboard.press("r")
    screen.wait(lambda: still.snapshot().frame == 0, "the start")
    still.drawn(lambda red: np.abs(red[1] - before).max() < 4, "the picture of the start")
    assert screen.errors == []


def test_nothing_is_drawn_while_time_stands(still):
    still.tab.wait_for_timeout(1500)  # the better picture
    before = still.tab.evaluate("supplePage.pictures")
    still.tab.wait_for_timeout(1000)
    assert still.tab.evaluate("supplePage.pictures") == before


def test_a_body_follows_the_mouse_until_it_is_released(resting):
    screen, mouse = resting.screen, resting.tab.mouse
    low = resting.red()[1]
    turn = "supplePage.view.camera.quaternion.toArray()"
    camera = resting.tab.evaluate(turn)
    grip, up = resting.middle() + np.array([0.0, 0.1, 0.0]), np.array([0.0, 0.2, 0.0])
    mouse.move(*screen.place(grip))
    mouse.down()
    mouse.move(*screen.place(grip + up), steps=3)
    screen.wait(lambda: resting.snapshot().grabs, "the spring")
    mouse.move(*screen.place(grip + 3.0 * up), steps=3)
    screen.wait(lambda: resting.middle()[1] > 0.45, "the ball in the air")
    resting.drawn(lambda red: red[1][1] < low[1] - 12, "the ball in the air in the picture")
    mouse.up()
    screen.wait(lambda: not resting.snapshot().grabs, "the end of the spring")
    screen.wait(lambda: resting.middle()[1] < 0.35, "the fall")
    np.testing.assert_allclose(resting.tab.evaluate(turn), camera, atol=1e-9)
    resting.tab.reload()  # the camera has shown where the ball was
    screen.holds("globalThis.supplePage?.pictures > 0")


def test_a_drag_beside_a_body_turns_the_camera(still):
    camera = still.tab.evaluate("supplePage.view.camera.position.toArray()")
    mouse = still.tab.mouse
    mouse.move(40, 80)
    mouse.down()
    mouse.move(90, 90, steps=3)
    mouse.up()
    assert still.tab.evaluate("supplePage.view.camera.position.toArray()") != camera
    assert not still.snapshot().grabs
    still.tab.evaluate("supplePage.view.fit()")


def test_a_click_pins_a_vertex_and_another_one_unpins_it(still):
    top = still.snapshot().positions[np.argmax(still.snapshot().positions[:, 1])]
    place = still.screen.place(top - [0.0, 0.05, 0.0])
    still.tab.mouse.click(*place)
    still.screen.wait(lambda: len(still.snapshot().pinned) == 1, "the pin")
    still.screen.wait(lambda: still.tab.evaluate("suppleLive.marks('pins').length") == 1, "the pin on the page")
    still.tab.mouse.click(*place)
    still.screen.wait(lambda: len(still.snapshot().pinned) == 0, "no pin")


def number(live, name):
    return live.tab.locator(f"[data-name='{name}'] input").first


def test_parameters_have_units_and_reach_the_simulation(still):
    still.tab.evaluate("supplePage.gui.foldersRecursive().forEach((folder) => folder.open())")
    assert float(number(still, "youngs").input_value()) == 100.0  # kPa
    number(still, "youngs").fill("40")
    number(still, "youngs").press("Enter")
    values = lambda: still.snapshot().description.bodies[0].values  # noqa: E731
    still.screen.wait(lambda: values()["youngs"] == 4e4, "the softer ball")
    number(still, "youngs").fill("1e99")
    number(still, "youngs").press("Enter")
    notice = still.tab.locator("#notice")
    still.screen.wait(notice.is_visible, "the rejection")
    assert notice.inner_text().startswith("Rejected: youngs is 1e+102; it must be from 100 to 1e+11")
    still.screen.wait(lambda: float(number(still, "youngs").input_value()) == 40.0, "the value of the simulation")
    still.tab.locator("[data-name='solver'] select").select_option("implicit")
    still.screen.wait(lambda: still.snapshot().description.solver == "implicit", "the other solver")
    still.tab.locator("[data-name='solver'] select").select_option("xpbd")
    still.screen.wait(lambda: still.snapshot().description.solver == "xpbd", "the first solver")


def test_a_field_is_asked_for_and_has_a_legend(still):
    still.tab.locator("[data-name='field'] select").select_option("volume ratio J")
    still.screen.wait(lambda: still.snapshot().tet_quantity == "J", "the field")
    still.screen.holds("suppleLive.latest.field")
    still.screen.wait(lambda: still.tab.locator("#legend .low").inner_text() == "0.98", "the legend")
    still.tab.locator("[data-name='field'] select").select_option("body")
    still.screen.wait(lambda: still.snapshot().tet_quantity is None, "no field")


def test_the_camera_shows_where_bodies_go_until_somebody_moves_it(still):
    tab, at = still.tab, "supplePage.view.camera.position.toArray()"
    before = np.array(tab.evaluate(at))
    include = "(by) => supplePage.view.include(supplePage.stage.bodies.map((x, k) => x + (k % 3 ? 0 : by)))"
    tab.evaluate(include, 1.0)
    assert np.linalg.norm(np.array(tab.evaluate(at))) > np.linalg.norm(before) + 0.1
    x, y = still.screen.place(still.middle() + np.array([1.0, 0.0, 0.0]))
    assert 0 < x < 720 - 250
    assert 0 < y < 420
    tab.evaluate("supplePage.view.fitted = null")
    there = tab.evaluate(at)
    tab.evaluate(include, 3.0)
    assert tab.evaluate(at) == there
    tab.reload()
    still.screen.holds("globalThis.supplePage?.pictures > 0")


def test_plots_grow_with_time_and_begin_anew(still):
    tab, times = still.tab, "supplePage.plots.times"
    tab.locator("[data-name='plot'] select").select_option("energy [J]")
    tab.locator("#play").click()
    still.screen.holds(f"{times}.length > 5 && {times}.at(-1) > 0.3")
    assert "kinetic" in tab.locator("#plot").inner_text()
    kinetic = np.array(tab.evaluate("supplePage.plots.plot.data[1]"))
    assert 0.0 < kinetic.max() < 9.81 * MASS * 0.25  # pictures are rare where the machine is busy
    tab.locator("#play").click()
    tab.locator("#reset").click()
    still.screen.holds(f"{times}.length === 1 && {times}[0] === 0")
    tab.locator("[data-name='plot'] select").select_option("none")
    assert not tab.locator("#plot").is_visible()


def test_a_sleeping_tab_draws_nothing_and_continues_when_it_wakes(still):
    """A browser calls no frames of a hidden tab; it has no setting for this, so that the page is asked to."""
    tab = still.tab
    tab.evaluate("""() => {
      globalThis.awake = requestAnimationFrame;
      globalThis.slept = [];
      globalThis.requestAnimationFrame = (act) => slept.push(act);
    }""")
    tab.locator("#play").click()
    still.screen.wait(lambda: still.snapshot().time > 1.5, "time that passes without the tab")
    tab.wait_for_timeout(200)
    before = tab.evaluate("[supplePage.pictures, suppleLive.latest.frame, supplePage.pace.level]")
    tab.wait_for_timeout(1000)
    assert tab.evaluate("supplePage.pictures") == before[0]
    tab.evaluate("""() => {
      globalThis.requestAnimationFrame = awake;
      document.dispatchEvent(new Event("visibilitychange"));
      slept.forEach((act) => requestAnimationFrame(act));
    }""")
    still.screen.holds(f"supplePage.pictures > {before[0] + 3} && suppleLive.latest.frame > {before[1] + 60}")
    assert tab.evaluate("supplePage.pace.level") <= before[2]  # the time asleep does not count as slow


def test_two_tabs_show_the_same_and_a_reload_continues(still, look):
    other = look(still.tab.url)
    still.tab.locator("#play").click()
    for screen in (still.screen, other):
        screen.holds("suppleLive.latest.frame > 20 && !suppleLive.latest.paused")
    other.tab.reload()
    other.holds("globalThis.suppleLive?.latest?.frame > 40")
    assert other.errors == []
    other.tab.close()


def test_the_browser_reported_no_errors(live):
    assert live.screen.errors == []
    assert np.isfinite(live.snapshot().positions).all()


def test_the_page_says_that_its_server_has_ended_and_reconnects(fake, look, spot):
    with served_page(fake) as page:
        port = page.port
        screen = look(f"http://127.0.0.1:{port}/?token={TOKEN}")
        screen.wait(lambda: spot(screen.shot(), "red")[0] > 100, "the picture")
        assert not screen.tab.locator("#banner").is_visible()
    banner = screen.tab.locator("#banner")
    screen.wait(banner.is_visible, "word that the server is gone")
    said = "The server has ended. Start it again in a terminal: supple view boxes.yaml"
    assert banner.locator("span").inner_text() == said
    before = spot(screen.shot(), "red")
    assert before[0] > 100  # the last picture stays
    fake.show(positions=fake.snapshot.positions[::-1].copy(), time=1.0)  # the bodies exchange their positions
    with served_page(fake, port):
        screen.wait(lambda: not banner.is_visible(), "the connection")
        screen.wait(lambda: spot(screen.shot(), "red")[1][0] > before[1][0] + 50, "the new state in the picture")
        fake.error = "out of <b>memory</b>"
        screen.wait(banner.is_visible, "word that the simulation has ended")
        assert banner.locator("span").inner_text() == "The simulation has ended: out of <b>memory</b>"
        banner.locator("button").click()
        screen.wait(lambda: fake.starts == 1, "the restart")
        screen.wait(lambda: not banner.is_visible(), "no word of an end")
        screen.tab.close()
    assert [error for error in screen.errors if "WebSocket" not in error] == []


def test_the_page_tells_what_it_waits_for_and_errors_of_the_input(look, capsys):
    end, raised = threading.Event(), []

    def read():
        logging.getLogger("supple.mesh").warning("filling 12 triangles")
        end.wait(60.0)
        raise sp.SceneError("scene.yaml:3: youngs is <b>-1</b>")

    def run():
        try:
            serve(read, "scene", 0, open_browser=False, reload=True)
        except sp.SceneError as error:
            raised.append(str(error))

    shell = threading.Thread(target=run)
    shell.start()
    out = ""
    while "http" not in out:
        out += capsys.readouterr().out
        shell.join(0.02)
    screen = look(out.split()[0], "!document.querySelector('#banner').hidden")
    said = screen.tab.locator("#banner span").inner_text
    screen.wait(lambda: said().endswith("s: reading and meshing: filling 12 triangles"), "what is waited for")
    end.set()
    screen.wait(lambda: said().startswith("Not shown: scene.yaml:3: youngs is <b>-1</b>. Start it again"), "the error")
    shell.join()
    assert raised == ["scene.yaml:3: youngs is <b>-1</b>"]
    screen.tab.wait_for_timeout(1500)  # attempts to connect again
    assert said().startswith("Not shown: scene.yaml:3")
    screen.tab.close()
