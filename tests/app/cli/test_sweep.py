"""`supple sweep`: files, summary and exit codes."""

import csv

import pytest

from supple.app.cli.app import main
from supple.app.cli.commands.sweep import StudyBar, duration
from supple.app.cli.console import ExitCode
from supple.app.studies.study import StudyProgress

SCENE = """\
bodies:
  - name: cube
    shape: {kind: box, divisions: [1, 1, 1]}
    material: {kind: edges_and_volume}
solver: {kind: xpbd, substeps: 1, contact: null}
steps: 2
"""
STUDY = """\
scene: fall.yaml
factors: {steps: [1, 2, -1]}
measures: {drop: {quantity: displacement, body: cube, axis: y}}
"""


@pytest.fixture
def study(tmp_path):
    (tmp_path / "fall.yaml").write_text(SCENE, encoding="utf-8")
    (tmp_path / "study.yaml").write_text(STUDY, encoding="utf-8")
    return tmp_path / "study.yaml"


def test_a_study_in_the_shell(study, tmp_path, capfd):
    arguments = ["sweep", str(study), "-o", str(tmp_path / "out"), "--workers", "1"]
    assert main(arguments) == ExitCode.FAILED
    out = capfd.readouterr().out.splitlines()
    assert out[0] == "3 cases: 2 done, 1 failed"
    assert "steps: is -1; it must be at least 0" in out[1]
    with (tmp_path / "out" / "table.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["steps"], row["status"]) for row in rows] == [("1", "done"), ("2", "done"), ("-1", "failed")]
    assert float(rows[1]["drop [m]"]) == pytest.approx(3.0 * float(rows[0]["drop [m]"]))
    # Everything has ended: no worker is started, and nothing is printed.
    study.write_text(STUDY.replace(", -1", ""), encoding="utf-8")
    assert main([*arguments, "--quiet"]) == ExitCode.OK
    assert capfd.readouterr() == ("", "")


def test_a_study_file_that_is_missing(tmp_path, capfd):
    assert main(["sweep", str(tmp_path / "absent.yaml")]) == ExitCode.INPUT
    assert capfd.readouterr().err.endswith("absent.yaml: the file does not exist\n")


def test_the_bar_shows_failures_and_the_time_left():
    from io import StringIO

    from rich.console import Console

    text = StringIO()
    with StudyBar(Console(file=text, force_terminal=True, width=120)) as bar:
        bar.show(StudyProgress(64, 10, 2, None))
        bar.show(StudyProgress(64, 30, 2, 7500.0))
    assert "32/64" in text.getvalue()
    assert "2 failed  2 h 05 min left" in text.getvalue()
    assert [duration(s) for s in (None, 3.2, 61.0, 3600.0)] == ["?", "3 s", "1 min 01 s", "1 h 00 min"]
