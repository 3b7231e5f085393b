"""Stitches in XPBD: masked contacts, momentum, obstacles, and the same statics as the implicit solver."""

import numpy as np
import pytest
from tests.scenes import at_start

import supple as sp
from supple.contact.search.excluded_pairs import stitched_contacts
from supple.model.system import build_system, initial_state
from supple.numerics.geometry.triangle_tree import pair_distances
from supple.solvers.xpbd.contact.collisions import Collisions
from supple.solvers.xpbd.contact.settings import XPBDContact
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


def corner_sets(stitching, n):
    """The vertex, and the set of what it is stitched to, of each stitch."""
    for tet in stitching.tets.vertices:
        yield tet[0], set(tet[1:].tolist())
    for spring in stitching.springs.vertices:
        yield spring[0], set(spring[1:].tolist())


@pytest.mark.parametrize("kind", range(3), ids=["triangle", "vertex", "edge"])
@pytest.mark.parametrize("second", ["b", "sheet"])
def test_only_what_is_stitched_together_does_not_collide(kind, second):
    stitch = stitches_to(second, pairs=[[3, 1]])[kind]
    obstacle = sp.obstacles.TriangleObstacle(name="sheet", surface=SHEET)
    system = build_system(sp.Scene([box("a", 0.2), box("b", 0.05)], [obstacle], stitches=[stitch]))
    collisions = Collisions(system, XPBDContact())
    surfaces = collisions.surfaces.surfaces
    points, triangles = stitched_contacts(system, surfaces, collisions.poses)
    found = set(zip(points.tolist(), triangles.tolist(), strict=True))
    n = len(system.masses)
    # In numbers of vertices: bodies', then the obstacle's.
    place = np.concatenate([surfaces.rows, n + np.arange(4)])
    corners = [set(place[t].tolist()) for t in surfaces.triangles]
    anchors = {n + j: n + int(v) for j, v in enumerate(system.stitching.anchors.vertices)}
    wanted = set()
    for vertex, held in corner_sets(system.stitching, n):
        held = {anchors.get(v, v) for v in held}
        for p, v in enumerate(place):
            for t, triangle in enumerate(corners):
                if (v == vertex and held <= triangle) or (v in held and vertex in triangle):
                    wanted.add((p, t))
    assert found == wanted
    assert len(wanted) >= 4


@pytest.mark.parametrize("pairs", [[[6, 0]], [[6, 0], [7, 1], [8, 5], [15, 20]], None])
@pytest.mark.parametrize("second", ["b", "sheet"])
def test_what_is_sewn_face_to_face_does_not_collide(pairs, second):
    """Where the point is stitched, or all of the triangle, and they are nearer than contact's gap at the start."""
    few = 48 if second == "b" else 2
    how = {"pairs": [[v, t % few] for v, t in pairs]} if pairs else {"max_distance": 0.0011}
    obstacle = sp.obstacles.TriangleObstacle(name="sheet", surface=SHEET)
    stitch = sp.SoftVertexTriangleStitch("a", second, youngs=1e5, poisson=0.3, **how)
    system = build_system(sp.Scene([box("a", 0.051), box("b", -0.05)], [obstacle], stitches=[stitch]))
    collisions = Collisions(system, XPBDContact())
    surfaces = collisions.surfaces.surfaces
    points, triangles = stitched_contacts(system, surfaces, collisions.poses)
    n = len(system.masses)
    place = np.concatenate([surfaces.rows, n + np.arange(4)])
    x = np.concatenate([initial_state(system.scene).positions, SHEET.vertices])[place]
    thing = np.concatenate([np.repeat([0, 1], n // 2), np.full(4, 2)])[place]
    numbers = np.concatenate([np.arange(n), n + system.stitching.anchors.vertices])
    sewn = np.isin(place, numbers[system.stitching.tets.vertices])
    p, t = (k.ravel() for k in np.indices((len(x), len(surfaces.triangles))))
    corners = surfaces.triangles[t]
    near = pair_distances(x[p], x, corners.astype(np.int32)) < collisions.thickness
    joined = {(0, 1), (1, 0)} if second == "b" else {(0, 2), (2, 0)}
    apart = np.array([(one, other) in joined for one, other in zip(thing[p], thing[corners[:, 0]], strict=True)])
    wanted = near & apart & (sewn[p] | sewn[corners].all(axis=1))
    tets = numbers[system.stitching.tets.vertices]
    for vertex, *held in tets:
        wanted |= (place[p] == vertex) & np.isin(place[corners], held).all(axis=1)
        wanted |= np.isin(place[p], held) & (place[corners] == vertex).any(axis=1)
    assert set(zip(points.tolist(), triangles.tolist(), strict=True)) == set(zip(p[wanted], t[wanted], strict=True))


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
        *_, frame = sp.simulate(scene, XPBD(substeps=20), 1 / 60, 12)
        ya, yb = frame.positions["a"][:, 1], frame.positions["b"][:, 1]
        gaps[name] = [yb[v] - ya[u] for u, v in (middles, corners)]
    thickness = Collisions(build_system(scene), XPBDContact()).thickness
    assert min(gaps["free"]) > 0.9 * thickness
    assert gaps["stitched"][0] < 0.7 * thickness
    assert gaps["stitched"][1] > 0.9 * thickness


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
    *_, frame = sp.simulate(scene, XPBD(substeps=40), 1 / 60, 90)
    assert frame.positions["a"][:, 1].mean() == pytest.approx(0.3 - 0.07, abs=0.01)
    assert np.abs(frame.velocities["a"]).max() < 0.01
