"""A recording has the scene as it was described: every kind of thing, with functions as their values in each frame."""

from dataclasses import dataclass, fields
from typing import Annotated

import h5py
import numpy as np
import pytest
from tests.recordings import set_in_scene

import supple as sp
from supple.kinds.checks import unit_vectors
from supple.kinds.described import Described
from supple.kinds.kind import Kind
from supple.kinds.validators import POSITIVE
from supple.materials.per_tet import NOT_ELASTIC
from supple.materials.registry import MATERIALS
from supple.model.system import initial_state
from supple.scene.registry import PARTS
from supple.simulate import first_frame

BOX = sp.shapes.box((0.4, 0.1, 0.1), (4, 1, 1))
DIRECTIONS = np.random.default_rng(8).normal(size=(len(BOX.tets), 3))
RUBBER = sp.StableNeoHookean(youngs=1e5, poisson=0.4)
STILL = {"gravity": (0.0, 0.0, 0.0)}


def same(one, other, where="scene"):
    """Whether two descriptions are equal to the last bit; functions are compared elsewhere."""
    if callable(one) and not isinstance(one, Kind):
        assert callable(other), where
    elif isinstance(type(one), Described) or isinstance(one, sp.TetMesh | sp.SurfaceMesh):
        assert type(one) is type(other), where
        for field in fields(one):
            if field.init:
                same(getattr(one, field.name), getattr(other, field.name), f"{where}.{field.name}")
    elif isinstance(one, (tuple, list)):
        assert len(one) == len(other), where
        for k, (a, b) in enumerate(zip(one, other, strict=True)):
            same(a, b, f"{where}[{k}]")
    elif isinstance(one, dict):
        assert one.keys() == other.keys(), where
        for key, value in one.items():
            same(value, other[key], f"{where}.{key}")
    elif isinstance(one, np.ndarray):
        assert one.dtype == other.dtype, where
        np.testing.assert_array_equal(one, other, where)
    else:
        assert one == other, where


def read_back(scene, path):
    """The recording of a scene at its start."""
    recorder = sp.Recorder(path)
    recorder.begin(first_frame(scene, initial_state(scene)), 0.01, 0)
    recorder.end()
    with sp.read_recording(path) as recording:
        if not any(isinstance(body.material, sp.EnergyMaterial) for body in scene.bodies):  # its formula is a text
            same(scene, recording.scene)
        return recording


def whole_scene():
    """One of every kind that scene files name, but for what only a region or a formula has."""
    hollow = sp.shapes.box((0.3, 0.3, 0.3), (3, 3, 3))
    inner = np.abs(hollow.vertices[hollow.tets].mean(axis=1)).max(axis=1) > 0.05
    hollow = sp.TetMesh.dropping_unused(hollow.vertices, hollow.tets[inner])
    sheet = sp.SurfaceMesh([(0, 0, 0), (0.3, 0, 0), (0.3, 0.1, 0.3), (0, 0, 0.3)], [(0, 2, 1), (0, 3, 2)])
    bodies = [
        sp.Body("bar", BOX, RUBBER, velocity=(0.1, 0, 0), skin=sp.shapes.sphere_surface(0.04), look="gummy"),
        sp.Body("hat", BOX, RUBBER, position=(0, 0.3, 0), rotation=(0, 0.1, 0), friction=0.2),
        sp.Body("tyre", hollow, RUBBER, position=(0, 2, 0)),
        sp.RigidBody("a", BOX, density=500.0, position=(2, 0, 0)),
        sp.RigidBody(
            "b", sp.shapes.box_surface((0.2, 0.2, 0.2)), mass=1.0, inertia=(0.1, 0.1, 0.1), position=(3, 0, 0)
        ),
        sp.RigidBody("c", BOX, density=500.0, position=(0.42, 0, 0)),
        sp.Shell("sheet", sheet, sp.ShellMaterial(youngs=1e5, poisson=0.3, thickness=1e-3), position=(0, -2, 0)),
        sp.Rod(
            "rope", [(0, 0, 0), (0.1, 0, 0), (0.2, 0.1, 0)], sp.RodMaterial(youngs=1e6, radius=0.01), position=(0, 5, 0)
        ),
    ]
    obstacles = [
        sp.HalfSpace(point=(0, -3, 0), normal=(0.1, 1, 0.2), friction=0.3),
        sp.obstacles.Box(center=(9, 0, 0), size=(1, 2, 3), rotation=(0.3, -0.2, 0.1)),
        sp.obstacles.Sphere(
            center=(0, 9, 0), radius=0.3, motion=sp.Keyframes([0, 1], rotations=[[0, 0, 0], [1, 2, 3]])
        ),
        sp.HalfSpace(point=(0, -5, 0), normal=np.array([0.3, 1.0, 0.7]) / 3e-7, name="slope"),
        sp.obstacles.Capsule(start=(0, 0, 9), end=(0.1, 0.2, 9.3), radius=0.2),
        sp.obstacles.Cylinder(start=(0, 0, -9), end=(1, 0.2, -9), radius=0.7),
        sp.obstacles.Torus(center=(0, -9, 0)),
        sp.obstacles.TriangleObstacle(surface=sp.shapes.sphere_surface(0.2).transformed(translation=(9, 9, 9))),
    ]
    curve = sp.Curve([0, 1], [1e3, 2e3])
    region = sp.InBox((-9, -9, -9), (9, 9, 9))
    loads = [
        sp.Traction("bar", (1, 2, 3)),
        sp.Pressure("bar", curve, region=[0, 3]),
        sp.BodyForce((0, 0, 0.1), body="bar"),
        sp.Spring(("bar", 0), (None, (0, 1, 0)), 10.0),
        sp.Wind("bar", (1, 0, 0), drag=0.4),
        sp.Muscle("hat", 1e3, DIRECTIONS, 0.5, force_length=([0.5, 1.0], [0.0, 1.0])),
        sp.Growth("hat", sp.Curve([0, 1], [1.0, 1.1]), direction=(0.3, 1, 0.2)),
        sp.Force("bar", [1, 2], (0, 0.1, 0), name="push"),
        sp.SoftTarget("hat", region, 10.0, motion=sp.Keyframes([0, 1], [[0, 0, 0], [0, 0.1, 0]])),
    ]
    joints = [
        sp.FixedJoint("a", None),
        sp.BallJoint("b", "a", point=(2.5, 0, 0), axis=(1, 0, 0), max_swing=1.0, twist_limits=(-1, 1)),
        sp.HingeJoint("b", None, point=(3, 0, 0), limits=(-1, 8), motor=sp.PositionMotor(curve, 1.0), name="hinge"),
        sp.SliderJoint("b", None, axis=(0, 1, 1), motor=sp.ForceMotor(0.1), max_effort=2.0, damping=0.1),
        sp.PlanarJoint("a", "b"),
        sp.UniversalJoint("a", "b", point=(2.5, 0, 0)),
    ]
    return sp.Scene(
        bodies,
        obstacles,
        pins=[sp.Pin("hat", [0, 1]), sp.Pin("tyre", sp.InBox((-1, 2.1, -1), (1, 3, 1)))],
        loads=loads,
        joints=joints,
        stitches=[
            sp.SoftVertexTriangleStitch("hat", "bar", pairs=[(2, 1)], youngs=1e3, poisson=0.3, strength=9.0),
            sp.VertexVertexStitch("hat", "bar", pairs=[(3, 4)], stiffness=3.0),
            sp.VertexEdgeStitch("hat", "bar", max_distance=0.5, stiffness=3.0, damping=0.1),
        ],
        welds=[sp.Weld("bar", "c", max_distance=0.03)],
        cavities=[sp.Cavity("tyre", gas=sp.Gas(gamma=1.4))],
        cables=[sp.Cable([("bar", 3), ("bar", (0, 0, 0)), (None, (0, 5, 0))], tension=1.0)],
        contact_pairs=[sp.ContactPair("a", ["b", "c"], collide=False), sp.ContactPair("bar", "hat", friction=0.1)],
        sensors=[
            sp.ForceSensor("tip", "bar", by="hat"),
            sp.Taxels("skin", "bar", (-0.2, 0, 0), (0.4, 0, 0), (0, 0.1, 0), (2, 3)),
            sp.AngleSensor("bend", "bar", axis=(0, 0, 1), vertices=[0, 1, 2, 9]),
            sp.DistanceSensor("gap", ("bar", 1), (None, (0, 0, 0))),
        ],
        gravity=(0, -0.1, 0),
    )


def test_every_kind_of_thing_reads_back_to_the_last_bit(tmp_path):
    scene = whole_scene()
    for key, part in PARTS.items():
        of_loads = () if key in ("bodies", "forces", "soft_targets") else (*scene.forces, *scene.soft_targets)
        held = {type(one) for one in (*getattr(scene, key), *of_loads)}
        assert set(part.kinds) <= held, key
    recording = read_back(scene, tmp_path / "r.vtkhdf")
    assert recording.scene.body("a").kappa == scene.body("a").kappa


@pytest.mark.parametrize("kind", MATERIALS, ids=lambda kind: kind.__name__)
def test_every_material_reads_back_to_the_last_bit(tmp_path, kind):
    given = {
        "EdgesAndVolume": {"edge_compliance": 1e-3, "volume_compliance": 1e-6},
        "MooneyRivlin": {"c10": 1e4, "c01": 2e3, "bulk": 1e6},
        "Yeoh": {"c10": 1e4, "c20": 1e2, "bulk": 1e6},
        "Ogden": {"mu": [1e4, -1e3], "alpha": [2.0, -2.0], "bulk": 1e6},
        "HolzapfelGasserOgden": {"c10": 1e4, "k1": 1e4, "k2": 1.0, "directions": DIRECTIONS[:, None], "bulk": 1e6},
        "Guccione": {"c": 2e3, "bf": 8.0, "bt": 2.0, "bfs": 4.0, "directions": DIRECTIONS, "bulk": 1e6},
        "EnergyMaterial": {"psi": "c * (I1 - 3 - 2 * log(J))", "parameters": {"c": 1e4}, "bulk": 1e5},
        "J2Plastic": {"youngs": 1e5, "poisson": 0.3, "yield_stress": 1e3},
        "Viscoelastic": {"material": RUBBER, "prony": [(0.5, 0.1)]},
    }.get(kind.__name__, {"youngs": np.linspace(1e4, 1e5, len(BOX.tets)), "poisson": 0.3})
    material = kind(**given)
    scene = sp.Scene([sp.Body("bar", BOX, material)], **STILL)
    found = read_back(scene, tmp_path / "r.vtkhdf").scene.bodies[0].material
    if kind is not sp.EnergyMaterial:
        return
    F = np.eye(3) + 0.1 * np.random.default_rng(1).normal(size=(20, 3, 3))
    np.testing.assert_allclose(found.energy_density(F), material.energy_density(F), rtol=1e-12)
    np.testing.assert_allclose(found.first_piola(F), material.first_piola(F), rtol=1e-9, atol=1e-6)
    assert [found.youngs, found.poisson] == pytest.approx([material.youngs, material.poisson], rel=1e-10)


def test_unit_vectors_stay_the_same_to_the_last_bit():
    rng = np.random.default_rng(3)
    vectors = rng.normal(size=(20_000, 3)) * 10.0 ** rng.integers(-200, 200, (20_000, 1))
    once = unit_vectors(vectors)
    np.testing.assert_allclose(np.linalg.norm(once, axis=1), 1.0, atol=1e-15)
    np.testing.assert_array_equal(unit_vectors(once), once)


def test_regions_and_quadratic_tets_read_back(tmp_path):
    mesh = BOX.to_order(2)
    index = (np.arange(len(mesh.tets)) % 2).astype(np.int32)
    material = sp.Regions(materials=[RUBBER, sp.NeoHookean(youngs=1e4, poisson=0.2)], index=index)
    scene = sp.Scene([sp.Body("bar", mesh, material)], **STILL)
    recording = read_back(scene, tmp_path / "r.vtkhdf")
    np.testing.assert_array_equal(recording.scene.bodies[0].mesh.nodes, mesh.nodes)


def test_functions_are_recorded_by_their_values_in_each_frame(tmp_path):
    calls = {
        "pin": lambda t: np.array([0.1 * t * t, 0.0, 0.0]),
        "each": lambda t: t * np.arange(9.0).reshape(3, 3),
        "floor": lambda t: (0.0, np.sin(t), 0.0),
        "force": lambda t: (0.0, 0.0, 1e-3 * t),
        "pressure": lambda t: 10.0 + t,
    }
    ground = sp.HalfSpace(point=(0, -3, 0), motion=calls["floor"], name="ground")
    scene = sp.Scene(
        [sp.Body("bar", BOX, RUBBER)],
        [ground, sp.HalfSpace(point=(0, -4, 0), motion=calls["floor"])],
        pins=[sp.Pin("bar", [0, 1], motion=calls["pin"]), sp.Pin("bar", [2, 3, 4], motion=calls["each"])],
        forces=[sp.Force("bar", [5], calls["force"])],
        loads=[sp.Pressure("bar", calls["pressure"]), sp.BodyForce(lambda x, t: 0.0 * x)],
        **STILL,
    )
    path = tmp_path / "r.vtkhdf"
    list(sp.simulate(scene, sp.XPBD(substeps=1, contact=None), 0.01, 4, sinks=[sp.Recorder(path)]))
    with h5py.File(path, "r", locking=False) as file:
        assert len(file["supple/frames/functions"]) == 5  # one function is used twice, one is of places
    with sp.read_recording(path) as recording:
        found = recording.scene
        pairs = [
            (found.pins[0].motion, "pin"),
            (found.pins[1].motion, "each"),
            (found.obstacles[0].motion, "floor"),
            (found.obstacles[1].motion, "floor"),
            (found.forces[0].force, "force"),
            (found.loads[0].pressure, "pressure"),
        ]
        for function, name in pairs:
            for t in recording.times:
                np.testing.assert_array_equal(function(t), calls[name](t))
            ends = [np.asarray(calls[name](t)) for t in recording.times[1:3]]
            np.testing.assert_allclose(
                function(0.75 * recording.times[1] + 0.25 * recording.times[2]), 0.75 * ends[0] + 0.25 * ends[1]
            )
            np.testing.assert_array_equal(function(9.0), calls[name](recording.times[-1]))
        with pytest.raises(sp.SceneError, match="a function of places was not recorded"):
            found.loads[1].force(np.zeros((1, 3)), 0.0)
    only = ["balance", "works", "records", "obstacles"]
    assert sp.check_recording(path, only=only).ok


def test_functions_of_motors_actuators_and_inputs_are_recorded(tmp_path):
    given = whole_scene()
    turn = sp.HingeJoint("b", None, point=(3, 0, 0), motor=sp.PositionMotor(lambda t: 0.1 + t, 1.0))
    push = sp.SliderJoint("a", None, motor=sp.ForceMotor(sp.MotorInput("push", 0.3)))
    scene = sp.Scene(
        given.bodies,
        joints=[turn, push],
        cavities=[sp.Cavity("tyre", pressure=lambda t: 5.0)],
        cables=[sp.Cable([("bar", 3), (None, (0, 5, 0))], length=lambda t: 4.0 - t, stiffness=1.0)],
        loads=[sp.Muscle("hat", 1e3, (1, 0, 0), lambda t: 0.25)],
        pins=[sp.Pin("bar", [0], motion=sp.MotionInput("hand", (0.0, 0.0, 0.0)))],
        **STILL,
    )
    read_back(scene, tmp_path / "r.vtkhdf")
    with sp.read_recording(tmp_path / "r.vtkhdf") as recording:
        found = recording.scene
        given = [*(joint.motor.script for joint in found.joints), found.cavities[0].pressure, found.cables[0].length]
        assert [float(function(0.0)) for function in (*given, found.loads[0].activation)] == [0.1, 0.3, 5.0, 4.0, 0.25]
        np.testing.assert_array_equal(found.pins[0].motion(0.0), np.zeros(3))
        assert found.inputs == {}


def test_a_recorded_scene_is_simulated_again_with_the_same_bits(tmp_path):
    floor = sp.HalfSpace(friction=0.3)
    ball = sp.Body("ball", sp.shapes.sphere(0.1, 0.05), RUBBER, position=(0, 0.101, 0), velocity=(0.2, -1, 0))
    block = sp.RigidBody("block", sp.shapes.box_surface((0.1, 0.1, 0.1)), density=300.0, position=(0.3, 0.06, 0))
    path = tmp_path / "r.vtkhdf"
    frames = list(sp.simulate(sp.Scene([ball, block], [floor]), sp.XPBD(), 1 / 60, 5, sinks=[sp.Recorder(path)]))
    with sp.read_recording(path) as recording:
        again = list(sp.simulate(recording.scene, sp.XPBD(), 1 / 60, 5))
    np.testing.assert_array_equal(again[-1].state.positions, frames[-1].state.positions)


@dataclass(frozen=True, eq=False, kw_only=True)
class Stiffening(sp.StableNeoHookean):
    """A material of a user, whose parameter is one of the library's materials."""

    factor: Annotated[float, POSITIVE] = 2.0


def test_a_material_of_a_user_is_known_where_its_class_is(tmp_path):
    path = tmp_path / "r.vtkhdf"
    scene = sp.Scene([sp.Body("bar", BOX, Stiffening(youngs=1e5, poisson=0.3, factor=3.0, density=700.0))], **STILL)
    read_back(scene, path)
    assert sp.check_recording(path)["records"].verdict == "pass"
    with h5py.File(path, "r+") as file:  # as another process reads it
        text = file["supple/header"][()].decode().replace('"class": "Stiffening"', '"class": "Elsewhere"')
        del file["supple/header"]
        file["supple/header"] = text
    with sp.read_recording(path) as recording:
        material = recording.scene.bodies[0].material
        assert (material.name, material.density) == ("Stiffening", 700.0)
        assert (material.per_tet(3).kind == NOT_ELASTIC).all()
        with pytest.raises(sp.SceneError, match="body 'bar' has no known elastic law"):
            _ = recording[-1].stress["bar"]
        np.testing.assert_allclose(recording.masses, 700.0 / 1000.0 * sp.Body("x", BOX, RUBBER).lumped_masses())
    assert sp.check_recording(path).ok


def test_classes_that_are_defined_again_or_have_the_name_of_ours(tmp_path):
    def defined(name):
        return dataclass(frozen=True, eq=False, kw_only=True)(type(name, (Stiffening,), {}))

    first, second = defined("Again"), defined("Again")
    for kind, factor in ((first, 3.0), (second, 4.0)):  # as of a notebook whose cell is executed again
        scene = sp.Scene([sp.Body("bar", BOX, kind(youngs=1e5, poisson=0.3, factor=factor))], **STILL)
        path = tmp_path / "r.vtkhdf"
        recorder = sp.Recorder(path)
        recorder.begin(first_frame(scene, initial_state(scene)), 0.01, 0)
        recorder.end()
        with sp.read_recording(path) as recording:
            found = recording.scene.bodies[0].material
        assert (type(found), found.factor) == (second, factor)
    ours = defined("NeoHookean")
    with pytest.raises(sp.OutputError, match="a NeoHookean cannot be written to a file"):
        read_back(sp.Scene([sp.Body("bar", BOX, ours(youngs=1e5, poisson=0.3))], **STILL), tmp_path / "s.vtkhdf")


def test_only_parts_of_scenes_are_made_from_a_file(tmp_path):
    path = tmp_path / "r.vtkhdf"
    read_back(sp.Scene([sp.Body("bar", BOX, RUBBER)], **STILL), path)
    with h5py.File(path, "r+") as file:
        set_in_scene(file, "scene/bodies/0/material", RUBBER)
        text = file["supple/header"][()].decode().replace('"StableNeoHookean"', '"XPBD"')
        del file["supple/header"]
        file["supple/header"] = text
    with pytest.raises(sp.OutputError, match="the class 'XPBD' is not known here"):
        sp.read_recording(path)
