"""Stitches in XPBD: masked contacts, momentum, obstacles, and the same statics as the implicit solver."""

import numpy as np
import pytest
from tests.scenes import at_start, contact_gap

import supple as sp
from supple.model.system import build_system, initial_state
from supple.solvers.xpbd.solver import XPBD

SOFT = sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=1000)
SHEET = sp.SurfaceMesh([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 2, 1], [0, 3, 2]])


def box(name, y, material=SOFT, **more):
    return sp.Body(name, sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2)), material, position=(0, y, 0), **more)


def stitches_to(second, **more):
    return [
        sp.SoftVertexTriangleStitch("a", second, youngs=1e5, poisson=0.3, **more),
        sp.VertexVertexStitch("a", second, stiffness=100.0, **more),
        sp.VertexEdgeStitch("a", second, stiffness=100.0, **more),
    ]


@pytest.mark.parametrize("gap", [0.0, 0.001])
def test_a_pair_sewn_face_to_face_is_held_by_its_stitches_alone(gap):
    a, b = box("a", 0.15 + gap, angular_velocity=(0, 2, 1), velocity=(0.1, 0, 0)), box("b", 0.05)
    stitch = sp.SoftVertexTriangleStitch("a", "b", max_distance=gap + 1e-6, youngs=1e5, poisson=0.3)
    scene = sp.Scene([a, b], stitches=[stitch], gravity=(0, 0, 0))
    first = at_start(scene)
    P, L = first.linear_momentum, first.angular_momentum
    for frame in sp.simulate(scene, XPBD(substeps=20), 1 / 60, 30):
        report = frame.report
        assert report.details.contacts == 0
        assert report.largest_stitch_stretch < 1.2
        assert np.abs(report.linear_momentum - P).max() <= 1e-9 * np.abs(P).max()
        assert np.abs(report.angular_momentum - L).max() <= 1e-9 * np.abs(L).max()


def test_a_masked_pair_touches_and_its_neighbours_do_not():
    below, above = box("a", -0.05), box("b", 0.051, velocity=(0, -0.05, 0))
    a, b = (body.place(body.mesh.vertices) for body in (below, above))

    def vertex(points, x, y, z):
        return int(np.argmin(np.linalg.norm(points - [x, y, z], axis=1)))

    middles = vertex(a, 0, 0, 0), vertex(b, 0, 0.001, 0)
    corners = vertex(a, 0.05, 0, 0.05), vertex(b, 0.05, 0.001, 0.05)
    gaps = {}
    for name, stitches in (
        ("free", ()),
        ("stitched", [sp.VertexVertexStitch("a", "b", pairs=[middles], stiffness=500.0, rest_length=0.0)]),
    ):
        scene = sp.Scene([below, above], stitches=stitches, gravity=(0, 0, 0))
        frames = list(sp.simulate(scene, XPBD(substeps=20), 1 / 60, 12))
        assert {frame.report.status for frame in frames} == {"converged"}
        (ya, yb) = (np.array([frame.positions[body][:, 1] for frame in frames]) for body in ("a", "b"))
        gaps[name] = [(yb[:, v] - ya[:, u]).min() for u, v in (middles, corners)]
    thickness = contact_gap(above)
    assert min(gaps["free"]) > 0.9 * thickness
    assert gaps["stitched"][0] < 0.7 * thickness
    assert gaps["stitched"][1] > 0.5 * thickness


@pytest.mark.parametrize("kind", range(3), ids=["triangle", "vertex", "edge"])
def test_a_free_sewn_pair_keeps_its_momenta(kind):
    wobbly = sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=1000)
    a, b = box("a", 0.2, wobbly, angular_velocity=(0, 2, 1), velocity=(0.1, 0, 0)), box("b", 0.05, wobbly)
    stitch = stitches_to("b", max_distance=0.051, pairing="all" if kind else "closest")[kind]
    scene = sp.Scene([a, b], stitches=[stitch], gravity=(0, 0, 0))
    system = build_system(scene)
    assert len(np.unique(system.joined_components)) == 1
    frames = list(sp.simulate(scene, XPBD(substeps=20, contact=None), 1 / 60, 60))
    first = at_start(scene)
    P, L = first.linear_momentum, first.angular_momentum
    for frame in frames:
        report = frame.report
        assert np.abs(report.linear_momentum - P).max() <= 1e-9 * np.abs(P).max()
        assert np.abs(report.angular_momentum - L).max() <= 1e-9 * np.abs(L).max()
    moved = frames[-1].positions["b"] - initial_state(scene).positions[system.bodies[1].vertices]
    assert np.abs(moved).max() > 0.02, "the stitches take the second body along"


def test_a_body_hangs_on_a_scripted_obstacle():
    up = sp.Keyframes([0.0, 1.0], [[0, 0, 0], [0, 0.3, 0]])
    sheet = sp.obstacles.TriangleObstacle(name="sheet", surface=SHEET, motion=up)
    calm = sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=1000, damping=0.05)
    stitch = sp.SoftVertexTriangleStitch("a", "sheet", max_distance=0.021, youngs=3e5, poisson=0.3, damping=0.05)
    scene = sp.Scene([box("a", -0.07, calm)], [sheet], stitches=[stitch], gravity=(0, -1, 0))
    *_, frame = sp.simulate(scene, XPBD(substeps=40), 1 / 60, 63)
    assert frame.positions["a"][:, 1].mean() == pytest.approx(0.3 - 0.07, abs=0.01)
    assert np.abs(frame.velocities["a"]).max() < 0.01


@pytest.mark.parametrize("youngs", [1e5, 1e6])
def test_forces_that_stiff_stitches_deliver_carry_the_weight(youngs):
    """Tets share vertices. By the law of their positions they carry up to 29 % too little, where they are stiff."""
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000, damping=0.02)
    box = sp.shapes.box((0.1, 0.05, 0.1), (2, 1, 2))
    bodies = [sp.Body("top", box, rubber, position=(0, 0.06, 0)), sp.Body("low", box, rubber)]
    law = {"youngs": youngs, "poisson": 0.3, "damping": 0.02, "strength": 1e6}
    seam = sp.SoftVertexTriangleStitch("low", "top", max_distance=0.0101, **law)
    held = sp.Pin("top", sp.InBox((-1, 0.0849, -1), (1, 1, 1)))
    scene, solver = sp.Scene(bodies, pins=[held], stitches=[seam]), sp.XPBD(sleep_after=None)
    *_, frame = sp.simulate(scene, solver, 1 / 60, 30)
    _, step = solver.step(frame.system, frame.state, 1 / 60, solver.prepare(frame.system))
    forces = step.stitch_forces
    assert forces is not None
    assert forces.shape == (9, 3)
    assert forces.sum(axis=0) == pytest.approx([0.0, 9.81 * 0.5, 0.0], abs=0.015 * 9.81 * 0.5)
