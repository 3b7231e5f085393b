"""Which parts of surfaces repel each other: faces whatever their meshes, edges and vertices where they protrude."""

import numpy as np
import pytest

import supple as sp
from supple.contact.barrier.barrier_energy import barrier_hessian, barrier_slopes
from supple.contact.features.pair_geometry import EDGE_EDGE
from supple.model.system import build_system, initial_state
from supple.solvers.implicit.contact.collisions import Barrier
from supple.solvers.implicit.contact.model import contact_model

DHAT = 1e-4
KAPPA = 1e5
SIDE = 0.1
RUBBER = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1000.0)


def model_of(bodies, obstacles=()):
    scene = sp.Scene(bodies, obstacles=list(obstacles))
    system = build_system(scene)
    settings = sp.IPCContact(dhat=DHAT, stiffness=KAPPA)
    model = contact_model(system, settings, np.full(len(system.tets), 1e5))
    return model, np.concatenate([initial_state(scene).positions, *(part.anchors for part in model.obstacles)])


def boxes(lower, upper, gap=0.5 * DHAT, lift=SIDE):
    """Two boxes above each other, made of meshes; the rows of the upper one."""
    model, x = model_of([sp.Body("lower", lower, RUBBER), sp.Body("upper", upper, RUBBER, position=(0, lift + gap, 0))])
    return model, x, slice(len(lower.vertices), None)


def cube(cells, mirrored=False):
    mesh = sp.shapes.box((SIDE,) * 3, (cells,) * 3)
    return sp.TetMesh(mesh.vertices * (-1, 1, 1), mesh.tets) if mirrored else mesh


def force_on(model, x, rows):
    """(3,) with the weights of where things are."""
    model.collisions.forget_weights()
    gradient = np.zeros_like(x)
    Barrier(model.collisions, KAPPA).add_gradient(x, gradient)
    return -gradient[rows].sum(axis=0)


def pressure(gap):
    return -KAPPA * barrier_slopes(gap, DHAT)[0]


@pytest.mark.parametrize(
    "cells", [(1, 1), (2, 2), (3, 3), (4, 4), pytest.param((8, 8), marks=pytest.mark.slow), (3, 4), (2, 5)]
)
@pytest.mark.parametrize("mirrored", [False, True])
def test_aligned_boxes_do_not_push_each_other_sideways(cells, mirrored):
    model, x, rows = boxes(cube(cells[0]), cube(cells[1], mirrored))
    for shift in (0.0, 1e-9, 1e-7, 1e-6, 1e-5, 5e-5, DHAT, 1e-3):
        for way in ([1, 0, 0], [0.8, 0, 0.6], [-0.6, 0, 0.8]):
            moved = x.copy()
            moved[rows] += shift * np.array(way)
            force = force_on(model, moved, rows)
            assert force[1] > 0.0
            # Within 1 um of alignment, distances from outlines and from faces count together.
            assert np.abs(force[[0, 2]]).max() < (1e-4 if shift < 1e-6 else 1e-9) * force[1]
            if shift > DHAT and way[2] != 0.0:
                # No vertex is near an outline: the areas of the faces' vertices make up the face.
                assert force[1] == pytest.approx(SIDE**2 * pressure(0.5 * DHAT), rel=0.4 / min(cells))
                assert not (model.collisions.at(moved).kinds == EDGE_EDGE).any()


def test_flat_contact_has_the_pressure_of_the_barrier_whatever_the_meshes():
    plate = sp.shapes.box((0.3, 0.05, 0.3), (13, 1, 13))
    for gap in (0.1 * DHAT, 0.5 * DHAT, 0.9 * DHAT):
        model, x, rows = boxes(plate, sp.shapes.box((0.2, 0.05, 0.2), (9, 1, 9)), gap, 0.05)
        assert force_on(model, x, rows)[1] == pytest.approx(0.04 * pressure(gap), rel=0.2)


def wedge(length):
    """A ridge along z at the height 0, below it a body of tets."""
    half = 0.5 * length
    points = [
        [0, 0, -half],
        [0, 0, half],
        [0.03, 0.05, -half],
        [0.03, 0.05, half],
        [-0.03, 0.05, -half],
        [-0.03, 0.05, half],
    ]
    return sp.TetMesh(np.array(points), np.array([[0, 2, 4, 1], [2, 4, 1, 3], [4, 1, 3, 5]]))


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.011, 0.007), (-0.03, 0.02)])
def test_a_ridge_far_from_all_vertices_is_held_by_edges(shift):
    """Its ends hang over the plate, and the plate's vertices are at its corners."""
    plate = sp.shapes.box((0.2, 0.05, 0.2), (1, 1, 1))
    model, x, rows = boxes(plate, wedge(0.3), lift=0.025)
    x[rows] += (shift[0], 0.0, shift[1])
    force = force_on(model, x, rows)
    assert force[1] > 0.0
    assert np.abs(force[[0, 2]]).max() < 1e-9 * force[1]
    assert (model.collisions.at(x).kinds == EDGE_EDGE).any()
    # Without a bound.
    lowered = x - 0.499 * DHAT * np.array([0, 1, 0]) * (np.arange(len(x)) >= len(plate.vertices))[:, None]
    assert force_on(model, lowered, rows)[1] > 100 * force[1]


@pytest.mark.parametrize("angle", [0.2, 0.7, np.pi / 2])
def test_crossing_ridges_repel_each_other(angle):
    below = sp.Body("below", sp.TetMesh(wedge(0.1).vertices * (1, -1, 1), wedge(0.1).tets), RUBBER)
    above = sp.Body("above", wedge(0.1), RUBBER, position=(0, 0.5 * DHAT, 0), rotation=(0, angle, 0))
    model, x = model_of([below, above])
    contacts = model.collisions.at(x)
    (row,) = np.flatnonzero(contacts.kinds == EDGE_EDGE)
    assert contacts.distances[row] == pytest.approx(0.5 * DHAT)
    assert contacts.weights[row] == pytest.approx(1.5 * 0.1 * np.hypot(0.03, 0.05) / 3)
    force = force_on(model, x, slice(6, 12))
    assert force[1] > 0.0
    assert np.abs(force[[0, 2]]).max() < 1e-9 * force[1]


def test_the_energy_along_a_ridge_is_constant():
    """A ridge of several edges slides along a ridge across it: edges, vertices and edges again carry it."""
    mesh = sp.shapes.box((0.02, 0.02, 0.2), (1, 1, 10))
    turned = mesh.vertices @ np.array([[1, 1, 0], [-1, 1, 0], [0, 0, np.sqrt(2)]]) / np.sqrt(2)
    lower = sp.TetMesh(turned, mesh.tets)
    upper = wedge(0.1)
    height = float(turned[:, 1].max())
    model, x = model_of(
        [
            sp.Body("lower", lower, RUBBER),
            sp.Body("upper", upper, RUBBER, position=(0, height + 0.3 * DHAT, 0), rotation=(0, np.pi / 2, 0)),
        ]
    )
    rows = slice(len(turned), None)
    energies = []
    for z in np.linspace(-0.03, 0.03, 61):
        moved = x.copy()
        moved[rows, 2] += z
        model.collisions.forget_weights()
        energies.append(Barrier(model.collisions, KAPPA).value(moved))
    assert min(energies) > 0.5 * max(energies)


@pytest.mark.parametrize("offset", [0.0, 0.1, 1.0, 3.0])
def test_a_ridge_that_bends_away_repels_an_edge_across_its_bend(offset):
    """At no offset, times the gap, both edges cross the other one beside their vertex, which is nearest to nothing."""
    ridge = np.array([[-0.05, 0.01, 0], [0, 0, 0], [0.05, 0.01, 0]])
    points = np.concatenate([ridge, ridge + np.array([0, -0.05, 0.05]), ridge + np.array([0, -0.05, -0.05])])
    faces = [[0, 3, 1], [1, 3, 4], [1, 4, 2], [2, 4, 5], [0, 1, 6], [1, 7, 6], [1, 2, 7], [2, 8, 7]]
    sheet = sp.obstacles.TriangleObstacle(surface=sp.SurfaceMesh(points, np.array(faces)), name="ridge")
    for gap in (0.5, 0.1, 0.01, 1e-3):
        body = sp.Body("above", wedge(0.06), RUBBER, position=(offset * gap * DHAT, gap * DHAT, 0))
        model, x = model_of([body], [sheet])
        contacts = model.collisions.at(x)
        between = contacts.kinds == EDGE_EDGE
        assert np.count_nonzero(between) == 2 if offset == 0.0 else between.any()
        force = force_on(model, x, slice(0, 6))
        alone = contacts.weights[between].min() * pressure(contacts.distances[between].min())
        assert force[1] > 0.5 * alone


def test_two_edges_and_their_nearest_end_are_projected_together():
    """Most of both cancels; the sum of their own projections would be too stiff."""
    below = sp.Body("below", sp.TetMesh(wedge(0.1).vertices * (1, -1, 1), wedge(0.1).tets), RUBBER)
    for away in (5e-5, 5e-7):
        across = sp.Body(
            "above", wedge(0.1), RUBBER, position=(0.05 - away, 0.5 * DHAT, 0), rotation=(0, 0.5 * np.pi, 0)
        )
        model, x = model_of([below, across])
        contacts = model.collisions.at(x)
        pair = np.flatnonzero(contacts.kinds == EDGE_EDGE)[0] + np.arange(2)
        both = contacts.where(np.isin(np.arange(len(contacts.kinds)), pair))
        points = model.mesh.points.positions(x)
        dense = {}
        for project in (False, True):
            between = barrier_hessian(points, both, DHAT, KAPPA, project)
            dense[project] = np.zeros((3 * len(points), 3 * len(points)))
            for i, j, block in zip(between.rows, between.columns, between.blocks, strict=True):
                dense[project][3 * i : 3 * i + 3, 3 * j : 3 * j + 3] += block
                if i != j:
                    dense[project][3 * j : 3 * j + 3, 3 * i : 3 * i + 3] += block.T
        values, modes = np.linalg.eigh(dense[False])
        positive = (modes * np.maximum(values, 0.0)) @ modes.T
        assert np.abs(dense[True] - positive).max() < 1e-9 * np.abs(dense[False]).max()


def test_vertices_on_vertices_repel_each_other():
    tip = np.array([[0, 0, 0], [0.03, 0.1, 0.02], [-0.04, 0.1, 0.03], [0.01, 0.1, -0.05]])
    tets = np.array([[0, 1, 2, 3]])
    below = sp.Body("below", sp.TetMesh(tip * (1, -1, 1), tets), RUBBER)
    above = sp.Body("above", sp.TetMesh(tip, tets), RUBBER, position=(0, 0.5 * DHAT, 0))
    model, x = model_of([below, above])
    force = force_on(model, x, slice(4, 8))
    area = model.mesh.areas[model.collisions.at(x).points[0, 0]]
    assert force[1] == pytest.approx(area * pressure(0.5 * DHAT), rel=1e-9)


def test_a_box_in_the_corner_of_a_room_is_pushed_by_every_wall():
    room = sp.obstacles.Box(center=(0, 0, 0), size=(0.3, 0.3, 0.3), inside=True, name="room")
    near, far = 0.15 - 0.5 * SIDE - 0.5 * DHAT, 0.0
    at = {}
    for place in ((near, far, far), (far, near, far), (near, near, far), (near, near, near)):
        model, x = model_of([sp.Body("box", cube(3), RUBBER, position=place)], [room])
        at[place] = force_on(model, x, slice(0, len(cube(3).vertices)))
    alone = at[near, far, far][0]
    assert alone < 0.0
    assert at[far, near, far][1] == pytest.approx(alone, rel=1e-6)
    assert np.abs(at[near, far, far][1:]).max() < 1e-9 * abs(alone)
    # Both walls push as much as alone, but for the edge between them, which counts once less.
    assert at[near, near, far][:2] == pytest.approx([alone, alone], rel=0.1)
    assert at[near, near, near] == pytest.approx([alone] * 3, rel=0.2)


def bumpy(seed):
    """A sheet of triangles with valleys and ridges, as an obstacle."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*[np.linspace(-1e-3, 1e-3, 9)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    heights = 1e-4 * rng.uniform(-1, 1, len(grid))
    points = np.column_stack([grid[:, 0], heights, grid[:, 1]])
    corner = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    faces = np.concatenate(
        [np.column_stack([corner, corner + 1, corner + 10]), np.column_stack([corner, corner + 10, corner + 9])]
    )
    return sp.obstacles.TriangleObstacle(surface=sp.SurfaceMesh(points, faces), name="sheet")


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow), pytest.param(3, marks=pytest.mark.slow)])
def test_with_kept_weights_the_energy_is_the_integral_of_the_force(seed):
    """A tip goes over valleys, edges and peaks: the energy has no jump, and its gradient none."""
    tip = np.array([[0, 0, 0], [0.03, 0.1, 0.02], [-0.04, 0.1, 0.03], [0.01, 0.1, -0.05]])
    body = sp.Body("tip", sp.TetMesh(tip, np.array([[0, 1, 2, 3]])), RUBBER, position=(0, 0.01, 0))
    model, x = model_of([body], [bumpy(seed)])
    rng = np.random.default_rng(seed)
    x[:4] += (*rng.uniform(-5e-4, 5e-4, 1), 0.0, -9e-4)
    barrier = Barrier(model.collisions, KAPPA)
    start = x.copy()
    # Just above the highest place on the way.
    count, width = 2000, 1.8e-3
    low, high = 0.0, 0.01
    for _ in range(30):
        middle = 0.5 * (low + high)
        placed = start - (0.0, 0.01 - middle, 0.0) * (np.arange(len(x)) < 4)[:, None]
        touching = any(
            model.collisions.smallest_distance(placed + (0, 0, z) * (np.arange(len(x)) < 4)[:, None]) < 0.3 * DHAT
            for z in np.linspace(0, width, 40)
        )
        low, high = (middle, high) if touching else (low, middle)
    x = start - (0.0, 0.01 - high, 0.0) * (np.arange(len(x)) < 4)[:, None]
    model.collisions.forget_weights()
    energies, forces = [], []
    path = [x + (0, 0, z) * (np.arange(len(x)) < 4)[:, None] for z in np.linspace(0, width, count + 1)]
    for at in path:
        model.collisions.keep_weights(at)  # weights grow on the first way
    for at in path:
        gradient = np.zeros_like(at)
        barrier.add_gradient(at, gradient)
        energies.append(barrier.value(at))
        forces.append(gradient[:4, 2].sum())
    energies, forces = np.array(energies), np.array(forces)
    steps = 0.5 * (forces[1:] + forces[:-1]) * width / count
    assert energies.max() > 0.0
    assert np.abs(np.diff(energies) - steps).max() < 1e-3 * energies.max()


def test_weights_do_not_change_while_they_are_kept():
    model, x, rows = boxes(cube(2), cube(2))
    model.collisions.keep_weights(x)
    before = Barrier(model.collisions, KAPPA).value(x)
    moved = x.copy()
    moved[rows] += (1e-6, 0, 1e-6)
    assert Barrier(model.collisions, KAPPA).value(moved) == pytest.approx(before, rel=1e-3)
    moved[rows] += (5e-5, 0, 5e-5)
    kept = Barrier(model.collisions, KAPPA).value(moved.copy())
    model.collisions.forget_weights()
    fresh = Barrier(model.collisions, KAPPA).value(moved.copy())
    assert fresh < 0.8 * kept  # no vertex of an outline is left


@pytest.mark.parametrize("met", [-2e-6, 0.0, 2e-6])
def test_known_vertices_cross_an_outline_without_a_jump_or_a_force_along_the_face(met):
    """Within a step: met over the face or beyond its outline, with lower faces that are not quite plane."""
    bent = cube(2)
    vertices = bent.vertices.copy()
    vertices[:, 1] -= 1e-3 * vertices[:, 0] ** 2 + 2e-3 * vertices[:, 2] ** 2
    model, x, rows = boxes(sp.TetMesh(vertices, bent.tets), cube(3))
    barrier = Barrier(model.collisions, KAPPA)

    def at(shift):
        moved = x.copy()
        moved[rows] += shift * np.array([0.6, 0.0, 0.8])
        return moved

    model.collisions.forget_weights()
    model.collisions.keep_weights(at(met))
    shifts = np.linspace(-1e-5, 1e-5, 81)
    energies, forces = [], []
    for shift in shifts:
        moved = at(shift)
        gradient = np.zeros_like(x)
        barrier.add_gradient(moved, gradient)
        energies.append(barrier.value(moved))
        forces.append(gradient[rows].sum(axis=0))
    along = np.array(forces)[:, [0, 2]] @ (0.6, 0.8)
    assert np.abs(along).max() < 2e-3 * np.abs(np.array(forces)[:, 1]).max()
    # The energy is that of these forces.
    work = np.diff(shifts) * 0.5 * (along[1:] + along[:-1])
    assert np.abs(np.diff(energies) - work).max() < 3e-9 * max(energies)


def beside_another_part():
    """Vertices beside an outline come before the side of another part, out of contact's reach."""
    part = sp.shapes.box((SIDE, SIDE, 1.5 * SIDE), (1, 1, 1))
    away = np.array([SIDE + 1.25 * DHAT, 0.9 * DHAT, 0.0])
    lower = cube(1)
    both = sp.TetMesh(
        np.concatenate([lower.vertices, part.vertices + away]), np.concatenate([lower.tets, part.tets + 8])
    )
    return both, np.array([0.2, 0.4, 0.0]) * DHAT, np.array([0.0, -1.0, 0.0])


def beside_a_corner():
    """A vertex is beside two edges of an L, and comes nearer to one of them."""
    block = sp.shapes.box((2 * SIDE, SIDE, 2 * SIDE), (2, 1, 2))
    kept = (block.vertices[block.tets].mean(axis=1)[:, [0, 2]] < 0.0).any(axis=1)
    corner = np.array([0.4 * DHAT - 0.5 * SIDE, 0.2 * DHAT, 0.4 * DHAT - 0.5 * SIDE])
    return sp.TetMesh.dropping_unused(block.vertices, block.tets[kept]), corner, np.array([1.0, 0.0, -1.0])


@pytest.mark.parametrize("place", [beside_another_part, beside_a_corner])
def test_nothing_jumps_where_another_feature_is_the_nearest_or_begins_to_count(place):
    lower, shift, way = place()
    model, x, rows = boxes(lower, cube(1))
    barrier = Barrier(model.collisions, KAPPA)
    x[rows] += shift
    energies, forces = [], []
    over = x.copy()
    over[rows] -= DHAT * np.array([1.0, 0.0, 1.0])
    model.collisions.keep_weights(over)
    for step in (-1e-9, 1e-9):
        moved = x.copy()
        moved[rows] += step * way
        model.collisions.keep_weights(moved)
        gradient = np.zeros_like(x)
        barrier.add_gradient(moved, gradient)
        energies.append(barrier.value(moved))
        forces.append(gradient[rows])
    assert min(energies) > 0.0
    assert abs(np.diff(energies)[0]) < 1e-3 * max(energies)
    assert np.abs(forces[1] - forces[0]).max() < 1e-3 * np.abs(forces[0]).max()


def test_a_vertex_on_a_diagonal_counts_once_whatever_the_round_off():
    """The closest point may have a barycentric coordinate that is a rounding error below zero."""
    floor = sp.obstacles.Box(center=(0, -0.05, 0), size=(0.2, 0.1, 0.2))
    model, x = model_of([sp.Body("cube", cube(1), RUBBER)], [floor])
    rng = np.random.default_rng(0)
    corners = np.flatnonzero(x[:8, 1] < 0.0)
    for _ in range(500):
        vertex = rng.choice(corners)
        moved, gap = x.copy(), DHAT * rng.uniform(0.1, 0.9)
        place = np.sign(x[vertex]) * rng.uniform(0.01, 0.09)
        moved[:8] += [place[0] - x[vertex, 0], gap - x[vertex, 1], place[2] - x[vertex, 2]]
        moved[vertex, 2] += rng.choice([0.0, 1e-17, -1e-17, 1e-16])
        model.collisions.forget_weights()
        contacts = model.collisions.at(moved)
        own = contacts.points[:, 0] == vertex
        assert contacts.weights[own].sum() == pytest.approx(0.5 * model.mesh.areas[vertex])
        assert contacts.distances[own] == pytest.approx(gap)


def test_edges_in_a_crease_repel_each_other_where_their_surface_comes_nearer_beside_them():
    """Two faces that meet at an edge A B, nearly closed; their diagonals cross."""
    height = 0.25 * DHAT
    a, b, p, beside_p, q, beside_q = (0, 0, 0), (0, 0, 1), (1, 1, 1), (1, 1, 0), (1, -1, 0), (1, -1, 1)
    points = np.array([a, b, p, beside_p, q, beside_q, (0.5, 0, 0.5), (0.5, 0, 0.5)]) * (0.01, height, 0.01)
    points[6:, 1] = 0.01, -0.01
    tets = np.array([[0, 2, 1, 6], [0, 2, 3, 6], [1, 4, 0, 7], [1, 4, 5, 7], [0, 1, 6, 7]])
    model, x = model_of([sp.Body("crease", sp.TetMesh(points, tets), RUBBER)])
    contacts = model.collisions.at(x)
    (row,) = np.flatnonzero((np.sort(contacts.points) == [0, 1, 2, 4]).all(axis=1))
    assert contacts.kinds[row] == EDGE_EDGE
    assert contacts.distances[row] == pytest.approx(height, rel=1e-3)
    assert contacts.weights[row] > 0.0
