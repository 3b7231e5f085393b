"""`--trace`: every iteration of Newton's method in a CSV file, complete or not written."""

import csv
from itertools import pairwise

import numpy as np
import pytest

from supple.app.cli.app import main
from supple.app.cli.console import ExitCode

SCENE = """\
bodies:
  - name: bar
    shape: {kind: box, size: [1, 0.2, 0.2], divisions: [6, 2, 2]}
    material: {kind: stable_neo_hookean, youngs: 1e5, poisson: 0.4, density: 1000}
pins:
  - {body: bar, box: {low: [-1, -1, -1], high: [-0.499, 1, 1]}}
solver: {kind: implicit}
dt: 0.02
steps: 3
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    return path


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_run_writes_every_iteration(scene, tmp_path):
    table = tmp_path / "new" / "newton.csv"
    code = main(["run", str(scene), "-q", "--no-page", "--no-plot", "-o", str(tmp_path / "out"), "--trace", str(table)])
    assert code == ExitCode.OK
    rows = rows_of(table)
    times = [float(row["time"]) for row in rows]
    np.testing.assert_allclose(sorted(set(times)), [0.02, 0.04, 0.06])
    assert times == sorted(times)
    assert {row["kind"] for row in rows} == {"newton"}
    for time in set(times):
        energies = [float(row["energy"]) for row in rows if float(row["time"]) == time]
        assert all(after <= before + 1e-9 * abs(before) for before, after in pairwise(energies))
    assert all(0.0 < float(row["filter"]) <= 1.0 and 0.0 < float(row["step"]) <= 1.0 for row in rows)
    assert all(int(row["linear_iterations"]) > 0 for row in rows if row["linear_solver"] == "pcg")
    assert [path.name for path in table.parent.iterdir()] == ["newton.csv"]


def test_a_run_traces_the_motion_of_pins(scene, tmp_path):
    motion = "motion: {times: [0, 0.06], displacements: [[0, 0, 0], [-0.05, 0, 0]]}"
    scene.write_text(SCENE.replace("high: [-0.499, 1, 1]}}", "high: [-0.499, 1, 1]}, " + motion + "}"))
    table = tmp_path / "newton.csv"
    command = ["run", str(scene), "-q", "--no-page", "--no-plot", "-o", str(tmp_path / "out"), "--trace", str(table)]
    assert main(command) == ExitCode.OK
    assert {row["kind"] for row in rows_of(table)} == {"newton", "extension"}


@pytest.mark.slow
def test_demo_traces_the_motion_of_pins(tmp_path):
    table = tmp_path / "newton.csv"
    arguments = ["demo", "twist", "--steps", "1", "-q", "--no-page", "--no-plot", "-o", str(tmp_path / "out")]
    assert main([*arguments, "--trace", str(table)]) == ExitCode.FAILED  # one step is too few for the claims
    assert {row["kind"] for row in rows_of(table)} == {"newton", "extension"}


@pytest.mark.parametrize("command", [["run", "{scene}", "--solver", "xpbd"], ["demo", "stretch"]])
def test_a_trace_of_xpbd_is_an_error_and_nothing_is_written(command, scene, tmp_path, capfd):
    table = tmp_path / "newton.csv"
    arguments = [part.format(scene=scene) for part in command]
    code = main([*arguments, "-o", str(tmp_path / "out"), "--trace", str(table)])
    assert code == ExitCode.INPUT
    error = capfd.readouterr().err.strip()
    assert "XPBD does not use Newton's method; use --solver implicit" in error
    assert len(error.splitlines()) == 1
    assert not table.exists()
    assert not (tmp_path / "out").exists()


def test_a_path_that_cannot_be_written_is_one_line(scene, tmp_path, capfd):
    (tmp_path / "file").write_text("")
    arguments = ["run", str(scene), "-q", "--no-page", "--no-plot", "-o", str(tmp_path / "out")]
    assert main([*arguments, "--trace", str(tmp_path / "file" / "newton.csv")]) == ExitCode.INPUT
    error = capfd.readouterr().err.strip()
    assert "file" in error
    assert len(error.splitlines()) == 1


def test_a_trace_that_cannot_be_written_is_refused_before_the_run(scene, tmp_path, capfd, monkeypatch):
    monkeypatch.setattr("os.access", lambda path, mode: False)  # root may write everywhere
    table = tmp_path / "new" / "newton.csv"
    assert main(["run", str(scene), "-q", "-o", str(tmp_path / "out"), "--trace", str(table)]) == ExitCode.INPUT
    assert f"--trace {table}: the folder {tmp_path} cannot be written to" in capfd.readouterr().err
    assert not (tmp_path / "out").exists()
