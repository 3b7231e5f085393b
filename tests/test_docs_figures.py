"""Figures of pages come from the files that benchmarks write."""

import pytest
from benchmarks import published
from benchmarks.latency import PARTS, STAGES, summary


@pytest.mark.parametrize("name", published.SHOWN)
def test_a_page_shows_its_file(name):
    page = (published.DOCS / published.SHOWN[name][0]).read_text(encoding="utf-8")
    assert published.with_figures(page, name) == page


def test_every_file_is_shown():
    assert {path.stem for path in (published.DOCS / "figures").glob("*.json")} <= set(published.SHOWN)


def test_figures_become_tables(monkeypatch, tmp_path):
    both = {"median_ms": 1.25, "p95_ms": 2.5}
    events = [dict.fromkeys(STAGES, 1.0), dict.fromkeys(STAGES, 1.0) | {"sent": 51.0}]
    found = summary(events)
    assert (found["median_ms"], found["slow"]) == (32.0, {"sent": 1})
    assert sorted(name for _, names in PARTS.values() for name in names) == sorted(STAGES)  # each stage counts once
    size = {"tets": 5760, "step_ms": 3.0, "paused_percent": 0.5, "unwatched_percent": 0.5, "stages": {}} | found
    size["stages"] = dict.fromkeys(STAGES, both)
    blocks = {"median_fps": 12.0, "tets": 2000, "contacts": 80.0}
    figures: dict = {"date": "2026-01-31", "load": 0.1, "load_after": 1.2, "sizes": [size, size], "implicit": blocks}
    monkeypatch.setattr(published, "DOCS", tmp_path)
    monkeypatch.setattr(published, "ROOT", tmp_path)
    page = tmp_path / "live.md"
    page.write_text("before\n<!-- figures: live_page -->\nold\n<!-- end of figures -->\nafter\n", encoding="utf-8")
    published.publish("live_page", figures)
    text = page.read_text(encoding="utf-8")
    assert "| a step | 3.0 ms | 3.0 ms |" in text
    assert "load 0.1 before and 1.2 after" in text
    assert "| stage: browser to server | 1.2 / 2.5 | 1.2 / 2.5 |" in text
    assert "| ours: event at the server to mesh written to the browser | 4.0 / 4.0 | 4.0 / 4.0 |" in text
    assert "old" not in text
    assert published.with_figures(text, "live_page") == text
    published.publish("live_page", figures | {"sizes": [size], "implicit": None})  # as where a part took too long
    assert "| a step | 3.0 ms |\n" in page.read_text(encoding="utf-8")
