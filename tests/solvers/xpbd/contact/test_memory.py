"""What contact remembers is in the state: a run continues from any frame with the same bits, in any workspace."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.model.system import initial_state
from supple.solvers.xpbd.contact.memory import ContactMemory
from supple.solvers.xpbd.solver import XPBD

SOFT = sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=1000)
SOLVER = XPBD(substeps=10, start="push_out")
DT = 1 / 60
STEPS = 6


def box(name, position, divisions=(2, 1, 2), **more):
    mesh = sp.shapes.box((0.2, 0.1, 0.2), divisions)
    return sp.Body(name, mesh, SOFT, position=position, friction=0.3, **more)


def pile():
    """Three boxes that overlap at the start, the lowest one on a half-space and a small sphere, with friction."""
    bodies = [box(f"b{k}", (0.02 * k, 0.07 + 0.08 * k, 0), rotation=(0, 0.3 * k, 0)) for k in range(3)]
    return sp.Scene(bodies, [sp.HalfSpace(friction=0.5), sp.obstacles.Sphere(center=(0.05, 0, 0), radius=0.04)])


def folded_strip():
    """A flat U of soft material whose thin legs are driven through the other's surface within the first frames."""
    mesh = sp.shapes.box((0.3, 0.012, 0.05), (24, 1, 2))
    x = mesh.vertices
    radius = 0.3 / (2 * np.pi) * 1.1
    angle = x[:, 0] / radius
    bent = np.stack([(radius - x[:, 1]) * np.sin(angle), -(radius - x[:, 1]) * np.cos(angle), x[:, 2]], axis=1)
    return sp.Body("strip", sp.TetMesh(bent, mesh.tets), SOFT)


def closing():
    """Velocities that close the strip, by body."""
    x = folded_strip().mesh.vertices
    speed = np.where(x[:, 1] > 0.0, -6.5 * np.sign(x[:, 0]) * (x[:, 1] / x[:, 1].max()), 0.0)
    return {"strip": np.stack([speed, 0.0 * speed, 0.3 * speed], axis=1)}


def self_contact():
    return sp.Scene([folded_strip()], gravity=(0, 0, 0))


def stitched():
    """Two boxes stitched face to face, which fall on a moving triangle obstacle."""
    sheet = sp.SurfaceMesh([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 2, 1], [0, 3, 2]])
    obstacle = sp.obstacles.TriangleObstacle(
        name="sheet", surface=sheet, friction=0.4, motion=lambda t: (0.2 * t, 0.5 * t, 0)
    )
    stitch = sp.SoftVertexTriangleStitch("a", "b", max_distance=0.02, youngs=1e5, poisson=0.3, damping=0.01)
    bodies = [box("a", (0, 0.06, 0), velocity=(0.4, -1, 0)), box("b", (0, 0.17, 0), velocity=(0, -2, 0))]
    return sp.Scene(bodies, [obstacle], stitches=[stitch])


SCENES = {
    "self-contact": (self_contact(), closing()),
    "friction": (pile(), None),
    "stitches": (stitched(), None),
}


def run(name, steps):
    scene, velocities = SCENES[name]
    return list(sp.simulate(scene, SOLVER, DT, steps, initial_velocities=velocities))


def same_bits(one, other):
    return np.array_equal(one.positions, other.positions) and np.array_equal(one.velocities, other.velocities)


@pytest.mark.parametrize("name", SCENES)
def test_a_run_that_continues_from_a_frame_has_the_same_bits(name):
    scene, _ = SCENES[name]
    whole = run(name, 2 * STEPS)
    assert max(frame.report.details.contacts for frame in whole) > 0
    for middle in (*whole[:3], whole[STEPS - 1]):
        steps = 2 * STEPS - middle.index
        again = list(sp.simulate(scene, SOLVER, DT, steps, start=middle))
        assert all(same_bits(a.state, b.state) for a, b in zip(whole[-steps:], again, strict=True))
        assert [a.report.min_distance for a in whole[-steps:]] == [b.report.min_distance for b in again]


@pytest.mark.parametrize("name", SCENES)
def test_a_step_depends_on_the_state_and_not_on_what_the_workspace_did_before(name):
    frames = run(name, 2 * STEPS)
    system = frames[0].system
    workspace = SOLVER.prepare(system)
    for k in (2 * STEPS - 2, 0, 1, 3, STEPS):
        state, _ = SOLVER.step(system, frames[k].state, DT, workspace)
        assert same_bits(state, frames[k + 1].state)


def continued(scene, state):
    return list(sp.simulate(scene, SOLVER, DT, 2, start=state))[-1].state


def difference(one, other):
    return np.abs(one.positions - other.positions).max()


@pytest.mark.parametrize(
    ("obstacle", "tolerance"),
    [
        (sp.HalfSpace(point=(0, -5, 0)), 0.0),
        (
            sp.obstacles.TriangleObstacle(
                name="t", surface=sp.SurfaceMesh([[9, 0, 0], [9, 0, 1], [9, 1, 0]], [[0, 1, 2]])
            ),
            1e-5,
        ),
    ],
    ids=["half-space", "triangles"],
)
def test_another_scene_of_the_same_bodies_keeps_the_memory(obstacle, tolerance):
    """As on the live page, where every grab makes a new scene. A distant obstacle changes nothing else."""
    frame = run("self-contact", 1)[-1]
    other = sp.Scene([folded_strip()], [obstacle], gravity=(0, 0, 0))
    kept = continued(self_contact(), frame)
    assert len(frame.state.memory.contact.keys)
    assert difference(continued(other, frame), kept) <= tolerance


def test_memory_that_does_not_describe_the_scene_is_dropped():
    """Other vertices, other triangles on as many vertices, and bodies that are elsewhere."""
    frame = run("self-contact", 1)[-1]
    assert isinstance(frame.state.memory.contact, ContactMemory)
    body, state = folded_strip(), frame.state
    fewer = pile()
    mirrored = sp.Body(
        "strip", sp.TetMesh(body.mesh.vertices[::-1], len(body.mesh.vertices) - 1 - body.mesh.tets), SOFT
    )
    for scene, start in (
        (fewer, initial_state(fewer)),
        (sp.Scene([mirrored], gravity=(0, 0, 0)), replace(state, positions=state.positions[::-1].copy())),
        (self_contact(), replace(state, positions=state.positions + np.array([0.0, 1.0, 0.0]))),
    ):
        with_memory, without = (replace(start, memory=memory) for memory in (state.memory, None))
        assert same_bits(continued(scene, with_memory), continued(scene, without))


@pytest.mark.parametrize("wrong", [[10**6 << 30], [-1], [[0, 1, 2]], [1 << 30, 0]])
def test_lists_that_point_outside_of_the_scene_are_made_anew(wrong):
    state = run("friction", 2)[-1].state
    contact = state.memory.contact
    scene = SCENES["friction"][0]
    ends = []
    for lists in (replace(contact.lists, keys=np.array(wrong), reached=np.zeros(np.shape(wrong))), None):
        memory = replace(state.memory, contact=replace(contact, lists=lists))
        ends.append(continued(scene, replace(state, memory=memory)))
    assert same_bits(*ends)
