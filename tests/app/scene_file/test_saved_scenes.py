"""`scene.save` is the inverse of `load_scene`: the same arrays to the last bit, and the same frames."""

import os
import signal
import subprocess
import sys
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.results.test_recorded_scenes import BOX, DIRECTIONS, RUBBER, same, whole_scene
from tests.test_examples import EXAMPLES

import supple as sp
from supple.app.demos.registry import DEMOS
from supple.app.scene_file.loader import load_run
from supple.kinds.kind import declared
from supple.kinds.validators import POSITIVE, NumberPerTet
from supple.materials.registry import MATERIALS
from supple.model.system import build_system, initial_state
from supple.scene.loads.over_time import OverTimeOf
from supple.scene.motion import MotionValidator
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.registry import PARTS


def arrays(value, where="system"):
    """All arrays of an object, by their paths."""
    if isinstance(value, np.ndarray):
        return {where: value}
    if isinstance(value, (tuple, list)):
        inner = [(f"{where}[{k}]", item) for k, item in enumerate(value)]
    elif isinstance(value, dict):
        inner = [(f"{where}[{key!r}]", item) for key, item in value.items()]
    elif is_dataclass(value) and not isinstance(value, type):
        inner = [(f"{where}.{field.name}", getattr(value, field.name)) for field in fields(value)]
    else:
        inner = []
    return {key: array for path, item in inner for key, array in arrays(item, path).items()}


def saved(scene, folder):
    """The scene that is read from the file of a scene; it is the same one, and so are its arrays."""
    path = folder / "saved" / "scene.yaml"
    scene.save(path)
    found = sp.load_scene(path, confine=True)
    systems = [arrays(build_system(one, initial_state(one))) for one in (scene, found)]
    assert systems[0].keys() == systems[1].keys()
    for key, array in systems[0].items():
        assert array.dtype == systems[1][key].dtype
        np.testing.assert_array_equal(array, systems[1][key], key)
    again = folder / "again" / "scene.yaml"
    found.save(again)
    assert files(again.parent).keys() == files(path.parent).keys(), "names contain what the files hold"
    assert again.read_text() == path.read_text()
    return found


def files(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def same_frames(scene, folder, solver, steps=3):
    frames = [list(sp.simulate(one, solver, 1 / 60, steps))[-1] for one in (scene, saved(scene, folder))]
    np.testing.assert_array_equal(frames[0].state.positions, frames[1].state.positions)
    np.testing.assert_array_equal(frames[0].state.velocities, frames[1].state.velocities)


def test_every_kind_of_thing(tmp_path):
    scene = whole_scene()
    found = saved(scene, tmp_path)
    for key in PARTS:
        same(getattr(scene, key), getattr(found, key), key)
    assert found.body("a").kappa == scene.body("a").kappa


@pytest.mark.parametrize("kind", MATERIALS, ids=lambda kind: kind.__name__)
def test_every_material_with_a_number_for_each_tet(tmp_path, kind):
    count = len(BOX.tets)
    values = {
        "poisson": 0.3,
        "kappa": 0.2,
        "directions": DIRECTIONS[:, None] if kind is sp.HolzapfelGasserOgden else DIRECTIONS,
        "mu": [1e4, -1e3],
        "alpha": [2.0, -2.0],
        "psi": "c * (I1 - 3 - 2 * log(J))",
        "parameters": {"c": np.linspace(1e4, 2e4, count)},
        "material": RUBBER,
        "prony": [(0.5, 0.1), (0.1, 1.0)],
        "of": "invariants",
        "density": 1.0,
        "damping": 0.01,
        "bulk": 1e6,
    }
    given = {}
    for name, one in declared(kind).items():
        given[name] = values.get(name, 1e3)
        if isinstance(one.validator, NumberPerTet):
            given[name] = np.asarray(given[name]) * np.linspace(1.0, 1.1, count) ** 0.5
    scene = sp.Scene([sp.Body("bar", BOX, kind(**given))])
    same(scene.bodies, saved(scene, tmp_path).bodies)


def test_an_energy_of_ones_own_is_saved_as_its_formula(tmp_path):
    def psi(I1, I2, J, c):
        from sympy import log

        return c * (I1 - 3 - 2 * log(J)) + 0.1 * (J - 1) ** 2

    material = sp.EnergyMaterial(psi=psi, parameters={"c": 1e4}, bulk=1e5)
    scene = sp.Scene([sp.Body("bar", BOX, material)])
    assert saved(scene, tmp_path).body("bar").material.psi == "c*(I1 - 2*log(J) - 3) + 0.1*(J - 1)**2"
    same_frames(scene, tmp_path, sp.Implicit())


def test_regions_and_quadratic_tets(tmp_path):
    mesh = BOX.to_order(2)
    index = np.arange(len(mesh.tets)) % 4
    stiff = np.linspace(1e4, 1e5, len(mesh.tets))
    materials = [
        RUBBER,
        sp.NeoHookean(youngs=stiff, poisson=0.2),
        RUBBER,
        sp.Viscoelastic(material=RUBBER, prony=[(0.5, 0.1)]),
    ]
    scene = sp.Scene([sp.Body("bar", mesh, sp.Regions(materials=materials, index=index))])
    same(scene.bodies, saved(scene, tmp_path).bodies)


def test_shells(tmp_path):
    """An open sheet and a balloon, with a start and a look."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1], [0.5, 0.1, 0.5]], dtype=np.float64)
    sheet = sp.SurfaceMesh(corners, np.array([[0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0]]))
    cloth = sp.ShellMaterial(youngs=1e5, poisson=0.3, thickness=1e-3, bending=1e-7, membrane="st_venant_kirchhoff")
    rubber = sp.ShellMaterial(youngs=1e6, poisson=0.5, thickness=2e-4, damping=0.01)
    balloon = sp.shapes.sphere(radius=0.1, edge_length=0.08).surface.compact()
    bodies = [
        sp.Shell("cloth", sheet, cloth, position=(0, 1, 0), rotation=(0.1, 0, 0), velocity=(1, 0, 0)),
        sp.Shell("balloon", balloon, rubber),
    ]
    scene = sp.Scene(bodies, pins=[sp.Pin("cloth", [0, 1])])
    saved(scene, tmp_path)


def test_rods(tmp_path):
    """An open line, and a long ring whose points and edges are in files."""
    angles = 2.0 * np.pi * np.arange(40) / 40
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(40)])
    rope = sp.RodMaterial(youngs=1e6, poisson=0.3, radius=0.01, bending=1e-5, damping=0.01)
    edges = np.column_stack([np.arange(40), (np.arange(40) + 1) % 40])
    bodies = [
        sp.Rod("rope", [[0, 0, 0], [0.1, 0, 0], [0.2, 0.05, 0]], rope, position=(0, 1, 0), velocity=(1, 0, 0)),
        sp.Rod("ring", ring, sp.RodMaterial(youngs=1e7, radius=0.02), edges=edges, rest="straight", twist=1.5),
    ]
    saved(sp.Scene(bodies, pins=[sp.Pin("rope", [0, 1])]), tmp_path)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ("rod: {centerline: [[0, 0, 0]], youngs: 1, radius: 1}", "it has one point"),
        ("rod: {centerline: [[0, 0, 0], [1, 0, 0]], youngs: 1, radius: 0}", "radius: is 0; it must be above 0"),
        ("rod: {centerline: [[0, 0, 0], [1, 0, 0]], radius: 1}", "the key `youngs` is missing"),
        ("rod: {centerline: [[0, 0, 0], [1, 0, 0]], edges: [[0, 2]], youngs: 1, radius: 1}", "edge 0 is \\[0, 2\\]"),
        ("mesh: {file: bar.vtu}, rod: {centerline: [[0, 0, 0], [1, 0, 0]], youngs: 1, radius: 1}", "give one of them"),
        ("order: 2, rod: {centerline: [[0, 0, 0], [1, 0, 0]], youngs: 1, radius: 1}", "a rod has no `order`"),
        ("mesh: {file: bar.vtu}, shell: {youngs: 1, poisson: 0.3, thickness: 1}", "a shell needs a surface"),
        ("mesh: {file: bar.vtu}, shell: {youngs: 1, poisson: 0.3}", "the key `thickness` is missing"),
        ("mesh: {file: bar.vtu}, order: 2, shell: {youngs: 1, poisson: 0.3, thickness: 1}", "a shell has no `order`"),
        ("mesh: {file: bar.vtu}, rigid: {mass: 1}, shell: {youngs: 1, poisson: 0.3, thickness: 1}", "give one of them"),
        (
            "mesh: {file: bar.vtu}, shell: {youngs: 1, poisson: 0.3, thickness: -1}",
            "thickness: is -1; it must be above 0",
        ),
    ],
)
def test_shells_and_rods_that_are_none(tmp_path, keys, words):
    sp.shapes.box((1, 1, 1), (1, 1, 1)).save(tmp_path / "bar.vtu")
    (tmp_path / "scene.yaml").write_text(f"bodies: [{{name: cloth, {keys}}}]\n")
    with pytest.raises(sp.SceneError, match=words):
        sp.load_scene(tmp_path / "scene.yaml")


def test_values_of_every_shape(tmp_path):
    """One number, lists in the text and files, of everything that may have them."""
    rng = np.random.default_rng(5)
    ball = sp.Body("ball", sp.shapes.sphere(0.1, 0.04), RUBBER, position=(1, 0, 0))
    rows = rng.permutation(len(ball.mesh.vertices))[:90]
    pairs = np.column_stack([rows, np.arange(90)])
    times = np.linspace(0.0, 1.0, 80)
    motor = sp.VelocityMotor(sp.MotorInput("m", 0.3))
    weights = np.abs(rng.normal(size=90)) + 0.1
    scene = sp.Scene(
        [
            ball,
            sp.Body("other", ball.mesh, RUBBER, position=(1, 0.3, 0)),
            sp.RigidBody("a", sp.shapes.box_surface((0.1, 0.1, 0.1)), mass=1.0, inertia=(0.2, 0.2, 0.3)),
        ],
        [
            sp.HalfSpace(
                point=(0, -3, 0), motion=sp.Keyframes(times, rng.normal(size=(80, 3)), times * 7, pivot=(1, 2, 3))
            )
        ],
        pins=[sp.Pin("ball", rows)],
        forces=[sp.Force("ball", rows, rng.normal(size=(90, 3))), sp.Force("ball", [3, 1], [[1, 2, 3], [-0.0, 5, 6]])],
        loads=[
            sp.Pressure("ball", sp.Curve(times, rng.normal(size=80)), region=np.arange(99)),
            sp.BodyForce(sp.Curve(times, rng.normal(size=(80, 3)))),
            sp.Muscle("ball", 1e3, rng.normal(size=(2, 3)), tets=[5, 2]),
        ],
        stitches=[sp.VertexVertexStitch("ball", "other", pairs=pairs, stiffness=weights, strength=[*weights])],
        joints=[
            sp.HingeJoint("a", None, (0, 0, 0), limits=(-np.inf, 1), motor=motor),
        ],
    )
    found = saved(scene, tmp_path)
    for key in PARTS:
        if key not in ("bodies", "joints"):
            same(getattr(scene, key), getattr(found, key), key)
    assert found.inputs["m"].value == scene.inputs["m"].value == 0.3


def test_surfaces_that_a_reader_would_repair_stay_as_they_are(tmp_path):
    """Vertices that coincide, that no triangle uses, and triangles that are there twice."""
    ball = sp.shapes.sphere_surface(0.2)
    soup = sp.SurfaceMesh(ball.vertices[ball.triangles].reshape(-1, 3), np.arange(ball.triangles.size).reshape(-1, 3))
    twice = sp.SurfaceMesh(np.vstack([ball.vertices, [[7, 7, 7]]]), np.vstack([ball.triangles, ball.triangles[:3]]))
    scene = sp.Scene(
        [sp.Body("bar", BOX, RUBBER, skin=soup), sp.RigidBody("r", BOX.surface, density=1e3, position=(0, 9, 0))],
        [sp.obstacles.TriangleObstacle(surface=BOX.surface, name="x"), sp.obstacles.TriangleObstacle(surface=twice)],
    )
    found = saved(scene, tmp_path)
    for one, other in zip(scene.obstacles, found.obstacles, strict=True):
        np.testing.assert_array_equal(one.surface.vertices, other.surface.vertices)
        np.testing.assert_array_equal(one.surface.triangles, other.surface.triangles)
    same(scene.body("bar").skin.triangles, found.body("bar").skin.triangles)


@pytest.mark.parametrize("path", sorted((EXAMPLES / "scenes").glob("*.yaml")), ids=lambda path: path.stem)
def test_the_example_scenes(tmp_path, path):
    run = load_run(path)
    same_frames(run.scene, tmp_path, run.chosen_solver, 2)


@pytest.mark.parametrize(("name", "kind"), [(name, kind) for name, demo in DEMOS.items() for kind in demo.kinds])
def test_the_demos(tmp_path, name, kind):
    scene = DEMOS[name].on(kind).scene()
    found = saved(scene, tmp_path)
    for key in PARTS:
        if key != "bodies":  # a loaded mesh had no tets to reorient
            same(getattr(scene, key), getattr(found, key), key)


@pytest.mark.parametrize("kind", ["xpbd", "implicit"])
def test_a_demo_has_the_same_frames(tmp_path, kind):
    demo = DEMOS["squash"].on(kind)
    same_frames(demo.scene(), tmp_path, demo.solvers[kind]())


numbers = st.floats(-1e9, 1e9, allow_nan=False, width=64)
vectors = st.tuples(numbers, numbers, numbers)
materials = st.one_of(
    [
        st.builds(
            kind,
            youngs=st.floats(1e3, 1e9) | st.lists(st.floats(1e3, 1e9), min_size=24, max_size=24),
            poisson=st.floats(-0.9, 0.49),
            density=st.floats(1e-3, 2e4),
            damping=st.floats(0.0, 9.0),
        )
        for kind in (sp.StableNeoHookean, sp.NeoHookean, sp.ARAP, sp.FixedCorotated)
    ]
)
names = st.text(st.characters(codec="utf-8", exclude_characters='/\\:*?"<>|'), min_size=1, max_size=20).filter(
    lambda text: text.isprintable() and text.strip() not in ("", ".", "..")
)


@settings(max_examples=25)
@given(
    st.lists(st.tuples(names, materials, vectors, vectors), min_size=1, max_size=3, unique_by=lambda row: row[0]),
    st.lists(st.tuples(vectors, st.floats(1e-9, 1e9)), max_size=3),
    vectors,
)
def test_random_scenes(tmp_path_factory, rows, balls, gravity):
    bodies = [
        sp.Body(name, BOX, material, position=np.multiply(position, 1e-6), velocity=velocity)
        for name, material, position, velocity in rows
    ]
    obstacles = [sp.obstacles.Sphere(center=center, radius=radius) for center, radius in balls]
    try:
        scene = sp.Scene(bodies, obstacles, gravity=gravity)
    except sp.SceneError:
        return
    found = saved(scene, tmp_path_factory.mktemp("random"))
    same(scene.obstacles, found.obstacles)
    for one, other in zip(scene.bodies, found.bodies, strict=True):
        for name in ("name", "position", "velocity"):
            same(getattr(one, name), getattr(other, name))
        same(np.asarray(one.material.youngs), np.asarray(other.material.youngs))


def with_functions():
    """Every field that takes a function of time, with one."""
    scene = whole_scene()
    for key in PARTS:
        for k, item in enumerate(getattr(scene, key)):
            for name, one in declared(type(item)).items():
                if isinstance(one.validator, MotionValidator | OverTimeOf) or name in ("force", "motor"):
                    yield key, k, name


@pytest.mark.parametrize(("key", "k", "name"), list(with_functions()))
def test_a_function_is_refused_with_its_name_and_the_remedy(tmp_path, key, k, name):
    scene = whole_scene()
    items = list(getattr(scene, key))
    value = sp.PositionMotor(lambda t: t, 1.0) if name == "motor" else lambda t: np.zeros(3)
    if name == "motor" and not isinstance(items[k], sp.HingeJoint | sp.SliderJoint):
        return
    given = {"pressure": None, "volume": None, "gas": None} if key == "cavities" else {}
    given |= {"length": None, "tension": None, "winch_speed": None} if key == "cables" else {}
    stiff = {"stiffness": 1.0} if name in ("length", "winch_speed") and key == "cables" else {}
    items[k] = replace(items[k], **given | stiff | {name: value})
    label = value.label if name == "motor" else items[k].label
    instead = "Keyframes" if isinstance(items[k], Obstacle) or name == "motion" else "a C|a constant"
    with pytest.raises(sp.SceneError) as caught:
        replace(scene, **{key: items}).save(tmp_path / "scene.yaml")
    text = str(caught.value)
    assert label in text
    assert ("target" if name == "motor" else name) in text
    assert any(word in text for word in instead.split("|"))
    assert "a function" in text
    assert list(tmp_path.iterdir()) == []


def test_inputs_of_a_program_are_refused(tmp_path):
    scene = sp.Scene([sp.Body("bar", BOX, RUBBER)], pins=[sp.Pin("bar", [0], motion=sp.MotionInput("hand"))])
    with pytest.raises(sp.SceneError, match="motion is the input 'hand', which a scene file cannot hold; give Keyf"):
        scene.save(tmp_path / "scene.yaml")


@dataclass(frozen=True, eq=False, kw_only=True)
class Softening(sp.StableNeoHookean):
    kind: ClassVar[str] = "softening"

    factor: Annotated[float, POSITIVE] = 2.0


def test_a_class_that_files_do_not_know(tmp_path, monkeypatch):
    scene = sp.Scene([sp.Body("bar", BOX, Softening(youngs=1e5, poisson=0.3, factor=3.0))])
    with pytest.raises(sp.SceneError, match=r"do not know its class Softening; .*MATERIALS\.append"):
        scene.save(tmp_path / "scene.yaml")
    MATERIALS.append(Softening)
    try:
        assert saved(scene, tmp_path).body("bar").material.factor == 3.0
    finally:
        MATERIALS.remove(Softening)


@pytest.mark.parametrize("name", ["scene", "scene.vtu", "scene.urdf"])
def test_the_name_must_be_that_of_a_scene_file(tmp_path, name):
    with pytest.raises(sp.SceneError, match=r"a scene file ends with \.yaml"):
        sp.Scene([sp.Body("bar", BOX, RUBBER)]).save(tmp_path / name)


def test_what_a_scene_file_may_not_hold_is_told_before_anything_is_written(tmp_path):
    material = sp.Viscoelastic(material=RUBBER, prony=[(0.01, 0.1 * k) for k in range(1, 22)])
    with pytest.raises(sp.SceneError, match=r"prony: has 21 values; give at most 20"):
        sp.Scene([sp.Body("bar", BOX, material)]).save(tmp_path / "scene.yaml")
    assert list(tmp_path.iterdir()) == []


def test_a_mesh_stays_in_its_file_where_that_is_exact_and_near(tmp_path):
    (tmp_path / "in").mkdir()
    BOX.save(tmp_path / "in" / "bar.msh")
    sp.shapes.sphere_surface(0.2).save(tmp_path / "ball.stl")
    mesh, ball = sp.TetMesh.load(tmp_path / "in" / "bar.msh"), sp.SurfaceMesh.load(tmp_path / "ball.stl")
    bodies = [
        sp.Body("bar", mesh, RUBBER, skin=ball),
        sp.Body("large", mesh.transformed(2.0), RUBBER, position=(0, 1, 0)),
        sp.RigidBody("ball", ball, density=1e3, position=(0, 3, 0)),
    ]
    scene = sp.Scene(bodies)

    def entries():
        scene.save(tmp_path / "scene.yaml")
        same(sp.load_scene(tmp_path / "scene.yaml", confine=True).bodies, scene.bodies)
        return yaml.safe_load((tmp_path / "scene.yaml").read_text())["bodies"]

    bar, large, rigid = entries()
    assert (bar["mesh"], bar["skin"], rigid["surfaces"]) == (
        {"file": "in/bar.msh"},
        {"file": "ball.stl"},
        [{"file": "ball.stl"}],
    )
    assert large["mesh"]["file"].startswith("scene_files/large-")
    BOX.transformed(3.0).save(tmp_path / "in" / "bar.msh")
    (tmp_path / "ball.stl").unlink()
    bar, _, rigid = entries()
    assert bar["mesh"]["file"].startswith("scene_files/bar-")
    assert rigid["surfaces"][0]["file"] == bar["skin"]["file"]
    scene.save(tmp_path / "elsewhere" / "scene.yaml")
    assert not list((tmp_path / "elsewhere").glob("*.msh"))
    same(sp.load_scene(tmp_path / "elsewhere" / "scene.yaml", confine=True).bodies, scene.bodies)


def test_saving_again_leaves_only_what_the_scene_needs(tmp_path):
    first = sp.Scene([sp.Body("bar", BOX, RUBBER)])
    second = sp.Scene([sp.Body("bar", BOX.transformed(2.0), RUBBER), sp.Body("too", BOX, RUBBER, position=(0, 1, 0))])
    first.save(tmp_path / "scene.yaml")
    (tmp_path / "scene_files" / "notes.txt").write_text("mine")
    before = files(tmp_path)
    second.save(tmp_path / "scene.yaml")
    first.save(tmp_path / "scene.yaml")
    assert files(tmp_path) == before


def test_a_failure_leaves_the_earlier_file(tmp_path, monkeypatch):
    scene = sp.Scene([sp.Body("bar", BOX, RUBBER)])
    other = sp.Scene([sp.Body("bar", BOX.transformed(2.0), RUBBER, skin=sp.shapes.sphere_surface(0.1))])
    for earlier in (False, True):
        if earlier:
            scene.save(tmp_path / "scene.yaml")
        before = files(tmp_path)
        write, calls = Path.write_bytes, []

        def failing(self, data, write=write, calls=calls):
            calls.append(self)
            if len(calls) == 2:
                raise OSError(28, "No space left on device")
            return write(self, data)

        with monkeypatch.context() as patch:
            patch.setattr(Path, "write_bytes", failing)
            with pytest.raises(sp.OutputError, match="No space left on device"):
                other.save(tmp_path / "scene.yaml")
        assert files(tmp_path) == before


_KILLED = """
import os, signal, sys
from pathlib import Path
import supple as sp
from supple.runtime import replacing
scene = sp.load_scene(sys.argv[1])
body = scene.bodies[0]
scene = sp.Scene([body.changed(mesh=body.mesh.transformed(2.0)), body.changed(name="too", position=(0, 9, 0))])
left, place = [int(sys.argv[2])], os.replace
def replace(*paths):
    if left[0] == 0:
        os.kill(os.getpid(), signal.SIGKILL)
    left[0] -= 1
    place(*paths)
os.replace = replace
scene.save(sys.argv[1])
"""


@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize("renames", [0, 1, 2])
def test_a_kill_in_mid_write_leaves_the_earlier_scene(tmp_path, renames):
    path = tmp_path / "scene.yaml"
    scene = sp.Scene([sp.Body("bar", BOX, RUBBER)])
    scene.save(path)
    before = path.read_bytes()
    done = subprocess.run([sys.executable, "-c", _KILLED, str(path), str(renames)], check=False, timeout=120)
    assert done.returncode == (-signal.SIGKILL if renames < 2 else 0)
    if renames == 2:
        assert [body.name for body in sp.load_scene(path).bodies] == ["bar", "too"]
        return
    assert path.read_bytes() == before
    same(sp.load_scene(path).bodies, scene.bodies)
    scene.save(path)
    assert len(files(tmp_path)) == 2, "what the killed one left is deleted"


def test_a_file_of_numbers_that_is_none(tmp_path):
    text = """
bodies:
  - name: bar
    shape: {kind: box, divisions: [1, 1, 1]}
    material: {kind: arap, poisson: 0.3, youngs: {file: FILE}}
"""
    np.save(tmp_path / "names.npy", np.array(["a"]))
    np.save(tmp_path / "objects.npy", np.array([{}], dtype=object), allow_pickle=True)
    np.save(tmp_path / "negative.npy", np.array([1.0, -2.0]))
    np.savez(tmp_path / "several.npz", a=np.zeros(2))
    (tmp_path / "text.npy").write_text("1 2 3")
    for file, message in {
        "names.npy": "it holds something other than one array of numbers",
        "objects.npy": "it is not such a file",
        "several.npz": "it holds something other than one array of numbers",
        "text.npy": "it is not such a file",
        "absent.npy": "No such file or directory",
        "../secret.npy": "is outside the scene file's folder",
        "negative.npy": r"youngs is -2 \(tet 1\); it must be above zero",
    }.items():
        path = tmp_path / "scene.yaml"
        path.write_text(text.replace("FILE", file))
        with pytest.raises(sp.SceneError, match=rf"scene\.yaml:5: .*{message}"):
            sp.load_scene(path, confine=True)
