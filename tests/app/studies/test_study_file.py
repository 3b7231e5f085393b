"""Study files: what they mean, and errors with file, line and key."""

import pytest
import yaml
from jsonschema import Draft202012Validator

import supple as sp
from supple.app.studies.factors import Factor
from supple.app.studies.study_file import study_schema

from .conftest import SCENE

STUDY = """\
scene: fall.yaml
factors:
  gravity.1: [-1.0, -2.0]
  size: {paths: [bodies.cube.shape.size.0, bodies.cube.shape.size.1], loguniform: [0.1, 1], count: 2}
design: {kind: grid}
measures:
  drop: {quantity: displacement, body: cube, axis: y}
  energy: {quantity: kinetic_energy, time: max}
"""


@pytest.fixture
def write(tmp_path):
    (tmp_path / "fall.yaml").write_text(SCENE, encoding="utf-8")

    def written(text):
        (tmp_path / "study.yaml").write_text(text, encoding="utf-8")
        return tmp_path / "study.yaml"

    return written


def test_the_contents_of_a_study_file(write):
    study = sp.studies.load_study(write(STUDY))
    assert study.factors == {
        "gravity.1": Factor(values=(-1.0, -2.0)),
        "size": Factor(loguniform=(0.1, 1.0), count=2, paths=("bodies.cube.shape.size.0", "bodies.cube.shape.size.1")),
    }
    assert study.design == sp.studies.Grid()
    assert study.units == {"gravity.1": "m/s^2", "size": "m", "drop": "m", "energy": "J"}
    assert len(study.design.points(study.factors)) == 4
    assert Draft202012Validator(study_schema()).is_valid(yaml.safe_load(STUDY))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("scene: fall.yaml", "scenes: fall.yaml"),
        ("[-1.0, -2.0]", "[]"),
        ("loguniform: [0.1, 1]", "loguniform: [0.1]"),
        ("count: 2", "counts: 2"),
        ("kind: grid", "kind: grids"),
        ("quantity: kinetic_energy", "quantity: heat"),
        ("axis: y", "axis: w"),
    ],
)
def test_the_schema_rejects_what_the_loader_rejects(write, old, new):
    assert old in STUDY
    text = STUDY.replace(old, new)
    assert not Draft202012Validator(study_schema()).is_valid(yaml.safe_load(text))
    with pytest.raises(sp.SuppleError):
        sp.studies.load_study(write(text))


@pytest.mark.parametrize(
    ("text", "design"),
    [
        ("{kind: latin_hypercube, samples: 8, seed: 2}", sp.studies.LatinHypercube(8, 2)),
        ("{kind: grid}", sp.studies.Grid()),
    ],
)
def test_designs(write, text, design):
    assert sp.studies.load_study(write(STUDY.replace("{kind: grid}", text))).design == design


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("scene: fall.yaml\n", "", "study.yaml:1: the key `scene` is missing"),
        ("fall.yaml", "absent.yaml", "absent.yaml: the file does not exist"),
        ("{kind: grid}", "{kind: gird}", "study.yaml:5: design.kind: unknown kind 'gird'; did you mean 'grid'"),
        ("{kind: grid}", "{kind: latin_hypercube, samples: 0}", "study.yaml:5: design.samples: is 0"),
        ("[-1.0, -2.0]", "[]", r"study.yaml:3: factors.gravity.1.values: has 0 values"),
        ("[-1.0, -2.0]", "3", r"study.yaml:3: factors.gravity.1: is 3; give keys and values"),
        (", count: 2", ", values: [1]", "study.yaml:4: factors.size: .* give exactly one of"),
        ("[0.1, 1]", "[1, 0.1]", "study.yaml:4: factors.size: .* the lower one first"),
        ("quantity: kinetic_energy", "quantity: kinetic", "study.yaml:8: measures.energy"),
        ("axis: y", "axes: y", "study.yaml:7: measures.drop.axes: unknown key; did you mean 'axis'"),
        ("measures:", "measure:", "study.yaml:6: measure: unknown key; did you mean 'measures'"),
    ],
)
def test_a_study_file_that_is_wrong_is_one_line_with_its_place(write, old, new, words):
    assert old in STUDY
    with pytest.raises(sp.SuppleError, match=words):
        sp.studies.load_study(write(STUDY.replace(old, new)))
