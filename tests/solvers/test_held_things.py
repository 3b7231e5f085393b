"""A pin gives all that the thing it holds takes: in momentum, so that it carries the weight, and in energy."""

import numpy as np
import pytest

import supple as sp

G = 9.81
BOX = sp.shapes.box_surface((0.1, 0.1, 0.1), (1, 1, 1))
CUBE = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2))
RUBBER = sp.StableNeoHookean(youngs=2e5, poisson=0.3, density=1000.0, damping=0.05)
BELOW = (0, 0.9, 0)
# The lower end of the crane and the upper one of the load, in their own coordinates.
ENDS = ("crane", (0, -0.05, 0)), ("load", (0, 0.05, 0))
TOP = sp.InBox((-1, 1.049, -1), (1, 1.051, 1))
SOLVERS = {"xpbd": sp.XPBD(), "implicit": sp.Implicit()}


def block(name, y, mass, x=0.0):
    return sp.RigidBody(name, BOX, mass=mass, position=(x, y, 0))


def soft(name, y, material=RUBBER):
    return sp.Body(name, CUBE, material, position=(0, y, 0))


def crane(*others, **parts):
    return {"bodies": [block("crane", 1.0, 1.0), *others], **parts}


def bar(*others, **parts):
    return {"bodies": [soft("crane", 1.0), *others], "held": TOP, **parts}


def hollow():
    whole = sp.shapes.box((0.1, 0.1, 0.1), (3, 3, 3))
    middles = np.abs(whole.vertices[whole.tets].mean(axis=1)).max(axis=1)
    return sp.TetMesh(whole.vertices, whole.tets[middles > 0.05 / 3])


LOAD = block("load", 0.8, 4.0)
TIED = sp.VertexVertexStitch("load", "crane", max_distance=0.006, stiffness=3e4)
SEWN = sp.SoftVertexTriangleStitch("load", "crane", max_distance=0.006, youngs=1e6, poisson=0.3)
WELD = sp.Weld("load", "crane", max_distance=1e-3)
SCENES = {
    "fixed": crane(LOAD, joints=[sp.FixedJoint("load", "crane")]),
    "ball": crane(LOAD, joints=[sp.BallJoint("crane", "load", point=BELOW)]),
    "hinge": crane(LOAD, joints=[sp.HingeJoint("load", "crane", point=BELOW)]),
    "universal": crane(LOAD, joints=[sp.UniversalJoint("load", "crane", point=BELOW)]),
    "slider": crane(LOAD, joints=[sp.SliderJoint("load", "crane", axis=(0, 1, 0), limits=(-1e-6, 0.01), point=BELOW)]),
    "motor": crane(
        block("load", 1.0, 4.0, x=0.2),
        joints=[sp.HingeJoint("load", "crane", point=(0.1, 1, 0), motor=sp.PositionMotor(0.0, 100.0, damping=2.0))],
    ),
    "chain": crane(
        LOAD,
        block("last", 0.6, 2.0),
        joints=[sp.BallJoint("load", "crane", point=BELOW), sp.BallJoint("last", "load", point=(0, 0.7, 0))],
    ),
    "weld": crane(soft("load", 0.9), welds=[WELD]),
    "weld and block": crane(
        soft("load", 0.9), block("last", 0.8, 2.0), welds=[WELD, sp.Weld("load", "last", max_distance=1e-3)]
    ),
    "stitch": crane(soft("load", 0.895), stitches=[TIED]),
    "stitch tets": crane(soft("load", 0.895), stitches=[SEWN]),
    "cable": crane(LOAD, cables=[sp.Cable(ENDS, length=0.1, stiffness=2e4)]),
    "spring": crane(LOAD, loads=[sp.Spring(*ENDS, stiffness=2e4)]),
    "contact": crane(block("load", 1.1011, 4.0)),
    "soft": bar(),
    "soft, weld": bar(block("load", 0.9, 4.0), welds=[sp.Weld("crane", "load", max_distance=1e-3)]),
    "soft, stitch tets": bar(soft("load", 1.105), stitches=[SEWN]),
    "soft, contact": bar(soft("load", 1.1011)),
    "soft, muscle": bar(loads=[sp.Muscle("crane", 5e3, (0, 1, 0))]),
    "soft, pressure": bar(loads=[sp.Pressure("crane", 2e3)]),
    "soft, cavity": {
        "bodies": [sp.Body("crane", hollow(), RUBBER, position=(0, 1, 0))],
        "held": TOP,
        "cavities": [sp.Cavity("crane", pressure=2e3)],
    },
    "edges": {
        "bodies": [soft("crane", 1.0, sp.EdgesAndVolume(edge_compliance=1e-4, volume_compliance=1e-9))],
        "held": TOP,
    },
}
# Relatives of others, or long.
SLOW = (
    "ball",
    "weld",
    "soft",
    "hinge",
    "universal",
    "slider",
    "stitch",
    "cable",
    "soft, stitch tets",
    "soft, contact",
    "soft, pressure",
    "edges",
)
CASES = [
    pytest.param(name, solver, marks=[pytest.mark.slow] if name in SLOW else [])
    for name in SCENES
    for solver in SOLVERS
    if (name, solver) != ("edges", "implicit")
]


def scene_of(name, motion=None):
    parts = dict(SCENES[name])
    return sp.Scene(pins=[sp.Pin("crane", parts.pop("held", None), motion=motion)], **parts)


def mass_of(scene):
    return sum(float(body.lumped_masses().sum()) for body in scene.bodies)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("name", ["fixed", "weld and block", "contact", "soft"])
def test_it_carries_the_weight_of_all_that_hangs_on_it_and_sleeps(name, solver):
    scene = scene_of(name)
    frames = list(sp.simulate(scene, SOLVERS[solver], 1 / 60, 60))
    weight = [0, G * mass_of(scene), 0]
    np.testing.assert_allclose(next(iter(frames[-1].reactions.values())), weight, atol=0.005 * weight[1])


@pytest.mark.parametrize(("name", "solver"), CASES)
def test_it_gives_the_momentum_and_the_energy_that_all_gain(name, solver, tmp_path):
    """Up and aside, with jumps of its velocity."""
    up = sp.Keyframes([0, 0.15, 0.3, 0.45], displacements=[(0, 0, 0), (0.02, 0.05, 0), (0.04, 0.15, 0), (0, 0.25, 0)])
    scene = scene_of(name, up)
    sink = sp.Recorder(tmp_path / "held.vtkhdf")
    frames = list(sp.simulate(scene, SOLVERS[solver], 1 / 60, 27, sinks=[sink]))
    assert {str(frame.report.status) for frame in frames} == {"converged"}
    mass = mass_of(scene)
    momenta = np.array([frame.report.linear_momentum for frame in frames])
    forces = np.array([next(iter(frame.reactions.values())) for frame in frames])
    gained = 60.0 * np.diff(momenta, axis=0) - mass * np.asarray(scene.gravity)
    np.testing.assert_allclose(forces[1:], gained, atol=5e-4 * mass * G)
    # What is numerical are losses in jumps; nothing is without a name.
    works = [dict(frame.report.work) for frame in frames]
    sizes = sum(abs(value) for work in works for value in work.values())
    assert abs(sum(frame.report.energy_residual for frame in frames)) < 1e-3 * sizes
    assert abs(sum(work["numerical"] for work in works)) < 0.12 * sizes
    assert sum(work["pins"] for work in works) > 0.97 * mass * G * 0.25
    assert sp.check_recording(tmp_path / "held.vtkhdf").ok


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("speed", [5.0, pytest.param(30.0, marks=pytest.mark.slow)])
def test_a_pin_that_pushes_a_bar_fast_does_its_work(speed, solver, tmp_path):
    """A metre there and back, faster than waves of the bar go. What a solver does not solve has a status."""
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000)
    bar = sp.Body("bar", sp.shapes.box((0.4, 0.05, 0.05), (12, 2, 2)), rubber)
    there = sp.Keyframes([0, 1 / speed, 2 / speed], displacements=[(0, 0, 0), (-1, 0, 0), (0, 0, 0)])
    pin = sp.Pin("bar", sp.InBox((-0.201, -1, -1), (-0.199, 1, 1)), motion=there)
    path = tmp_path / "bar.vtkhdf"
    scene = sp.Scene([bar], pins=[pin])
    frames = list(sp.simulate(scene, SOLVERS[solver], 1 / 60, 26, sinks=[sp.Recorder(path)]))
    sizes = sum(abs(work) for frame in frames for work in frame.report.work.values())
    good = [frame.report for frame in frames if frame.report.status == "converged"]
    assert sum(abs(report.energy_residual) for report in good) < 0.02 * sizes
    failed = {result.name for result in sp.check_recording(path).failures}
    # At 30 m/s, reactions at the ends of XPBD's frames lack a seventh of the work that its substeps did.
    seen = {"works"} if speed > 5.0 and solver == "xpbd" else set()
    assert failed & {"scale", "balance", "works", "energy"} <= seen
    if solver == "implicit":
        assert speed > 5.0 or len(good) == len(frames)
        assert failed <= {"status"}


RISING = sp.Keyframes([0, 0.2, 0.5], displacements=[(0, 0, 0), (0, 0.1, 0), (0.05, 0.25, 0)], angles=[0, 0, 0.2])
LIFTED = {
    "stands": {"bodies": [block("load", 0.1011, 1.0)]},
    "fixed": {"bodies": [block("load", 0.2, 1.0)], "joints": [sp.FixedJoint("load", "lift")]},
    "ball": {"bodies": [block("load", -0.2, 1.0)], "joints": [sp.BallJoint("load", "lift", point=(0, -0.1, 0))]},
    "stitch": {
        "bodies": [soft("load", 0.105)],
        "stitches": [sp.SoftVertexTriangleStitch("load", "lift", max_distance=0.006, youngs=1e6, poisson=0.3)],
    },
}
NAMES = {"stands": "contact", "fixed": "joints", "ball": "joints", "stitch": "anchors"}


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("name", LIFTED)
def test_an_obstacle_that_rises_does_the_work_on_what_it_holds(name, solver, tmp_path):
    lift = sp.obstacles.TriangleObstacle(
        name="lift", surface=sp.shapes.box_surface((0.4, 0.1, 0.4), (4, 1, 4)), motion=RISING, friction=0.5
    )
    scene = sp.Scene(obstacles=[lift], **LIFTED[name])
    path = tmp_path / "lift.vtkhdf"
    frames = list(sp.simulate(scene, SOLVERS[solver], 1 / 60, 30, sinks=[sp.Recorder(path)]))
    works = {key: sum(frame.report.work[key] for frame in frames) for key in frames[0].report.work}
    given = works[NAMES[name]] + works["friction"]
    assert given > mass_of(scene) * G * 0.24
    assert abs(works["numerical"]) < 0.07 * given
    assert sp.check_recording(path).ok
