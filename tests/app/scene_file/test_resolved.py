"""A scene file as resolved: complete in itself, and the same scene bit by bit."""

from pathlib import Path

import pytest

import supple as sp
from supple.app.scene_file.resolved import resolved_scene
from supple.model.system import build_system
from supple.results.checkpoint.scene_hash import scene_hash

EXAMPLES = Path(__file__).parents[3] / "examples" / "scenes"
RICH = """\
bodies:
  - name: "1e5"
    mesh: {file: meshes/bar.1.node, scale: 0.1}
    material: {kind: neo_hookean, youngs: 12345.678901234567, poisson: 0.3, damping: 1e-3}
    skin: {file: meshes/skin.stl, scale: 0.1}
    position: [0, 1.0000000000000002, 5.0e-324]
    copies: {offsets: [[0, 0, 0], [0, 3, 0]], rotations: [[0.1, 0, 0], [0, 0, 0.3]]}
  - name: "null"
    mesh: {file: meshes/ball.stl, max_volume: 0.01}
    material: {kind: edges_and_volume, edge_compliance: 1e-6, volume_compliance: 0}
    position: [3, 1, 0]
    initial: {scale: [1, 0.5, 1]}
obstacles:
  - {kind: half_space, name: "0x10"}
  - {kind: triangles, surface: {file: meshes/skin.stl, position: [0, -3, 0]}}
  - kind: sphere
    center: [0, -5, 0]
    radius: 0.3
    motion: {times: [0, 1], displacements: [[0, 0, 0], [1, 0, 0]]}
pins: [{body: "1e501", vertices: [0, 1], motion: {times: [0, 1], angles: [0, 1]}}]
forces: [{body: "1e502", vertices: [0], force: [0, 0, 0.1]}]
soft_targets: [{body: "null", box: {low: [-9, -9, -9], high: [9, 9, 9]}, stiffness: 0.3}]
contact_pairs: [{first: "null", second: "1e501", friction: 0.7}]
gravity: [0, -1.6e-300, 0]
solver: {kind: xpbd, contact: null}
dt: 1/60
steps: 7
output: {plot: false}
"""


@pytest.fixture
def rich(tmp_path):
    (tmp_path / "meshes").mkdir()
    sp.shapes.box((2, 1, 1), (2, 1, 1)).save(tmp_path / "meshes" / "bar.1.node")
    sp.shapes.box_surface((1.9, 0.9, 0.9), (1, 1, 1)).save(tmp_path / "meshes" / "skin.stl")
    sp.shapes.sphere_surface(0.5, 0.3).save(tmp_path / "meshes" / "ball.stl")
    path = tmp_path / "rich.yaml"
    path.write_text(RICH)
    return path


def written(run, folder, **options):
    for name, content in resolved_scene(run, **options).items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.read_bytes() if isinstance(content, Path) else content.encode())
    return sp.load_run(folder / "scene.yaml")


def fingerprint(run):
    return scene_hash(build_system(run.scene), 0.0, run.steps * run.dt)


def test_a_rich_scene_comes_back_with_the_same_bits(rich, tmp_path):
    run = sp.load_run(rich)
    again = written(run, tmp_path / "copy", solver=None, dt=run.dt, steps=run.steps)
    assert fingerprint(again) == fingerprint(run)
    assert (again.solver, again.dt, again.steps, again.output) == (run.solver, run.dt, run.steps, run.output)
    assert again.initial_positions.keys() == run.initial_positions.keys() == {"null"}
    assert (again.initial_positions["null"] == run.initial_positions["null"]).all()
    assert again.description.model_dump(exclude={"bodies", "obstacles"}) == run.description.model_dump(
        exclude={"bodies", "obstacles"}
    )
    files = sorted(str(path.relative_to(tmp_path / "copy")) for path in (tmp_path / "copy").rglob("*.*"))
    names = ["0/bar.1.edge", "0/bar.1.ele", "0/bar.1.face", "0/bar.1.node", "1/skin.stl", "2/ball.stl"]
    assert [name for name in files if name.startswith("inputs")] == [f"inputs/{name}" for name in names]
    # It does not depend on the place it was made from, and resolving it again changes nothing.
    for path in (tmp_path / "meshes").iterdir():
        path.unlink()
    twice = written(again, tmp_path / "twice", solver=None, dt=run.dt, steps=run.steps)
    assert twice.text == again.text
    assert fingerprint(twice) == fingerprint(run)


@pytest.mark.parametrize("name", sorted(path.name for path in EXAMPLES.glob("*.yaml")))
def test_the_examples_come_back(tmp_path, name):
    run = sp.load_run(EXAMPLES / name)
    again = written(run, tmp_path, solver=None, dt=run.dt, steps=run.steps)
    assert fingerprint(again) == fingerprint(run)
    assert again.solver == run.solver


def test_the_options_of_the_command_are_in_it(rich, tmp_path):
    again = written(sp.load_run(rich), tmp_path / "copy", solver="implicit", dt=0.1 + 0.2, steps=3)
    assert (again.solver, again.dt, again.steps) == (sp.Implicit(), 0.1 + 0.2, 3)


CHANGES = {
    "youngs: 12345.678901234567": "youngs: 12345.678901234565",
    "position: [0, 1.0000000000000002": "position: [0, 1.0",
    "displacements: [[0, 0, 0], [1, 0, 0]]": "displacements: [[0, 0, 0], [1, 0, 1e-9]]",
    "angles: [0, 1]": "angles: [0, 1.1]",
    "stiffness: 0.3": "stiffness: 0.4",
    "friction: 0.7": "friction: 0.8",
    "force: [0, 0, 0.1]": "force: [0, 0, 0.2]",
    "radius: 0.3": "radius: 0.31",
    "vertices: [0, 1]": "vertices: [0, 2]",
    "scale: 0.1}\n    material": "scale: 0.11}\n    material",
    "gravity: [0, -1.6e-300": "gravity: [0, -1.7e-300",
    "volume_compliance: 0": "volume_compliance: 1e-30",
}


@pytest.mark.parametrize("text", CHANGES)
def test_every_change_of_the_scene_changes_its_hash(rich, text):
    before = fingerprint(sp.load_run(rich))
    assert RICH.count(text) == 1
    rich.write_text(RICH.replace(text, CHANGES[text]))
    assert fingerprint(sp.load_run(rich)) != before


def test_functions_of_time_are_compared_by_their_values():
    mesh = sp.shapes.box((1, 1, 1), (1, 1, 1))
    body = sp.Body("b", mesh, sp.StableNeoHookean(youngs=1e5, poisson=0.3))

    def hash_of(speed, target=1.0, pull=1.0, moves=1.0):
        scene = sp.Scene(
            [body],
            obstacles=[sp.obstacles.Sphere(radius=0.1, center=(0, 9, 0), motion=lambda time: (moves * time, 0, 0))],
            pins=[sp.Pin("b", [0], lambda time: (speed * time, 0, 0))],
            forces=[sp.Force("b", [1], lambda time: (0, pull * time, 0))],
            soft_targets=[sp.SoftTarget("b", [2], 5.0, lambda time: (0, target * time, 0))],
        )
        return scene_hash(build_system(scene), 0.0, 1.0)

    hashes = [hash_of(1.0), hash_of(2.0), hash_of(1.0, 2.0), hash_of(1.0, 1.0, 2.0), hash_of(1.0, 1.0, 1.0, 2.0)]
    assert len(set(hashes)) == 5
    assert hash_of(1.0) == hashes[0]
