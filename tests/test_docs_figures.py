"""Tables of benchmarks on pages come from the files that benchmarks write."""

import json
import re
from pathlib import Path

import pytest
from benchmarks import publishing
from benchmarks.table import Table, table_text

ROOT = Path(__file__).parents[1]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
SHOWN = r"<!-- figures: (\w+) -->\n.*?<!-- end of figures -->"
# A number with a unit of time or memory, or a ratio; steps of time such as 1/60 s are none.
MEASURED = r"(?<![/\d.])\d[\d.,]*(?: to \d[\d.,]*)? ?(?:ms|us|ns|s|MB|GB|times)\b"


def beyond_figures(page: str) -> str:
    """The text of a page without the parts that come from files."""
    return re.sub(SHOWN, "", page, flags=re.S)


@pytest.mark.parametrize("name", publishing.SHOWN)
def test_a_page_shows_its_files(name):
    page = (publishing.DOCS / publishing.SHOWN[name]).read_text(encoding="utf-8")
    assert publishing.with_table(page, name) == page


def test_every_file_is_shown():
    assert {path.stem for path in (publishing.DOCS / "figures").glob("*.json")} == set(publishing.SHOWN)


@pytest.mark.parametrize("name", publishing.SHOWN)
def test_between_the_marks_is_a_caption_and_a_table(name):
    """Benchmarks rewrite tables, and no prose."""
    text = table_text(json.loads(publishing.file_of(name).read_text(encoding="utf-8")))
    caption, empty, *rows = text.splitlines()
    assert "2026-" in caption
    assert empty == ""
    assert len(rows) > 2
    assert all(row.startswith("|") and row.endswith("|") for row in rows)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_marks_of_a_page_name_parts_that_belong_there(page):
    text = page.read_text(encoding="utf-8")
    found = re.findall(SHOWN, text, flags=re.S)
    assert len(found) == len(re.findall("<!-- *figures", text)) == len(re.findall("<!-- *end of figures", text))
    shown = {name: (publishing.DOCS / path).resolve() for name, path in publishing.SHOWN.items()}
    assert set(found) == {name for name, path in shown.items() if path == page}


def test_the_page_of_benchmarks_has_no_figures_of_its_own():
    text = beyond_figures((ROOT / "docs" / "validation" / "benchmarks.md").read_text(encoding="utf-8"))
    assert [line for line in text.splitlines() if line.startswith("|")] == []
    assert re.findall(MEASURED, text) == []
    assert re.search(MEASURED, "| a step | 12 ms |")
    assert re.search(MEASURED, "it is 1.5 times as fast")
    assert not re.search(MEASURED, "frames of 1/60 s")


def test_a_file_without_the_key_of_a_table_is_an_error(monkeypatch, tmp_path):
    monkeypatch.setattr(publishing, "DOCS", tmp_path)
    page = "<!-- figures: startup -->\n<!-- end of figures -->\n"
    with pytest.raises(FileNotFoundError):
        publishing.with_table(page, "startup")
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "startup.json").write_text('{"date": "2026-01-31", "load": "0.1", "cores": 2}')
    with pytest.raises(KeyError, match="columns"):
        publishing.with_table(page, "startup")


def test_rows_become_a_table(capsys):
    table = Table("beams", {"name": "", "tets": ",d", "s": ".2f"}, threads=1)
    table.add("long", 12345, 1.0)
    table.add("short", 6, None)
    table.note("Both hang.")
    text = table_text(table.figures())
    assert text.endswith("| name | tets | s |\n|---|---|---|\n| long | 12,345 | 1.00 |\n| short | 6 |  |")
    assert text.startswith("Measured on 20")
    assert ", 1 thread)." in text
    printed = capsys.readouterr().out
    assert "12,345" in printed
    assert "Both hang." in printed


def test_figures_become_tables(monkeypatch, tmp_path):
    monkeypatch.setattr(publishing, "DOCS", tmp_path)
    page = tmp_path / "validation" / "benchmarks.md"
    page.parent.mkdir()
    page.write_text("before\n<!-- figures: startup -->\nold\n<!-- end of figures -->\nafter\n", encoding="utf-8")
    table = Table("startup", {"name": "", "s": ".2f"}, threads=1)
    table.add("import", 0.5)
    publishing.publish("startup", table.figures())
    text = page.read_text(encoding="utf-8")
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    assert "| import | 0.50 |" in text
    assert "old" not in text
    assert publishing.with_table(text, "startup") == text
