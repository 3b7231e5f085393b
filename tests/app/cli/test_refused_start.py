"""A scene that the solver refuses leaves the outputs of an earlier run as they are."""

import pytest

from supple.app.cli.app import main
from supple.app.cli.console import ExitCode

MATERIAL = "material: {kind: stable_neo_hookean, youngs: 1e5, poisson: 0.3}"
CUBE = "shape: {kind: box, size: [1, 1, 1], divisions: [1, 1, 1]}, " + MATERIAL
REFUSED = {
    "overlapping bodies": "{name: second, position: [0.2, 0.6, 0], " + CUBE + "}",
    "a body inside another": "{name: second, position: [0, 0.6, 0], shape: {kind: box, size: [0.2, 0.2, 0.2]}, "
    + MATERIAL
    + "}",
    "touching bodies": "{name: second, position: [0, 1.6, 0], " + CUBE + "}",
}


def _text(bodies):
    items = "".join(f"  - {body}\n" for body in bodies)
    return f"bodies:\n{items}gravity: [0, 0, 0]\nsolver: {{kind: implicit}}\ndt: 0.01\nsteps: 2\n"


def _contents(folder):
    return {path.name: (path.read_bytes(), path.stat().st_mtime_ns) for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def good_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.yaml").write_text(_text(["{name: first, position: [0, 0.6, 0], " + CUBE + "}"]))
    assert main(["run", "good.yaml", "-o", "out", "-q"]) == ExitCode.OK
    return tmp_path


def test_the_files_of_an_earlier_run_stay_as_they_are(good_run, capfd):
    before = _contents(good_run / "out")
    assert set(before) > {"recording.vtkhdf", "index.html", "plot.png", "run.json", "00000002.checkpoint"}
    for name, second in REFUSED.items():
        (good_run / "bad.yaml").write_text(_text(["{name: first, position: [0, 0.6, 0], " + CUBE + "}", second]))
        capfd.readouterr()
        assert main(["run", "bad.yaml", "-o", "out", "--overwrite"]) == ExitCode.INPUT, name
        out, err = capfd.readouterr()
        assert out == ""
        assert err.startswith("supple: ")
        assert err.count("\n") == 1
        assert _contents(good_run / "out") == before


def test_they_stay_where_bodies_cannot_be_separated(good_run, capfd):
    before = _contents(good_run / "out")
    body = "{name: %s, position: [0, 0.6, 0], " + CUBE + "}"
    (good_run / "bad.yaml").write_text(_text([body % "first", body % "second"]))
    assert main(["run", "bad.yaml", "-o", "out", "--overwrite", "--separate"]) == ExitCode.INPUT
    assert "cannot be separated" in capfd.readouterr().err
    assert _contents(good_run / "out") == before
