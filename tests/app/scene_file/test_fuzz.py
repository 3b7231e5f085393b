"""Damaged scene files are still valid or end in a SceneError of one line; never in another exception."""

import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import supple as sp
from supple.app.scene_file.loader import Run, load_run

GOOD = """\
bodies:
  - name: cube
    shape: {kind: box, divisions: [1, 1, 1]}
    material: &m {kind: stable_neo_hookean, youngs: 1e5, poisson: 0.4}
    position: [0, 1, 0]
  - {name: two, shape: {kind: box, divisions: [1, 1, 1]}, material: *m, copies: {offsets: [[2, 0, 0]]}}
obstacles: [{kind: half_space, motion: {times: [0, 1], angles: [0, 1]}}]
pins: [{body: cube, vertices: [0]}]
solver: {kind: xpbd, substeps: 3}
dt: 1/60
"""
TOKENS = re.findall(r"\w+|\s+|[^\w\s]", GOOD)
STRUCTURE = [" ", "\n", ":", "- ", "[", "]", "{", "}", "'", '"', "#", "%", "?", "|", "\t", "[[[", "---\n", ""]
VALUES = ["null", "-1", "1e999", ".nan", "0x", "1/0", "true", "9" * 500, "kind", "bodies", "\x00", "\u2028"]
WORDS = st.sampled_from([*STRUCTURE, *VALUES, "&m ", "*m", "!x ", "<<: *m"])


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz") / "scene.yaml"


def load(path: Path) -> None:
    try:
        run = load_run(path)
    except sp.SuppleError as error:
        message = str(error)
        assert "\n" not in message
        assert message.startswith(str(path))
        assert len(message) < 600
    else:
        assert isinstance(run, Run)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(st.integers(0, len(TOKENS) - 1), WORDS), min_size=1, max_size=3))
def test_with_tokens_replaced(path, changes):
    tokens = list(TOKENS)
    for at, word in changes:
        tokens[at] = word
    path.write_text("".join(tokens), encoding="utf-8")
    load(path)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, len(GOOD)), st.integers(0, 40), st.binary(max_size=12))
def test_with_bytes_replaced(path, at, count, new):
    raw = GOOD.encode()
    path.write_bytes(raw[:at] + new + raw[at + count :])
    load(path)
