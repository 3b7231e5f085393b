"""Stitches in scene files."""

import re

import pytest

import supple as sp
from supple.app.scene_file.loader import load_scene
from supple.model.system import build_system
from supple.scene.stitches.stitch import Stitch

RUBBER = "{kind: stable_neo_hookean, youngs: 1e5, poisson: 0.4}"

STITCHED = f"""
bodies:
  - {{name: low, shape: {{kind: box, divisions: [1, 1, 1]}}, material: {RUBBER}}}
  - {{name: high, shape: {{kind: box, divisions: [1, 1, 1]}}, material: {RUBBER}, position: [0, 1.25, 0]}}
obstacles:
  - {{kind: triangles, name: roof, surface: {{file: roof.obj, position: [0, 2, 0]}}}}
stitches:
"""
STITCH_LINES = {
    "kind: soft_vertex_triangle, first: high, second: low, max_distance: 0.3, youngs: 1e5, poisson: 0.3": 4,
    "kind: soft_vertex_triangle, first: high, second: low, pairs: [[0, 1], [2, 3]], mu: [1, 2], lam: 3": 2,
    "kind: soft_vertex_triangle, first: high, second: roof, max_distance: 0.3, youngs: 1e5, poisson: 0.3": 4,
    "kind: vertex_vertex, first: high, second: low, max_distance: 0.3, pairing: all, stiffness: 10": 4,
    "kind: vertex_vertex, first: high, second: low, max_distance: 0.3, stiffness: 10, strength: [1, 2, 3, 4]": 4,
    "kind: vertex_edge, name: seam, first: high, second: low, pairs: [[0, 1]], stiffness: 10, rest_length: 0": 1,
}


@pytest.mark.parametrize("line", STITCH_LINES)
def test_stitches(load, tmp_path, line):
    sp.shapes.box_surface((4, 1, 4), (1, 1, 1)).save(tmp_path / "roof.obj")
    scene = load(STITCHED + f"  - {{{line}}}\n", load_scene)
    assert len(scene.stitching) == STITCH_LINES[line]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (
            "kind: vertex_vertex, first: hihg, second: low, max_distance: 1, stiffness: 1",
            "body 'hihg' does not exist; did you mean 'high'",
        ),
        ("kind: vertex_edge, first: high, second: low, max_distance: 0.1, stiffness: 1", "smallest distance"),
        (
            "kind: vertex_edge, first: high, second: law, max_distance: 0.1, stiffness: 1",
            "body or obstacle 'law' does not exist",
        ),
        ("kind: vertex_edge, first: high, second: low, max_distance: 0.1, stiffness: 0", "stiffness"),
        ("kind: vertex_edge, first: high, second: low, max_distance: 1, stiffness: 1, strength: 0", "strength"),
        ("kind: vertex_edge, first: high, second: low, max_distance: 1, stiffness: 1, strength: -1", "above 0"),
        (
            "kind: vertex_edge, first: high, second: low, max_distance: 0.3, stiffness: 1, strength: [1, 2]",
            "strength has 2 values for 4 pairs",
        ),
        ("kind: vertex_face, first: high, second: low, max_distance: 0.1", "vertex_face"),
        ("kind: soft_vertex_triangle, first: high, second: low, max_distance: 1, youngs: 1", "youngs and poisson"),
    ],
)
def test_errors_in_stitches_name_their_line(load, tmp_path, line, message):
    sp.shapes.box_surface((4, 1, 4), (1, 1, 1)).save(tmp_path / "roof.obj")
    with pytest.raises(sp.SceneError) as caught:
        load(STITCHED + f"  - {{{line}}}\n")
    assert re.search(r"scene.yaml:8:", str(caught.value))
    assert message in str(caught.value)


def test_pairs_are_found_once_by_the_names_in_the_scene(load, tmp_path, monkeypatch):
    searched, find = [], Stitch.find
    monkeypatch.setattr(Stitch, "find", lambda self, *sides: (searched.append(self.name), find(self, *sides))[1])
    sp.shapes.box_surface((4, 1, 4), (1, 1, 1)).save(tmp_path / "roof.obj")
    soft = "kind: soft_vertex_triangle, first: high, max_distance: 0.3, youngs: 1e5, poisson: 0.3"
    nameless = STITCHED.replace("name: roof, ", "")
    run = load(
        nameless + f"  - {{name: a, {soft}, second: low}}\n  - {{name: b, {soft}, second: TriangleObstacle 1}}\n"
    )
    assert len(build_system(run.scene).stitching) == 8
    assert searched == ["a", "b"]


@pytest.mark.parametrize(
    "pairs", ["[[0, 1, 2]]", "[[0]]", "[]", "[[0, 1.5]]", "[[0, -1]]", "[[0, 99]]", "[[0, 1], [0, 1]]", "7"]
)
def test_wrong_pairs_are_errors_that_name_their_line(load, tmp_path, pairs):
    sp.shapes.box_surface((4, 1, 4), (1, 1, 1)).save(tmp_path / "roof.obj")
    line = f"first: high, second: low, pairs: {pairs}, youngs: 1, poisson: 0.3"
    with pytest.raises(sp.SceneError) as caught:
        load(
            STITCHED + "  - {kind: vertex_vertex, first: high, second: low, pairs: [[0, 0]], stiffness: 1}\n"
            f"  - {{kind: soft_vertex_triangle, {line}}}\n"
        )
    assert re.search(r"scene.yaml:9:", str(caught.value))


def test_strengths_of_a_file_are_those_of_the_pairs(load):
    one = "kind: vertex_vertex, first: high, second: low, max_distance: 0.3, stiffness: 10, strength: "
    before, after = STITCHED.split("obstacles:")
    text = before + after[after.index("stitches:") :]
    scene = load(f"{text}  - {{{one}2.5}}\n  - {{{one}[1, 2, 3, 4]}}\n  - {{{one}null}}\n", load_scene)
    assert scene.stitching.names.strength.tolist() == [2.5] * 4 + [1.0, 2.0, 3.0, 4.0] + [float("inf")] * 4
