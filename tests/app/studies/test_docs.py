"""The files and the program of docs/reference/studies.md."""

import re
from pathlib import Path

import supple as sp
from supple.app.scene_file.loader import load_run

PAGE = (Path(__file__).parents[3] / "docs" / "reference" / "studies.md").read_text(encoding="utf-8")


def test_the_files_of_the_page(tmp_path):
    scene, study = re.findall(r"^```yaml\n(.*?)^```", PAGE, flags=re.S | re.M)
    (tmp_path / "bar.yaml").write_text(scene, encoding="utf-8")
    (tmp_path / "study.yaml").write_text(study, encoding="utf-8")
    assert load_run(tmp_path / "bar.yaml").steps == 10
    described = sp.studies.load_study(tmp_path / "study.yaml")
    points = described.design.points(described.factors)
    assert len(points) == 12
    for point in points:
        case = described.source(
            {path: point[name] for name in point for path in described.factors[name].paths or [name]}
        )
        assert case.refusal == ""


def test_the_program_of_the_page_runs(tmp_path, monkeypatch):
    program, *_ = re.findall(r"^```python\n(.*?)^```", PAGE, flags=re.S | re.M)
    monkeypatch.chdir(tmp_path)
    exec(compile(program, "studies.md", "exec"), {"__name__": "studies"})  # a name that workers cannot import
    lines = (tmp_path / "slide" / "table.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "case,youngs [Pa],friction,measure [m],status,reason"
    assert len(lines) == 7
    assert all(",done," in line for line in lines[1:])
