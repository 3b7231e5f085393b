"""Dotted paths into scene files, their units, and writing scene files."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import supple as sp
from supple.app.scene_file.paths import unit_of, with_values
from supple.app.scene_file.yaml_files import read_yaml, yaml_text

DATA = {"bodies": [{"name": "bear", "material": {"youngs": 1.0}}, {"name": "hat"}], "gravity": [0, -9.81, 0], "dt": 0.1}


def test_values_are_set_in_a_copy():
    changed = with_values(
        DATA, {"bodies.bear.material.youngs": 5, "gravity.1": -1, "solver.kind": "xpbd", "bodies.1.name": "cap"}
    )
    assert changed["bodies"] == [{"name": "bear", "material": {"youngs": 5}}, {"name": "cap"}]
    assert changed["gravity"] == [0, -1, 0]
    assert changed["solver"] == {"kind": "xpbd"}
    assert DATA["bodies"][0]["material"]["youngs"] == 1.0
    assert "solver" not in DATA


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("bodies.beer.material.youngs", "bodies has no entry 'beer'; did you mean 'bear'"),
        ("bodies.2.name", "bodies has no entry '2'"),
        ("gravity.3", "gravity has no entry '3'"),
        ("gravity.-1", "gravity has no entry '-1'"),
        ("dt.x", "dt is a single value"),
        ("bodies.bear.name.x.y", "bodies.bear.name is a text"),
    ],
)
def test_a_path_to_nowhere_is_refused(path, words):
    with pytest.raises(sp.SceneError, match=words) as caught:
        with_values(DATA, {path: 1})
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize(
    ("path", "unit"),
    [
        ("bodies.bear.material.youngs", "Pa"),
        ("bodies.0.material.density", "kg/m^3"),
        ("bodies.bear.shape.size.0", "m"),
        ("bodies.bear.position.1", "m"),
        ("gravity.1", "m/s^2"),
        ("dt", "s"),
        ("solver.contact.dhat", "m"),
        ("solver.substeps", ""),
        ("no.such.path", ""),
    ],
)
def test_units_are_those_of_the_format_s_description(path, unit):
    assert unit_of(path) == unit


AMBIGUOUS = ["1e5", "0o7", "null", "~", "1:30", "no", "0x1f", ".nan", "- a", "#", "5.", "\x85", "\u2028 "]
TEXTS = st.one_of(st.text(max_size=12), st.sampled_from(AMBIGUOUS))
NUMBERS = st.one_of(st.integers(-(2**62), 2**62), st.floats(allow_nan=False, allow_infinity=False))
VALUES = st.recursive(
    st.one_of(st.none(), st.booleans(), NUMBERS, TEXTS),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(TEXTS, inner, max_size=4)),
    max_leaves=12,
)


@settings(max_examples=150, deadline=None)
@given(st.dictionaries(TEXTS, VALUES, min_size=1, max_size=4))
def test_what_is_written_is_read_back_unchanged(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("written") / "scene.yaml"
    path.write_text(yaml_text(data), encoding="utf-8", newline="")
    read = read_yaml(path).data
    assert read == data
    assert repr(read) == repr(data)  # 1 and 1.0 and True are equal, but not the same
