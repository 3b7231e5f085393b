"""An error in a scene file is one line: the place, the fault, and the remedy."""

import pytest

import supple as sp
from supple.app.scene_file.loader import load_run

GOOD = """\
bodies:
  - name: cube
    shape: {kind: box, divisions: [1, 1, 1]}
    material:
      kind: stable_neo_hookean
      youngs: 1e5
      poisson: 0.4
    position: [0, 1, 0]
obstacles:
  - {kind: half_space}
pins:
  - {body: cube, vertices: [0]}
dt: 1/60
steps: 5
"""

# text to replace, its replacement, and the start of the error: line, key, words
CASES = [
    ("youngs: 1e5", "yungs: 1e5", "6: bodies[0].material.yungs: unknown key; did you mean 'youngs'?"),
    ("position:", "postion:", "8: bodies[0].postion: unknown key; did you mean 'position'?"),
    ("dt: 1/60", "dt: 1e-300", "13: dt: is 1e-300; it must be at least 1e-30"),
    ("dt: 1/60", "colour: red", "13: colour: unknown key; there are 'supple', 'bodies'"),
    (
        "kind: stable_neo_hookean",
        "kind: StableNeoHookean",
        "5: bodies[0].material.kind: unknown kind 'StableNeoHookean'",
    ),
    (
        "kind: stable_neo_hookean",
        "kind: stable neo hookean",
        "5: bodies[0].material.kind: unknown kind 'stable neo hookean'; did you mean 'stable_neo_hookean'?",
    ),
    ("      kind: stable_neo_hookean\n", "", "4: bodies[0].material: the key `kind` is missing"),
    ("      youngs: 1e5\n", "", "4: bodies[0].material: the key `youngs` is missing; add it"),
    ("  - name: cube\n    shape", "  - shape", "2: bodies[0]: the key `name` is missing"),
    ("youngs: 1e5", "youngs: '1e5'", "6: bodies[0].material.youngs: is the text '1e5'; remove the quotes"),
    ("youngs: 1e5", "youngs: soft", "6: bodies[0].material.youngs: is the text 'soft'; give a number"),
    ("youngs: 1e5", "youngs:", "6: bodies[0].material.youngs: is empty; give a number"),
    ("youngs: 1e5", "youngs: -2", "6: bodies[0].material.youngs: is -2; it must be above 0"),
    ("youngs: 1e5", "youngs: true", "6: bodies[0].material.youngs: is true; give a number"),
    ("poisson: 0.4", "poisson: 0.5", "7: bodies[0].material.poisson: is 0.5; it must be below 0.5"),
    ("[0, 1, 0]", "[0, 1]", "8: bodies[0].position: has 2 values; give at least 3"),
    ("[0, 1, 0]", "[0, up, 0]", "8: bodies[0].position[1]: is the text 'up'; give a number"),
    ("[0, 1, 0]", "[0, 1e300, 0]", "8: bodies[0].position: body 'cube': position is 1e+300 m from the origin"),
    ("[1, 1, 1]}", "[1, -1, 1]}", "3: bodies[0].shape.divisions[1]: is -1; it must be at least 1"),
    (
        "[1, 1, 1]}",
        "[1, 1000000000000000000000000, 1]}",
        "3: bodies[0].shape.divisions[1]: is 1000000000000000000000000; ",
    ),
    ("[1, 1, 1]}", "[1000000, 1000000, 1000000]}", "3: bodies[0].shape.divisions: box"),
    ("{kind: box, divisions: [1, 1, 1]}", "box", "3: bodies[0].shape: is the text 'box'; give keys and values"),
    ("{kind: box, ", "{kind: cube, ", "3: bodies[0].shape.kind: unknown kind 'cube'; there are 'box', 'sphere'"),
    ("    shape: {kind: box, divisions: [1, 1, 1]}\n", "", "2: bodies[0]: a body needs either `mesh` or `shape`"),
    ("    position", "    mesh: {file: a.stl}\n    position", "2: bodies[0]: a body needs either `mesh` or `shape`"),
    ("shape: {kind: box, divisions: [1, 1, 1]}", "mesh: {file: absent.stl}", "3: bodies[0].mesh.file: "),
    ("shape: {kind: box, divisions: [1, 1, 1]}", "mesh: {file: absent.ele}", "3: bodies[0].mesh.file: "),
    ("shape: {kind: box, divisions: [1, 1, 1]}", "mesh: {file: .}", "3: bodies[0].mesh.file: "),
    ("shape: {kind: box, divisions: [1, 1, 1]}", "mesh: {file: a.xyz}", "3: bodies[0].mesh.file: "),
    (
        "shape: {kind: box, divisions: [1, 1, 1]}",
        "mesh: {file: a.msh, quality: 2}",
        "3: bodies[0].mesh.file: ",
    ),
    ("name: cube", "name: a/b", "2: bodies[0].name: body 'a/b': a name is at most"),
    ("name: cube", "name: 7", "2: bodies[0].name: is 7; give a text"),
    (
        "obstacles:",
        "  - {name: cube, shape: {kind: box}, material: {kind: arap, youngs: 1, poisson: 0}}\nobstacles:",
        "9: bodies[1].name: another body has the name 'cube'",
    ),
    (
        "{kind: half_space}",
        "{kind: half_space, normal: [0, 0, 0]}",
        "10: obstacles[0].normal: HalfSpace: normal has no length",
    ),
    (
        "{kind: half_space}",
        "{kind: halfspace}",
        "10: obstacles[0].kind: unknown kind 'halfspace'; did you mean 'half_space'?",
    ),
    ("{kind: half_space}", "floor", "10: obstacles[0]: is the text 'floor'; give keys and values"),
    (
        "{kind: half_space}",
        "{kind: triangles, surface: {}}",
        "10: obstacles[0].surface: a surface needs either `file` or `shape`",
    ),
    (
        "{kind: half_space}",
        "{kind: half_space, motion: {times: [0, 0], angles: [0, 1]}}",
        "10: obstacles[0].motion.times: Keyframes: times[1]",
    ),
    (
        "{kind: half_space}",
        "{kind: half_space, name: cube}",
        "10: obstacles[0].name: body 'cube' and obstacle 'cube' have the same name; give",
    ),
    ("body: cube", "body: cub", "12: pins[0].body: pin of body 'cub': body 'cub' does not exist; did you mean 'cube'?"),
    ("vertices: [0]", "vertices: [8]", "12: pins[0].vertices: pin of body 'cube': vertex 8 does not exist"),
    (", vertices: [0]", "", "12: pins[0]: pin of body 'cube': give the vertices by either `vertices` or `box`"),
    (
        "vertices: [0]}",
        "vertices: [0]}\n  - {body: cube, vertices: [0]}",
        "13: pins[1].vertices: pin of body 'cube': vertex 0 is already held by another pin",
    ),
    (
        "dt: 1/60",
        "soft_targets: [{body: ball, vertices: [0], stiffness: 1}]",
        "13: soft_targets[0].body: soft target of body 'ball': body 'ball' does not exist; there are 'cube'",
    ),
    (
        "dt: 1/60",
        "contact_pairs: [{first: cube, second: cube}]",
        "13: contact_pairs[0]: contact pair of 'cube' and 'cube': it has no effect; give `friction`, or `collide` as ",
    ),
    (
        "dt: 1/60",
        "contact_pairs:\n  - {first: cube, second: '*1', friction: 1}\n  - {first: cub, second: cube, friction: 1}",
        "15: contact_pairs[1].first: contact pair of 'cub' and 'cube': first: body or obstacle 'cub' does not exist; "
        "did you mean 'cube'?",
    ),
    ("dt: 1/60", "contact_pairs: [{first: 7, second: cube}]", "13: contact_pairs[0].first: give a name, or a list"),
    ("1/60", "1/0", "13: dt: is the text '1/0'; give a number"),
    ("steps: 5", "steps: 2.5", "14: steps: is 2.5; give a whole number"),
    ("steps: 5", "steps: 99999999999999999999999999", "14: steps: is 99999999999999999999999999; it must be at most"),
    ("steps: 5", "solver: {kind: xpdb}", "14: solver.kind: unknown kind 'xpdb'; did you mean 'xpbd'?"),
    ("steps: 5", "solver: xpbd", "14: solver: is the text 'xpbd'; give keys and values"),
    ("steps: 5", "gravity: down", "14: gravity: is the text 'down'; give a list"),
    ("steps: 5", "supple: 2", "14: supple: is 2; there are '1'"),
    ("    position: [0, 1, 0]", "    copies: {}", "8: bodies[0].copies: copies need either `offsets` or `grid`"),
    (
        "    position: [0, 1, 0]",
        "    copies: {grid: [100, 100, 100], spacing: [1, 1, 1]}",
        "8: bodies[0].copies: grid [100, 100, 100] makes more",
    ),
    (
        "    position: [0, 1, 0]",
        "    initial: {scale: [1, 0, 1]}",
        "8: bodies[0].initial.scale[1]: is 0; it must be above 0",
    ),
    (GOOD, "[1, 2]\n", "1: is a list of 2; give keys and values"),
    (GOOD, "just text\n", "1: is the text 'just text'; give keys and values"),
    (GOOD, "bodies: []\n", "1: bodies: has 0 values; give at least 1"),
    (GOOD, "steps: 3\n", "1: the key `bodies` is missing; add it"),
]


@pytest.fixture
def scene_file(tmp_path):
    return tmp_path / "scene.yaml"


def test_the_unchanged_file_is_valid(scene_file):
    scene_file.write_text(GOOD)
    assert len(load_run(scene_file).scene.bodies) == 1


@pytest.mark.parametrize(("old", "new", "expected"), CASES, ids=[expected[:60] for _, _, expected in CASES])
def test_errors_are_one_line_with_place_and_fault(scene_file, old, new, expected):
    assert GOOD.count(old) == 1
    scene_file.write_text(GOOD.replace(old, new))
    with pytest.raises(sp.SceneError) as caught:
        load_run(scene_file)
    message = str(caught.value)
    assert message.startswith(f"{scene_file}:{expected}")
    assert "\n" not in message


def test_the_first_of_several_problems_is_reported_and_the_others_are_counted(scene_file):
    scene_file.write_text(GOOD.replace("youngs: 1e5", "youngs: -1").replace("steps: 5", "steps: x"))
    with pytest.raises(sp.SceneError, match=r":6: bodies\[0\]\.material\.youngs: .* \(and 1 more\)$"):
        load_run(scene_file)
