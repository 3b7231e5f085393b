"""From scene file to scene and run."""

import importlib.util
import json
import logging
import re
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator

import supple as sp
from supple.app.scene_file.document import json_schema, scene_file_model
from supple.app.scene_file.loader import load_scene
from supple.app.scene_file.yaml_files import read_yaml
from supple.materials.elastic import ELASTIC_MATERIALS
from supple.scene.contact_pairs import pair_table
from supple.scene.registry import PARTS
from supple.solvers.auto import Auto
from supple.solvers.registry import solver_of_kind

ROOT = Path(__file__).parents[3]
RUBBER = "{kind: stable_neo_hookean, youngs: 1e5, poisson: 0.4}"
BODY = f"{{name: cube, shape: {{kind: box, divisions: [1, 1, 1]}}, material: {RUBBER}}}"


EVERYTHING = f"""
supple: 1
bodies:
  - name: ball
    shape: {{kind: sphere, radius: 0.5, edge_length: 0.25}}
    material: &rubber {{kind: stable_neo_hookean, youngs: 1e5, poisson: 0.4, density: 900, damping: 0.01}}
    position: [0, 2, 0]
    rotation: [0, 1.5707963267948966, 0]
    velocity: [1, 0, 0]
    angular_velocity: [0, 3, 0]
    friction: 0.3
    skin: {{shape: {{kind: sphere, radius: 0.5, edge_length: 0.1}}}}
  - name: block
    shape: {{kind: box, size: [1, 0.5, 0.5], divisions: [2, 1, 1]}}
    material: {{kind: edges_and_volume, edge_compliance: 1e-5}}
    position: [3, 1, 0]
    initial: {{scale: [1, 0.5, 1]}}
  - {{name: pea, shape: {{kind: cylinder, radius: 0.2, height: 0.4}}, material: *rubber,
     copies: {{grid: [2, 1, 3], spacing: [1, 0, 2]}}}}
  - {{name: ring, shape: {{kind: torus}}, material: {RUBBER}, copies: {{offsets: [[0, 5, 0], [0, 9, 0]],
     rotations: [[0, 0, 0], [1, 0, 0]]}}}}
obstacles:
  - {{kind: half_space, name: floor, point: [0, -1, 0], normal: [0, 2, 0], friction: 0.5}}
  - {{kind: box, center: [1, 1, 1], size: [9, 9, 9], rotation: [0, 0, 0.1], inside: true}}
  - {{kind: sphere, center: [0, 1, 0], radius: 8, inside: true,
     motion: {{times: [0, 1], displacements: [[0, 0, 0], [0, 1, 0]]}}}}
  - {{kind: capsule, name: log, start: [0, -6, 0], end: [0, -6, 3], radius: 0.5, friction: 0.2}}
  - {{kind: cylinder, start: [20, 0, 0], end: [20, 3, 0], radius: 2,
     motion: {{times: [0, 1], angles: [0, 1], axis: [0, 1, 0], pivot: [20, 0, 0]}}}}
  - {{kind: triangles, surface: {{shape: {{kind: torus, radius: 2}}, scale: 2, position: [0, 0, 1]}},
     motion: {{times: [0, 2], angles: [0, 3], axis: [0, 1, 0], pivot: [1, 0, 0]}}}}
pins:
  - {{body: ball, vertices: [0, 3]}}
  - {{body: block, box: {{low: [2, 0, -1], high: [2.6, 2, 1]}}, name: left,
     motion: {{times: [0, 1], displacements: [[0, 0, 0], [-1, 0, 0]]}}}}
forces:
  - {{body: ball, vertices: [5, 6], force: [0, 3, 0]}}
soft_targets:
  - {{body: ball, box: {{low: [-9, -9, -9], high: [9, 9, 9]}}, stiffness: 40,
     motion: {{times: [0, 1], displacements: [[0, 0, 0], [0, 0, 1]]}}}}
gravity: [0, -1.62, 0]
solver: {{kind: xpbd, substeps: 7, momentum_restore: false, threads: 1}}
dt: 1/30
steps: 12
output: {{page: false}}
"""


def test_a_scene_file_covers_the_whole_api(load):
    run = load(EVERYTHING)
    scene = run.scene
    peas = [f"pea{k:02d}" for k in range(1, 7)]
    assert [body.name for body in scene.bodies] == ["ball", "block", *peas, "ring01", "ring02"]
    ball = scene.body("ball")
    assert isinstance(ball.material, sp.StableNeoHookean)
    assert (ball.material.youngs, ball.material.poisson, ball.material.density) == (1e5, 0.4, 900.0)
    np.testing.assert_allclose(ball.angular_velocity, [0, 3, 0])
    assert (ball.friction, ball.skin is not None) == (0.3, True)
    np.testing.assert_allclose(np.linalg.norm(ball.skin.vertices, axis=1), 0.5)
    assert isinstance(scene.body("block").material, sp.EdgesAndVolume)
    corners = [np.asarray(scene.body(name).position).tolist() for name in peas]
    assert sorted(corners) == [[x, 0, z] for x in (0.0, 1.0) for z in (0.0, 2.0, 4.0)]
    assert len({id(scene.body(name).mesh) for name in peas}) == 1
    np.testing.assert_allclose(scene.body("ring02").rotation, [1, 0, 0])
    np.testing.assert_allclose(scene.body("ring02").position, [0, 9, 0])

    floor, room, bowl, log, drum, ring = scene.obstacles
    assert isinstance(floor, sp.HalfSpace)
    np.testing.assert_allclose(np.asarray(floor.normal), [0, 1, 0])
    assert isinstance(room, sp.obstacles.Box)
    assert room.inside
    assert isinstance(bowl, sp.obstacles.Sphere)
    np.testing.assert_allclose(bowl.pose(0.5)[1], [0, 0.5, 0])
    assert isinstance(log, sp.obstacles.Capsule)
    assert (log.name, log.radius, log.friction, log.inside) == ("log", 0.5, 0.2, False)
    np.testing.assert_array_equal(log.end, [0, -6, 3])
    assert isinstance(drum, sp.obstacles.Cylinder)
    np.testing.assert_allclose(drum.pose(1.0)[0][0, 0], np.cos(1.0))
    assert isinstance(ring, sp.obstacles.TriangleObstacle)
    assert ring.surface is not None
    np.testing.assert_allclose(ring.surface.bounds[1], [4.4, 0.4, 5.4], atol=0.05)

    assert scene.pins[1].name == "left"
    np.testing.assert_allclose(scene.forces[0].per_vertex(0.0, 2), [[0, 1.5, 0], [0, 1.5, 0]])
    assert scene.soft_targets[0].stiffness == 40.0
    np.testing.assert_allclose(scene.gravity, [0, -1.62, 0])
    assert (run.dt, run.steps) == (1 / 30, 12)
    assert (run.solver.substeps, run.solver.momentum_restore, run.solver.threads) == (7, False, 1)
    assert (run.output.page, run.output.plot) == (False, True)


def test_a_compressed_start_keeps_its_center_and_its_widths(load):
    run = load(EVERYTHING)
    placed = run.scene.body("block").place(run.scene.body("block").mesh.vertices)
    np.testing.assert_allclose(run.start["initial_positions"]["block"] - [3, 1, 0], (placed - [3, 1, 0]) * [1, 0.5, 1])
    assert sorted(run.initial_positions) == ["block"]


def test_parameters_of_both_solvers(load):
    solver = load(
        f"bodies: [{BODY}]\nsolver: {{kind: xpbd, contact: {{thickness: 0.01, self_collision: false}}}}\n"
    ).solver
    assert (solver.contact.thickness, solver.contact.body_collision, solver.contact.self_collision) == (
        0.01,
        True,
        False,
    )
    assert load(f"bodies: [{BODY}]\nsolver: {{kind: xpbd, contact: null}}\n").solver.contact is None
    solver = load(f"bodies: [{BODY}]\nsolver: {{kind: implicit, integrator: bdf2, max_iterations: 9}}\n").solver
    assert (type(solver).__name__, solver.integrator, solver.max_iterations) == ("Implicit", "bdf2", 9)
    assert type(solver_of_kind("implicit")) is type(solver)


def test_defaults(load):
    run = load(f"bodies: [{BODY}]\n")
    assert (run.dt, run.steps, run.solver) == (1 / 60, 300, Auto())
    assert run.chosen_solver == sp.XPBD()
    np.testing.assert_allclose(run.scene.gravity, [0, -9.81, 0])
    assert run.start == {}


def test_load_scene_warns_of_what_it_does_not_return(load, caplog):
    with caplog.at_level(logging.WARNING):
        scene = load(EVERYTHING, load_scene)
    assert isinstance(scene, sp.Scene)
    assert "the deformed start of 'block' is not a part of the scene" in caplog.text


def test_mesh_files_are_found_beside_the_scene_file(load, tmp_path, monkeypatch):
    folder = tmp_path / "meshes"
    folder.mkdir()
    box = sp.shapes.box((1, 1, 1), (2, 2, 2))
    box.save(folder / "box.1.node")
    box.surface.compact().save(folder / "box.stl")
    monkeypatch.chdir(tmp_path.parent)
    run = load(
        f"""
bodies:
  - {{name: read, mesh: {{file: meshes/box.1.node, scale: 0.5}}, material: {RUBBER}}}
  - {{name: filled, mesh: {{file: meshes/box.stl, max_volume: 0.01, scale: 2}}, material: {RUBBER},
     skin: {{file: meshes/box.stl, scale: 2}}}}
obstacles: [{{kind: triangles, surface: {{file: meshes/box.stl, rotation: [0, 0, 1], position: [0, -3, 0]}}}}]
"""
    )
    read, filled = run.scene.bodies
    assert read.mesh.volume == pytest.approx(1 / 8)
    assert filled.mesh.volume == pytest.approx(8.0)
    assert filled.mesh.volumes.max() <= 0.01
    assert filled.skin.volume == pytest.approx(8.0)


def test_every_elastic_material_has_a_kind(load):
    kinds = {material.kind: material for material in ELASTIC_MATERIALS}
    assert list(kinds) == [
        "stable_neo_hookean",
        "neo_hookean",
        "fixed_corotated",
        "arap",
        "st_venant_kirchhoff",
    ]
    for kind, material in kinds.items():
        run = load(f"bodies: [{BODY.replace('stable_neo_hookean', kind)}]\n")
        assert type(run.scene.bodies[0].material) is material


@pytest.mark.parametrize(
    ("text", "exact"),
    [
        ("kind: mooney_rivlin, c10: 1e5, c01: 2e4, bulk: 1e7", sp.MooneyRivlin),
        ("kind: yeoh, c10: 1e5, c20: -1e3, bulk: 1e7", sp.Yeoh),
        ("kind: ogden, mu: [6e5, -1e4], alpha: [1.3, -2], bulk: 1e7, damping: 0.1", sp.Ogden),
    ],
)
def test_rubber(load, text, exact):
    run = load(
        f"bodies:\n  - name: block\n    shape: {{kind: box}}\n    material: {{{text}}}\nsolver: {{kind: implicit}}\n"
    )
    material = run.scene.bodies[0].material
    assert type(material) is exact
    given = dict(pair.split(": ") for pair in re.split(r", (?=[a-z])", text))
    for key in given.keys() - {"kind"}:
        np.testing.assert_allclose(getattr(material, key), json.loads(given[key]))
    with pytest.raises(sp.SceneError, match=r"bodies\[0\].material.*: the key `bulk` is missing"):
        load("bodies:\n  - name: block\n    shape: {kind: box}\n    material: {kind: yeoh, c10: 1e5}\n")


def test_an_energy_of_ones_own_is_a_formula_and_runs_no_code(load):
    def material(psi):
        return load(
            "bodies:\n  - name: block\n    shape: {kind: box}\n    material: {kind: energy_material, "
            f'psi: "{psi}", parameters: {{mu: 2e5}}, bulk: 1e7}}\nsolver: {{kind: implicit}}\n'
        )

    rubber = material("mu / 2 * I1 * J**(-2/3)").scene.bodies[0].material
    assert isinstance(rubber, sp.EnergyMaterial)
    assert rubber.youngs == pytest.approx(9 * 1e7 * 2e5 / (3e7 + 2e5))
    with pytest.raises(sp.SceneError, match=r"scene.yaml:4: .*EnergyMaterial: the formula has .* use numbers, names"):
        material("__import__('os').abort()")


def test_materials_that_flow(load):
    run = load(
        "bodies:\n"
        "  - name: slow\n    shape: {kind: box}\n    material: {kind: viscoelastic, prony: [[0.3, 0.1], [0.2, 1]], "
        "material: {kind: yeoh, c10: 1e5, bulk: 1e7, density: 900}}\n"
        "  - name: metal\n    shape: {kind: box}\n    material: {kind: j2_plastic, youngs: 2e11, poisson: 0.3, "
        "yield_stress: 2e8, hardening: 1e9}\n    position: [3, 0, 0]\nsolver: {kind: implicit}\n"
    )
    slow, metal = (body.material for body in run.scene.bodies)
    assert isinstance(slow, sp.Viscoelastic)
    assert (slow.prony, slow.density, type(slow.material)) == (((0.3, 0.1), (0.2, 1.0)), 900.0, sp.Yeoh)
    assert isinstance(metal, sp.J2Plastic)
    assert (metal.yield_stress, metal.saturation_stress, metal.hardening) == (2e8, 2e8, 1e9)


def test_the_schema_is_valid_and_accepts_what_the_loader_accepts(load, tmp_path):
    schema = json_schema()
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(json.loads(json.dumps(schema)))
    load(EVERYTHING)
    assert list(validator.iter_errors(read_yaml(tmp_path / "scene.yaml").data)) == []


@pytest.mark.parametrize("case", ["unknown", "kind", "missing", "type", "range"])
def test_the_schema_rejects_what_the_loader_rejects(case):
    data = {
        "bodies": [{"name": "a", "shape": {"kind": "box"}, "material": {"kind": "arap", "youngs": 1.0, "poisson": 0.1}}]
    }
    validator = Draft202012Validator(json_schema())
    assert validator.is_valid(data)
    scene_file_model().model_validate(data)
    body = data["bodies"][0]
    if case == "unknown":
        body["colour"] = "red"
    elif case == "kind":
        body["material"]["kind"] = "steel"
    elif case == "missing":
        del body["material"]["youngs"]
    elif case == "type":
        body["name"] = 3
    else:
        body["material"]["poisson"] = 0.7
    assert not validator.is_valid(data)
    with pytest.raises(ValueError):
        scene_file_model().model_validate(data)


def test_the_scene_of_the_manual_is_valid(load, tmp_path):
    manual = (Path(__file__).parents[3] / "docs" / "reference" / "scene_files.md").read_text(encoding="utf-8")
    example = manual.split("```yaml\n")[1].split("```")[0]
    sp.shapes.gummy_bear_surface(100.0, 24).save(tmp_path / "bear.stl")
    sp.shapes.box_surface((0.2, 0.2, 0.2)).save(tmp_path / "stairs.obj")
    run = load(example)
    assert len(run.scene.bodies) == 14
    assert run.scene.body("bear").mesh.volumes.max() <= 1e-6
    assert list(Draft202012Validator(json_schema()).iter_errors(read_yaml(tmp_path / "scene.yaml").data)) == []


def test_the_rigid_bodies_of_the_manual_are_valid(load, tmp_path):
    manual = (Path(__file__).parents[3] / "docs" / "reference" / "scene_files.md").read_text(encoding="utf-8")
    sp.shapes.box_surface((200.0, 20.0, 200.0)).save(tmp_path / "tray.stl")
    run = load(manual.split("```yaml\n")[2].split("```")[0])
    assert [body.kappa > 0.0 for body in run.scene.bodies] == [True, True]
    assert next(sp.simulate(run.scene, run.solver, run.dt, 1)).report.status == "converged"


@pytest.mark.parametrize(
    "kinds", ["material", "shape", "obstacle", "solver", "stitch", "load", "sensor", "joint", "motor"]
)
def test_the_manual_lists_every_kind(kinds):
    manual = (Path(__file__).parents[3] / "docs" / "reference" / "scene_files.md").read_text(encoding="utf-8")
    row = next(line for line in manual.splitlines() if line.startswith(f"| {kinds} |"))
    known = {
        definition["properties"]["kind"]["const"]
        for name, definition in json_schema()["$defs"].items()
        if "kind" in definition.get("properties", {}) and _family(name) == kinds
    }
    assert set(re.findall(r"`(\w+)`", row)) == known


def _family(name):
    for family in ("obstacles", "stitches", "loads", "sensors", "joints"):
        if name.removesuffix("Model") in {kind.__name__ for kind in PARTS[family].kinds}:
            return {"stitches": "stitch"}.get(family, family[:-1])
    if name.endswith("ShapeModel"):
        return "shape"
    if name in ("XPBDModel", "ImplicitModel", "AutoModel"):
        return "solver"
    return "motor" if name.endswith("MotorModel") else "material"


def test_contact_of_the_implicit_solver(load):
    solver = load(
        f"bodies: [{BODY}]\n"
        "solver: {kind: implicit, contact: {dhat: 1e-3, stiffness: 1e5, "
        "friction_velocity: 0.01, friction_iterations: 3}}\n"
    ).solver
    assert solver.contact == sp.IPCContact(1e-3, 1e5, 0.01, 3)
    for words in ("", ", contact: {}", ", contact: {stiffness: adaptive}"):
        assert load(f"bodies: [{BODY}]\nsolver: {{kind: implicit{words}}}\n").solver.contact == sp.IPCContact()
    assert load(f"bodies: [{BODY}]\nsolver: {{kind: implicit, contact: null}}\n").solver.contact is None


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ("dhat: -1", "solver.contact.dhat: is -1; it must be above 0"),
        ("stiffness: stiff", "solver.contact.stiffness: is the text 'stiff'"),
        ("friction_iterations: 0", "solver.contact.friction_iterations: is 0; it must be at least 1"),
        ("dhatt: 1", "solver.contact.dhatt: unknown key; did you mean 'dhat'?"),
    ],
)
def test_errors_in_contact_of_the_implicit_solver(load, words, complaint):
    with pytest.raises(sp.SceneError) as caught:
        load(f"bodies: [{BODY}]\nsolver: {{kind: implicit, contact: {{{words}}}}}\n")
    assert complaint in str(caught.value)


def test_contact_pairs_of_copies_and_of_unnamed_obstacles(load):
    text = f"""
bodies:
  - {{name: pea, shape: {{kind: box, divisions: [1, 1, 1]}}, material: {RUBBER},
     copies: {{offsets: [[0, 1, 0], [0, 3, 0]]}}}}
obstacles: [{{kind: sphere, friction: 0.1}}]
contact_pairs:
  - {{first: "pea*", second: "pea*", collide: false}}
  - {{first: [pea02], second: Sphere 1, friction: 0.6}}
"""
    table = pair_table(load(text).scene)
    assert table.collide.tolist() == [[False, False, True], [False, False, True], [True, True, False]]
    assert table.friction[:, 2].tolist() == [0.1, 0.6, 0.0]
    schema = Draft202012Validator(json_schema())
    data = {"bodies": [], "contact_pairs": [{"first": "a", "second": ["b", "c"], "collide": False}]}
    assert not [e for e in schema.iter_errors(data) if "contact_pairs" in e.path]
    data["contact_pairs"][0]["second"] = []
    assert [e for e in schema.iter_errors(data) if "contact_pairs" in e.path]


def test_the_table_of_the_documentation_has_every_key_of_every_kind():
    """It is made from the same declarations as the schema."""
    spec = importlib.util.spec_from_file_location("kinds_page", ROOT / "docs" / "building" / "kinds.py")
    assert spec is not None
    assert spec.loader is not None
    page = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(page)
    text = page.kinds_page()
    definitions = json_schema()["$defs"]
    for kind in {kind for part in PARTS.values() for kind in part.kinds} - {sp.Body, sp.RigidBody, sp.Shell, sp.Rod}:
        (section,) = re.findall(rf"^### [^\n]*`{kind.__name__}`\)?\n(.*?)(?=^##|\Z)", text, flags=re.S | re.M)
        model = definitions.get(f"{kind.__name__}Model") or definitions[f"{kind.__name__}EntryModel"]
        keys = set(model["properties"]) - {"kind"}
        assert {row.split("`")[1] for row in section.splitlines() if row.startswith("| `")} == keys
        assert not re.search(r"\| *\|$", section, flags=re.M), "a key has no description"
    bodies = text.partition("## bodies\n")[2].partition("\n## ")[0]
    keys = {*definitions["BodyModel"]["properties"], *definitions["RigidModel"]["properties"]}
    keys |= definitions["ShellModel"]["properties"].keys() | definitions["RodModel"]["properties"].keys()
    of_files = {"regions", "order", "copies", "initial", "rigid", "shell", "rod"}
    assert {row.split("`")[1] for row in bodies.splitlines() if row.startswith("| `")} == keys - of_files
