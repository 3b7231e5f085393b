"""The page of a recording in a browser that draws in software."""

import numpy as np
import pytest

import supple as sp
from supple.results.page.page import write_page
from supple.results.recording.reader import read_recording
from supple.results.view.from_recording import model_of_recording, render_frame_of
from supple.results.view.surfaces import body_surface

HOSTILE = "</script><img src=x onerror=boom()><b>"


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A soft ball with a fine skin and a rigid box fly to the right above a floor, and a stitched block with a pin."""
    path = tmp_path_factory.mktemp("page") / "recording.vtkhdf"
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4)
    coarse, fine = (sp.shapes.sphere(radius=0.3, edge_length=edge) for edge in (0.3, 0.08))
    block = sp.shapes.box((0.3, 0.3, 0.3), (1, 1, 1))
    bodies = [
        sp.Body("ball", coarse, rubber, position=(-0.5, 0.8, 0), velocity=(2.0, 0.0, 0.0), skin=fine.surface),
        sp.RigidBody("box", block.surface, position=(-0.5, 0.8, -1.0), velocity=(2.0, 0, 0), look="steel", density=500),
        sp.Body("low", block, rubber, position=(1.0, 0.16, -1.0), look="foam"),
        sp.Body("high", block, rubber, position=(1.0, 0.47, -1.0), look="gummy"),
    ]
    stitch = sp.SoftVertexTriangleStitch("high", "low", max_distance=0.02, youngs=5e4, poisson=0.4)
    pins = [sp.Pin("low", vertices=[0, 1])]
    scene = sp.Scene(bodies, stitches=[stitch], pins=pins, obstacles=[sp.HalfSpace(name="floor", friction=0.5)])
    for _ in sp.simulate(scene, sp.XPBD(substeps=16), 1 / 60, 30, sinks=[sp.Recorder(path)]):
        pass
    return path


@pytest.fixture(scope="module")
def file(path):
    """Its page, with names that scenes refuse."""
    with read_recording(path) as recording:
        assert recording.system.scene is recording.scene  # it was built with the names that the scene has
        object.__setattr__(recording.bodies[1].body, "name", HOSTILE)
        for sensor in recording.sensors:
            object.__setattr__(sensor, "name", HOSTILE)
        return write_page(recording, path.with_suffix(".html"))


class Tab:
    """A page of the browser, what it asked for, and what went wrong in it."""

    def __init__(self, browser, file, width=480, height=400, **options) -> None:
        self.tab = browser.new_page(viewport={"width": width, "height": height}, **options)
        self.tab.set_default_timeout(90_000)
        self.asked, self.errors = [], []
        self.tab.on("request", lambda request: self.asked.append(request.url))
        self.tab.on("pageerror", lambda error: self.errors.append(str(error)))
        self.tab.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)
        self.tab.goto(file.as_uri())

    def drawn(self) -> "Tab":
        """This one, once there is a picture."""
        self.tab.wait_for_function("globalThis.supplePage?.pictures > 0")
        return self

    def seek(self, frame: int) -> None:
        """Show a frame, with all that a slow renderer leaves out at first."""
        self.tab.evaluate(f"supplePage.player.seek({frame})")
        self.tab.wait_for_timeout(200)
        self.tab.wait_for_function("!supplePage.asked && !supplePage.refine")

    def numbers(self, expression: str) -> np.ndarray:
        return np.array(self.tab.evaluate(f"Array.from({expression})"))


@pytest.fixture(scope="module")
def page(file, browser):
    """The page, paused at the start."""
    tab = Tab(browser, file).drawn()
    tab.seek(0)
    yield tab
    tab.tab.close()


def test_it_plays_alone(file, browser):
    playing = Tab(browser, file).drawn()
    playing.tab.wait_for_function("supplePage.player.time > .1")
    playing.tab.wait_for_function("/pictures\\/s/.test(document.querySelector('#rate').textContent)")
    title, errors, asked = playing.tab.title(), playing.errors, playing.asked
    playing.tab.close()
    assert (title, errors) == (f"ball, {HOSTILE}, low, high · Supple", [])
    # What the page has made itself is not asked of anybody.
    assert [item for item in asked if not item.startswith("blob:")] == [file.as_uri()]


def test_points_and_skins_are_those_of_the_recording(page, path):
    with read_recording(path) as recording:
        model = model_of_recording(recording)
        for k in (0, 11, 24, 30):
            page.seek(k)
            frame = render_frame_of(model, recording[k])
            x = page.numbers("supplePage.stage.points").reshape(-1, 3)
            np.testing.assert_allclose(x[: len(frame.positions)], frame.positions, atol=1e-4)
            ends = frame.stitch_segments.reshape(-1, 3)
            assert len(ends) > 0
            np.testing.assert_allclose(x[len(frame.positions) :][: len(ends)], ends, atol=1e-4)
            page.tab.evaluate("supplePage.render(supplePage.pace.best)")
            for number, body in enumerate(model.bodies):
                skin = page.numbers(f"supplePage.stage.drawn[{number}].mesh.geometry.attributes.position.array")
                skin = skin.reshape(-1, 3)
                surface = body_surface(model, body).creased(model)
                expected = surface.at(frame)
                if (k, number) == (24, 0):  # its skin reaches below the floor, and is moved out
                    assert np.abs(expected - surface.of(frame.finite_positions)).max() > 0.05
                assert len(skin) == len(expected)
                np.testing.assert_allclose(skin, expected, atol=5e-4)


def test_it_draws_bodies_where_they_are(page, pixels):
    places = []
    for frame in (0, 30):
        page.seek(frame)
        page.tab.wait_for_timeout(100)
        r, _, b = np.moveaxis(pixels(page.tab)[:300], 2, 0)
        red = r - b > 70
        assert red.sum() > 300
        places.append(np.nonzero(red)[1].mean())
    assert places[1] - places[0] > 40


def test_nothing_is_drawn_while_nothing_changes(page):
    page.seek(3)
    before = page.tab.evaluate("supplePage.pictures")
    page.tab.wait_for_timeout(1000)
    assert page.tab.evaluate("supplePage.pictures") == before
    page.tab.mouse.move(200, 150)
    page.tab.mouse.down()
    page.tab.mouse.move(240, 160)
    page.tab.mouse.up()
    page.tab.wait_for_function(f"supplePage.pictures > {before}")


def choose(page, name, label):
    page.tab.locator(f"[data-name='{name}'] select").select_option(label)


def test_fields_have_their_colors_and_a_legend(page, pixels):
    page.seek(0)
    legend = page.tab.locator("#legend")
    assert not legend.is_visible()
    page.tab.evaluate("supplePage.gui.open()")
    choose(page, "field", "volume ratio J")
    assert legend.locator(".name").inner_text() == "volume ratio J"
    low, high = (float(legend.locator(f".{end}").inner_text()) for end in ("low", "high"))
    assert low < 1.0 < high
    values = page.numbers("supplePage.stage.drawn[0].mesh.geometry.attributes.value.array")
    page.seek(0)
    np.testing.assert_allclose(values, 127.5, atol=1.5)  # J is 1 at rest: the middle of the scale
    choose(page, "field", "body")
    assert not legend.is_visible()


def test_tets_are_cut_and_moved_apart(page):
    page.seek(0)
    choose(page, "surface", "tets")
    page.seek(0)
    count = "supplePage.stage.drawn[0].mesh.geometry.drawRange.count"
    whole = page.tab.evaluate(count)
    size = "Math.max(...supplePage.stage.drawn[0].mesh.geometry.attributes.position.array)"
    before = page.tab.evaluate(size)
    for name, value in (("explode", 1), ("cut", 1)):
        page.tab.evaluate(
            "([name, value]) => supplePage.gui.controllersRecursive().find(c => c.property === name).setValue(value)",
            [name, value],
        )
        page.seek(0)
        if name == "explode":
            assert page.tab.evaluate(size) > before + 0.1
    assert whole > 0
    assert page.tab.evaluate(count) == 0
    page.tab.evaluate("supplePage.gui.reset()")
    page.seek(0)
    assert page.tab.evaluate("supplePage.stage.drawn[0].tets") is None


def test_the_camera_centers_bodies_shows_views_and_follows(page):
    page.seek(0)
    target = lambda: page.numbers("supplePage.view.controls.target.toArray()")  # noqa: E731
    middle = lambda: page.numbers("supplePage.stage.middle(0).toArray()")  # noqa: E731
    at = page.tab.evaluate("""() => {
      const p = supplePage.stage.middle(0).project(supplePage.view.camera);
      return [(0.5 + 0.5 * p.x) * innerWidth, (0.5 - 0.5 * p.y) * innerHeight];
    }""")
    page.tab.mouse.dblclick(*at)
    page.tab.wait_for_timeout(400)
    np.testing.assert_allclose(target(), middle(), atol=1e-6)
    choose(page, "follow", "ball")
    page.seek(1)
    for frame in (15, 30):
        page.seek(frame)
        np.testing.assert_allclose(target() - middle(), [0.0] * 3, atol=0.1)  # but for what the first frame moved it
    choose(page, "follow", "nothing")
    for view in ("front", "side", "top"):
        page.tab.locator(".row button", has_text=view).click()
        away = page.numbers("supplePage.view.camera.position.toArray()") - target()
        assert (
            abs(away[1]) > 0.99 * np.linalg.norm(away) if view == "top" else abs(away[1]) < 0.2 * np.linalg.norm(away)
        )
        assert (np.abs(away) / np.linalg.norm(away)).max() > 0.95
    page.tab.locator(".row button", has_text="fit").click()
    assert page.tab.evaluate("supplePage.view.fitted") == "fit"


def test_plots_show_readings_and_the_time(page):
    choose(page, "plot", "energy [J]")
    plot = page.tab.locator("#plot")
    assert "kinetic" in plot.inner_text()
    box = plot.locator(".u-over").bounding_box()
    page.tab.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    assert page.tab.evaluate("supplePage.player.place") == pytest.approx(15, abs=2)
    choose(page, "plot", "none")
    assert not plot.is_visible()


def test_keys_and_the_slider_move_the_time(page):
    page.seek(5)
    page.tab.keyboard.press("ArrowRight")
    assert page.tab.evaluate("supplePage.player.place") == 6
    page.tab.locator("#time").fill("12")
    assert page.tab.evaluate("supplePage.player.place") == 12
    assert page.tab.locator("#now").inner_text() == "0.200 s"
    page.tab.keyboard.press(" ")
    page.tab.wait_for_function("supplePage.player.playing && supplePage.player.place > 12")
    page.seek(0)


def test_names_are_text(page):
    assert page.errors == []
    assert page.tab.locator("img").count() == 0


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_narrow_page_follows_the_theme_of_the_system(file, browser, pixels, scheme):
    tab = Tab(browser, file, 400, 800, color_scheme=scheme).drawn()
    tab.seek(0)
    shot = pixels(tab.tab)
    tab.tab.close()
    corner = shot[100:140, :40].mean()
    assert corner > 200 if scheme == "light" else corner < 60
    r, _, b = np.moveaxis(shot, 2, 0)
    assert (r - b > 70).sum() > 300, "the ball is not in the picture"


def test_the_theme_changes_with_that_of_the_system(page, pixels):
    shades = []
    for scheme in ("dark", "light"):
        page.tab.emulate_media(color_scheme=scheme)
        page.tab.wait_for_timeout(300)
        page.seek(0)
        shades.append(pixels(page.tab)[40:200, :60].mean())
    assert shades[1] > shades[0] + 80
    assert page.errors == []


@pytest.mark.parametrize("damage", ["cut", "letters", "empty"])
def test_damaged_pages_say_so(file, browser, tmp_path, damage):
    text = file.read_text(encoding="utf-8")
    head, mark, rest = text.partition('<script id="data" type="text/plain">')
    data, end, tail = rest.partition("</script>")
    data = {"cut": data[: len(data) // 2], "letters": data[:900] + "A" * 500 + data[1400:], "empty": ""}[damage]
    (tmp_path / "page.html").write_text(head + mark + data + end + tail, encoding="utf-8")
    tab = Tab(browser, tmp_path / "page.html")
    message = tab.tab.locator("#message")
    message.wait_for()
    said = message.inner_text()
    tab.tab.close()
    assert said.startswith("This page is damaged")
    assert tab.errors == []
