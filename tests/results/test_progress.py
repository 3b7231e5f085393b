"""The progress bar: a bar in a terminal, otherwise one line."""

from __future__ import annotations

import io
import re

from rich.console import Console

from supple.results.progress import ProgressBar
from supple.simulate import simulate


def _run(tools, console: Console, steps: int = 5, **options) -> None:
    for _ in simulate(tools.small_scene(), tools.Prescribed(**options), 1 / 30, steps, sinks=[ProgressBar(console)]):
        pass


def test_without_a_terminal_there_is_one_line(tools):
    text = io.StringIO()
    _run(tools, Console(file=text, width=60))
    assert re.fullmatch(r"5 of 5 frames in [\d.]+ s, [\d.]+ ms each in the solver; converged\n", text.getvalue())


def test_an_early_stop_is_reported(tools):
    text = io.StringIO()
    _run(tools, Console(file=text), stop_at=2)
    assert text.getvalue().startswith("2 of 5 frames")
    assert text.getvalue().endswith("blocked\n")


def test_a_run_of_no_steps(tools):
    text = io.StringIO()
    _run(tools, Console(file=text), 0)
    assert text.getvalue().startswith("0 of 0 frames")


def test_a_terminal_shows_a_bar(tools):
    text = io.StringIO()
    _run(tools, Console(file=text, force_terminal=True, width=100))
    assert "5/5" in text.getvalue()
    assert "ms each" in text.getvalue()
    assert "converged" in text.getvalue()
