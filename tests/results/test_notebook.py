"""What notebooks show: short texts, tables, players, and a line of progress."""

import io
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import supple as sp
from supple.errors import OutputError
from supple.results.progress import ProgressBar

NOTEBOOK = Path(__file__).parents[2] / "examples" / "notebooks" / "first_steps.ipynb"


class Tags(HTMLParser):
    """Tags of a text, and what is between them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict]] = []
        self.words: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.words.append(data)


@pytest.fixture(scope="module")
def shown(tools, recorded):
    """One of each kind that is displayed, by the name of its class."""
    scene = tools.small_scene()
    *_, frame = sp.simulate(scene, tools.Prescribed(), 1 / 30, 3)
    recording = sp.read_recording(recorded[0])
    things = (scene, frame, frame.report, recording, recording[4], scene.bodies[0].mesh, scene.bodies[0].skin)
    yield {type(thing).__name__: thing for thing in things}
    recording.close()


def test_texts_are_one_short_line(shown):
    for name, thing in shown.items():
        text = repr(thing)
        assert text.startswith(f"{name}("), text
        assert "\n" not in text
        assert len(text) < 300
    assert repr(shown["TetMesh"]) == "TetMesh(vertices: 27, tets: 48, size: 1 x 1 x 1 m, volume: 1 m^3)"
    assert repr(shown["Frame"]).startswith("Frame(index: 3, time: 0.1 s, bodies: cube, slab, status: converged")
    assert "frames: 25 to 0.8 s" in repr(shown["Recording"])


def test_tables_contain_the_same(shown):
    for thing in shown.values():
        table = Tags(thing._repr_html_())
        assert table.tags[0][0] == "table"
        assert table.words == [type(thing).__name__, *(word for row in thing._facts().items() for word in row)]


def test_names_are_no_markup(tools):
    report = next(iter(sp.simulate(tools.small_scene(), tools.Prescribed(message="<b>&"), 1 / 30, 1))).report
    assert "<b>&" in repr(report)
    assert "&lt;b&gt;&amp;" in report._repr_html_()


@pytest.mark.parametrize("kind", ["Scene", "Frame", "Recording", "RecordedFrame"])
def test_players_are_complete_pages(shown, kind, tmp_path):
    player = shown[kind].show(height=300)
    ((tag, attributes),) = Tags(player._repr_html_()).tags
    assert tag == "iframe"
    assert attributes["srcdoc"] == player.page
    assert "height:300px" in attributes["style"]
    assert '<script id="data"' in player.page
    assert not re.search(r'(src|href)="https?:', player.page)
    assert len(repr(player)) < 200
    assert player.save(tmp_path / "page.html").read_text(encoding="utf-8") == player.page


def test_a_player_draws_in_a_notebook_s_output(shown, browser, pixels, tmp_path):
    # Of a recorded frame: the others have the same pages. As in a notebook, the player is an inner page.
    outer = tmp_path / "notebook.html"
    outer.write_text(f"<html><body>{shown['RecordedFrame'].show(height=360)._repr_html_()}</body></html>")
    page = browser.new_page(viewport={"width": 480, "height": 380})
    page.set_default_timeout(90_000)
    page.goto(outer.as_uri())
    page.frame_locator("iframe").locator("canvas[data-engine]").wait_for()
    red = 0
    for _ in range(120):
        page.wait_for_timeout(250)
        shot = pixels(page)[:280]
        red = np.count_nonzero((shot[..., 0] - shot[..., 2] > 60) & (shot[..., 1] < 140))
        if red > 100:
            break
    page.close()
    assert red > 100, "the first body, which is red, was not drawn"


def test_a_recording_has_its_check_its_plot_and_its_exports(recorded, shown, tmp_path):
    recording = shown["Recording"]
    report = recording.check(only=["inversion", "sequence"])
    assert str(report) == str(sp.check_recording(recorded[0], only=["inversion", "sequence"]))
    assert [result.name for result in report.results] == ["sequence", "inversion"]
    assert "pass: " in report._repr_html_()
    plot = recording.plot()
    assert plot._repr_png_().startswith(b"\x89PNG")
    assert plot.save(tmp_path / "p.pdf").read_bytes().startswith(b"%PDF")
    assert recording.export("csv", tmp_path / "t.csv").read_text().startswith("frame,time,status")
    with pytest.raises(OutputError, match="format 'mp5' does not exist"):
        recording.export("mp5")


@pytest.mark.parametrize("height", [0, 99, 5000, 300.5, True, "300"])
def test_a_height_that_cannot_be_is_an_error(shown, height):
    with pytest.raises(OutputError, match="show: height is"):
        shown["Scene"].show(height=height)


def test_progress_is_shown_when_asked_for(tools, capsys):
    for _ in sp.simulate(tools.small_scene(), tools.Prescribed(), 1 / 30, 4):
        pass
    assert capsys.readouterr() == ("", "")
    for _ in sp.simulate(tools.small_scene(), tools.Prescribed(), 1 / 30, 4, progress=True):
        pass
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("4 of 4 frames in")


def test_progress_in_a_notebook_is_a_line_that_changes(tools, capsys):
    console = Console(file=io.StringIO(), force_jupyter=True)
    for _ in sp.simulate(tools.small_scene(), tools.Prescribed(), 1 / 30, 3, sinks=[ProgressBar(console)]):
        pass
    lines = capsys.readouterr().out.split("\r")
    assert lines[0] == ""
    assert lines[1].startswith("1 of 3 frames, ")
    assert lines[-1].startswith("3 of 3 frames in ")
    assert lines[-1].endswith("\n")


def test_the_notebook_runs(tmp_path):
    import nbclient  # not above: each process of the tests would import it
    import nbformat

    notebook = nbformat.read(NOTEBOOK, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "clear the outputs before you save the notebook"
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    pages = [output.data["text/html"] for output in outputs if "text/html" in output.get("data", {})]
    assert sum(page.startswith("<iframe srcdoc=") for page in pages) == 3
    assert any(page.startswith("<table><caption>Report") for page in pages)
    printed = "".join(output.text for output in outputs if output.output_type == "stream")
    assert "40 of 40 frames" in printed


@pytest.mark.parametrize("mesh", [sp.shapes.box(divisions=(1, 1, 1)), sp.shapes.gummy_bear_surface(height=1.0)])
def test_meshes_are_shown(mesh, tmp_path):
    player = mesh.show(height=200)
    assert type(mesh).__name__ in player.title
    assert '<script id="data"' in player.page
