"""Stitches between soft and rigid bodies, and between rigid ones: pairs, forces, both solvers, recordings."""

import numpy as np
import pytest

import supple as sp
from supple.model.stitched_points import stitched_state, with_stitched_points
from supple.model.system import build_system, initial_state
from supple.scene.stitches.measures import StitchEnds
from supple.solvers.implicit.energies.potential import HessianBlocks
from supple.solvers.implicit.energies.stitches import StitchEnergy
from supple.solvers.implicit.newton.reduction import Reduction

G = 9.81
BAR = sp.shapes.box((0.4, 0.1, 0.1), (8, 2, 2))
CUBE = sp.shapes.box_surface((0.1, 0.1, 0.1), (2, 2, 2))
WALL = sp.InBox((-1, -1, -1), (-0.199, 1, 1))


def bar(size=1.0, youngs=2e5, **values):
    law = sp.StableNeoHookean(youngs=youngs, poisson=0.3, density=1000.0, damping=values.pop("damping", 0.0))
    return sp.Body("bar", sp.shapes.box((0.4 * size, 0.1 * size, 0.1 * size), (8, 2, 2)), law, **values)


def cube(size=1.0, gap=0.001, name="cube", **values):
    surface = sp.SurfaceMesh(size * CUBE.vertices, CUBE.triangles)
    return sp.RigidBody(name, surface, density=1000.0, position=((0.25 + gap) * size, 0, 0), **values)


def stitch(kind, first="bar", second="cube", size=1.0, gap=0.001, youngs=2e6, **values):
    reach = {"max_distance": (gap + 1e-6) * size, **values}
    if kind == "tets":
        return sp.SoftVertexTriangleStitch(first, second, youngs=youngs, poisson=0.3, **reach)
    springs = {"vertices": sp.VertexVertexStitch, "edges": sp.VertexEdgeStitch}[kind]
    return springs(first, second, stiffness=0.005 * youngs * size, **reach)


def test_pairs_are_on_the_surface_of_the_rigid_body():
    scene = sp.Scene([bar(), cube()], stitches=[stitch("vertices"), stitch("tets", "cube", "bar")])
    stitching, x = scene.stitching, initial_state(scene).positions
    springs, tets = (part.pairs for part in stitching.ranges)
    assert len(springs.vertices) == len(tets.vertices) == 9
    surface = scene.bodies[1].place(scene.bodies[1].points)
    np.testing.assert_allclose(surface[springs.rows], x[springs.vertices] + [0.001, 0, 0], atol=1e-15)
    np.testing.assert_allclose(surface[tets.vertices][:, 0], 0.201, atol=1e-15)
    # Each point of the rigid body is one node, though two stitches use it.
    assert len(stitching.apart) == 9
    np.testing.assert_allclose(stitching.apart.positions(x), surface[np.unique(springs.rows)], atol=1e-15)
    system = build_system(scene)
    assert np.array_equal(system.points.positions(x)[stitching.rigid.points], stitching.apart.positions(x))
    assert len(np.unique(system.joined_components)) == 1


@pytest.mark.parametrize("kind", ["tets", "vertices", "edges"])
@pytest.mark.parametrize("first", ["bar", "cube"])
def test_derivatives_by_the_control_points_have_slope_two(kind, first):
    second = "cube" if first == "bar" else "bar"
    scene = sp.Scene([bar(), cube()], stitches=[stitch(kind, first, second)])
    system = with_stitched_points(build_system(scene))
    energy, reduction = StitchEnergy.of(system.stitching, 0.0), Reduction.of(system)
    rng = np.random.default_rng(3)
    x = stitched_state(system, initial_state(scene)).positions + 2e-3 * rng.normal(size=(len(system.masses), 3))
    system.welding.follow(x)
    d = rng.normal(size=x.shape)
    system.welding.follow(d)
    free, gradient = np.where(reduction.welded[:, None], 0.0, d), np.zeros_like(x)
    energy.add_gradient(x, gradient)
    gradient = system.welding.reduced(gradient)
    blocks = HessianBlocks.zeros(len(system.tets), len(x), len(system.stitching))
    energy.add_hessian(x, blocks, False)
    product = np.zeros_like(x)
    for one in reduction.couplings(blocks):
        one.add_product(free, product)
    for nodes, block in zip(system.stitching.elements(), blocks.stitches, strict=True):
        own = np.array([n >= 0 and not reduction.welded[n] for n in nodes])
        moved = block @ (np.where(own[:, None], free[nodes], 0.0)).ravel()
        np.add.at(product, nodes[own], moved.reshape(4, 3)[own])
    values = []
    for eps in (1e-4, 5e-5):
        there = energy.value(x + eps * d)
        values.append([there - energy.value(x) - eps * float((gradient * free).sum())])
        values[-1].append(values[-1][0] - 0.5 * eps**2 * float((free * product).sum()))
    (first_order, second_order), (half, quarter) = values
    assert first_order / half == pytest.approx(4.0, rel=0.1)
    assert second_order / quarter == pytest.approx(8.0, rel=0.1)


@pytest.mark.parametrize("kind", ["tets", "vertices"])
def test_a_pin_carries_the_weight_of_both(kind):
    scene = sp.Scene([bar(), cube()], pins=[sp.Pin("bar", WALL)], stitches=[stitch(kind)])
    (frame,) = sp.simulate(scene, sp.Implicit(integrator="static"), 1.0, 1)
    assert frame.report.status == "converged"
    (force,) = frame.report.details.reaction_forces.values()
    np.testing.assert_allclose(force, [0, 5.0 * G, 0], atol=1e-7)


def test_both_solvers_hang_a_cube_equally_far():
    """A damped bar that hangs from a wall, with a cube at its tip."""
    ends = []
    for solver, steps, dt in ((sp.Implicit(integrator="static"), 1, 1.0), (sp.XPBD(), 60, 1 / 30)):
        scene = sp.Scene([bar(damping=0.3), cube()], pins=[sp.Pin("bar", WALL)], stitches=[stitch("tets")])
        *_, frame = sp.simulate(scene, solver, dt, steps)
        assert frame.report.status == "converged", frame.report.message
        ends.append(-frame.poses["cube"].translation[1])
    assert ends[0] > 0.15
    assert ends[1] == pytest.approx(ends[0], rel=0.03)


@pytest.mark.parametrize(("rigid", "damping"), [(False, 0.0), (False, 0.02), (True, 0.01)])
@pytest.mark.parametrize("kind", ["tets", "vertices"])
@pytest.mark.parametrize(
    ("solver", "rate", "lost"),
    [(sp.XPBD(), 60, 1e-9), (sp.Implicit(integrator="bdf2"), 240, 1e-3)],
    ids=["xpbd", "bdf2"],
)
def test_a_spinning_pair_keeps_its_momenta_and_gains_no_energy(solver, rate, lost, kind, rigid, damping):
    """`lost` : the share of the angular momentum; in `Implicit`, BDF2 keeps it up to the square of the step."""
    first = cube(gap=-0.1, name="bar") if rigid else bar(damping=damping)
    other = cube()
    spin, center = np.array([1.0, 2.0, 5.0]), np.array([0.05, 0, 0])
    scene = sp.Scene([first, other], stitches=[stitch(kind, damping=damping)], gravity=(0, 0, 0))
    placed = initial_state(scene)
    x = build_system(scene).split(placed.positions)
    velocities = {name: np.array([0.1, 0.0, 0.0]) + np.cross(spin, points - center) for name, points in x.items()}
    frames = sp.simulate(scene, solver, 1 / rate, rate // 4, initial_velocities=velocities)
    reports = [frame.report for frame in frames]
    assert {str(report.status) for report in reports} == {"converged"}
    energies = [item.kinetic_energy + item.elastic_energy + item.stitch_energy for item in reports]
    assert max(energies) < 1.02 * energies[0]
    for key, least in (("linear_momentum", 1e-9), ("angular_momentum", lost)):
        began, ended = getattr(reports[0], key), getattr(reports[-1], key)
        np.testing.assert_allclose(ended, began, atol=least * np.linalg.norm(began))


@pytest.mark.parametrize("solver", [sp.XPBD(), sp.Implicit()], ids=["xpbd", "implicit"])
def test_faces_that_nearly_touch_and_are_stitched_do_not_push_each_other(tmp_path, solver):
    """A soft block between two rigid plates, 0.1 mm apart; the lower plate is held, the upper one rests."""
    block = sp.Body(
        "block", sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2)), sp.StableNeoHookean(youngs=1e5, poisson=0.3, damping=0.05)
    )
    plate = sp.shapes.box_surface((0.1, 0.02, 0.1), (2, 1, 2))
    low = sp.RigidBody("low", plate, density=1000.0, position=(0, -0.0601, 0))
    high = sp.RigidBody("high", plate, density=1000.0, position=(0, 0.0601, 0))
    seams = [
        sp.SoftVertexTriangleStitch("block", name, youngs=1e6, poisson=0.3, max_distance=2e-4)
        for name in ("low", "high")
    ]
    scene = sp.Scene([block, low, high], pins=[sp.Pin("low")], stitches=seams)
    path = tmp_path / "r.vtkhdf"
    *_, frame = sp.simulate(scene, solver, 1 / 60, 10, sinks=[sp.Recorder(path)])
    assert frame.report.status == "converged"
    assert frame.report.details.contacts == 0
    # Each seam moved its rest vertices by up to a hundredth of an edge of 5 cm.
    assert 0.0 < frame.poses["high"].translation[1] - 0.0601 < 2 * 5e-4
    report = sp.check_recording(path)
    assert report.ok, str(report)


@pytest.mark.parametrize("solver", [sp.XPBD(), sp.Implicit(integrator="bdf2")], ids=["xpbd", "bdf2"])
def test_recordings_have_the_points_on_rigid_bodies(tmp_path, solver):
    path = tmp_path / "r.vtkhdf"
    scene = sp.Scene(
        [bar(damping=0.02), cube()], pins=[sp.Pin("bar", WALL)], stitches=[stitch("tets"), stitch("edges")]
    )
    *_, frame = sp.simulate(scene, solver, 1 / 60, 6, sinks=[sp.Recorder(path)])
    with sp.read_recording(path) as recording:
        kept = recording[-1]
        segments = recording.stitches.segments(kept.state.positions, kept.obstacle_poses)
        whole = frame.system.scene
        live = StitchEnds.of(whole.stitching, whole.bodies).segments(frame.state.positions, kept.obstacle_poses)
    np.testing.assert_allclose(segments, live, atol=1e-15)
    tips = frame.positions["bar"][np.isclose(BAR.vertices[:, 0], 0.2)]
    np.testing.assert_allclose(segments[:9, 0], tips, atol=1e-15)
    pose = frame.poses["cube"]
    there = (segments[:9, 1] - pose.translation) @ pose.rotation
    np.testing.assert_allclose(there[:, 0], -0.05, atol=1e-6)
    report = sp.check_recording(path)
    assert report.ok, str(report)


def test_a_run_goes_on_with_the_same_bits():
    scene = sp.Scene([bar(), cube()], pins=[sp.Pin("bar", WALL)], stitches=[stitch("tets", damping=0.01)])
    *_, third, _, fifth = sp.simulate(scene, sp.XPBD(substeps=40), 1 / 60, 5)
    *_, again = sp.simulate(scene, sp.XPBD(substeps=40), 1 / 60, 2, start=third)
    assert np.array_equal(again.state.positions, fifth.state.positions)
