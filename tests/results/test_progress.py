"""The progress bar: a bar in a terminal, otherwise one line."""

import io
import re
import sys
from types import SimpleNamespace

import pytest
from rich.console import Console

from supple.results import progress
from supple.results.progress import CompileBar, ProgressBar, show_compilation
from supple.runtime import kernel_count, kernel_list
from supple.simulate import simulate


def _run(tools, console: Console, steps: int = 5, **options) -> None:
    for _ in simulate(tools.small_scene(), tools.Prescribed(**options), 1 / 30, steps, sinks=[ProgressBar(console)]):
        pass


def test_without_a_terminal_there_is_one_line(tools):
    text = io.StringIO()
    _run(tools, Console(file=text, width=60))
    assert re.fullmatch(r"5 of 5 frames in [\d.]+ s, [\d.]+ ms each in the solver; converged\n", text.getvalue())


@pytest.mark.filterwarnings("ignore::supple.errors.SuppleWarning")
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


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def compiled(monkeypatch):
    """Compiles a kernel for so many seconds, and returns what was written meanwhile."""
    clock = [1.0]
    progress.error_console.cache_clear()  # one that was made before this terminal does not know it
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setattr(kernel_count, "WATCHERS", [])
    monkeypatch.setattr(kernel_list, "kernels_of_scenes", lambda: {"one": [(f"a:{k}", []) for k in range(9)]})
    monkeypatch.setattr(progress, "time", SimpleNamespace(perf_counter=lambda: clock[0]))
    terminal, out = Terminal(), io.StringIO()

    def tell(*stages, seconds=3.0, stderr=terminal):
        monkeypatch.setattr(sys, "stderr", stderr)
        monkeypatch.setattr(sys, "stdout", out)
        for stage, name in stages:
            for watcher in kernel_count.WATCHERS:
                watcher(stage, name, ())
            clock[0] += seconds
        return sys.stderr.getvalue()

    return tell


ONE, TWO = (("compiling", "a:1"), ("compiled", "a:1")), (("compiling", "a:2"), ("compiled", "a:2"))


def test_in_a_terminal_compilation_is_shown_once_it_takes_two_seconds(compiled):
    show_compilation()
    assert compiled(*ONE) == ""
    assert "compiling kernels, once on this machine" in compiled(*TWO)
    assert "2/9" in sys.stderr.getvalue()
    assert sys.stdout.getvalue() == ""


def test_short_compilation_is_not_shown(compiled):
    show_compilation()
    assert compiled(*ONE, *TWO, seconds=0.5) == ""


def test_in_a_pipe_compilation_is_not_shown(compiled, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")  # with which rich takes any file for a terminal
    show_compilation()
    assert compiled(*ONE, *TWO, stderr=io.StringIO()) == ""


def test_a_block_shows_compilation_alone(compiled):
    show_compilation()
    with CompileBar():
        assert compiled(*ONE, *TWO).count("compiling kernels") >= 1
    (own,) = [watcher.__self__ for watcher in kernel_count.WATCHERS]
    assert own._bar is None


def test_a_progress_bar_shows_compilation_itself(compiled, tools):
    show_compilation()
    bar = ProgressBar(Console(file=io.StringIO(), width=120, force_terminal=True))
    frames = simulate(tools.small_scene(), tools.Prescribed(), 1 / 30, 2, sinks=[bar])
    next(frames)
    assert compiled(*ONE, *TWO) == ""
    assert bar._bar.tasks[0].fields["status"] == "compiling kernel 2 of 9, once on this machine"
    list(frames)
    assert bar._bar is None
    assert compiled(*ONE) != ""


def test_in_a_notebook_compilation_is_a_line_that_goes(compiled, monkeypatch):
    monkeypatch.setattr(progress, "error_console", lambda: Console(file=io.StringIO(), force_jupyter=True))
    show_compilation()
    assert compiled(*ONE, *TWO) == ""
    _, line, nothing, end = sys.stdout.getvalue().split("\r")
    assert line.startswith("compiling kernel 2 of 9, once on this machine, 3 s")
    assert (nothing.strip(), end) == ("", "")
