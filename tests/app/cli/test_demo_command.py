"""`supple demo`: lists, runs and records demos, prints the measured claims, and exits with 1 where one fails."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from supple.app.cli.app import main
from supple.app.cli.console import ExitCode
from supple.app.demos.demo import Measurement
from supple.app.demos.registry import DEMOS
from supple.results.recording.reader import read_recording


@pytest.mark.parametrize("arguments", [["demo"], ["demo", "--list"], ["demo", "squash", "-l"]])
def test_lists_the_demos(arguments, capsys):
    assert main(arguments) == ExitCode.OK
    out = capsys.readouterr().out
    for demo in DEMOS.values():
        assert f"{demo.name} " in out
        assert demo.summary in out


def test_runs_a_demo_and_prints_its_claims(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    assert main(["demo", "stretch", "--steps", "2", "--no-page", "--no-plot"]) == ExitCode.FAILED
    out, _ = capfd.readouterr()
    assert DEMOS["stretch"].explanation in out
    with read_recording("out/stretch/recording.vtkhdf") as recording:
        assert len(recording) == 3
    verdicts = [line for line in out.splitlines() if line.startswith(("holds: ", "does not hold: "))]
    assert len(verdicts) == 3
    # After two frames no tet is inverted, and the ball is not yet stretched to twice its length.
    assert any(line.startswith("holds: no tetrahedron inverts") for line in verdicts)
    assert any(line.startswith("does not hold: stretched to twice its length") for line in verdicts)


def test_quiet_prints_only_the_claims(tmp_path, capfd):
    arguments = ["demo", "squash", "-q", "--steps", "2", "--no-page", "--no-plot", "-o", str(tmp_path / "here")]
    assert main(arguments) == ExitCode.FAILED
    out, err = capfd.readouterr()
    assert all(line.startswith(("holds: ", "does not hold: ")) for line in out.splitlines())
    assert err == ""
    written = sorted(path.name for path in (tmp_path / "here").iterdir())
    assert written == ["recording.vtkhdf", "report.csv", "run"]


def test_a_demo_whose_claims_all_hold_exits_0(tmp_path, monkeypatch, capfd):
    short = replace(DEMOS["stretch"], measurement=WithoutClaims, steps=1)
    monkeypatch.setitem(DEMOS, "stretch", short)
    assert main(["demo", "stretch", "-q", "--no-page", "--no-plot", "-o", str(tmp_path)]) == ExitCode.OK
    assert capfd.readouterr().out == ""


class WithoutClaims(Measurement):
    def claims(self):
        return []


def test_the_demos_of_the_readme_and_of_make_run_at_their_full_length():
    """`make demo` and test_docs_programs.py run these commands and fail at an exit code above 0: all claims hold."""
    root = Path(__file__).parents[3]
    text = (root / "README.md").read_text(encoding="utf-8") + (root / "Makefile").read_text(encoding="utf-8")
    commands = re.findall(r"^.*supple demo [a-z].*$", text, flags=re.M)
    named = {name for command in commands for name in re.findall(r"supple demo ([a-z]\w*)", command)}
    assert {"squash", "bears", "stitch"} <= named <= set(DEMOS)
    assert not [command for command in commands if "--steps" in command or "||" in command]
