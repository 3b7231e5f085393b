"""Quads split for contact: the surface does not change, and equal boxes above each other stay there."""

import numpy as np
import pytest

import supple as sp
from supple.contact.collision_mesh.quad_split import split_quads
from supple.implicit.contact.barrier import Barrier
from supple.implicit.contact.build import contact_model
from supple.implicit.contact.settings import IPCContact
from supple.system import build_system, initial_state

SIDE = 0.1


def cut(points, faces):
    return split_quads(points, faces, np.zeros(len(points), dtype=np.int32))


def areas(points, faces):
    a, b, c = points[faces].transpose(1, 0, 2)
    return 0.5 * np.cross(b - a, c - a)


def test_a_box_has_both_diagonals_in_every_quad():
    surface = sp.shapes.box((3.0, 2.0, 1.0), (3, 4, 2)).surface
    faces, diagonals = cut(surface.vertices, surface.triangles)
    squares = 2 * (3 * 4 + 4 * 2 + 2 * 3)
    assert len(diagonals) == squares
    assert len(faces) == 4 * squares
    points = np.concatenate([surface.vertices, surface.vertices[diagonals].mean(axis=1)])
    counts = np.bincount(faces.ravel(), minlength=len(points))
    assert (counts[len(surface.vertices) :] == 4).all()
    # The same area, all of it facing outside; closed.
    assert areas(points, faces).sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-12)
    outside = np.einsum("ij,ij->i", areas(points, faces), points[faces].mean(axis=1))
    assert (outside > 0).all()
    assert np.linalg.norm(areas(points, faces), axis=1).sum() == pytest.approx(22.0)


def test_a_bent_surface_does_not_change():
    surface = sp.shapes.box((1.0, 1.0, 1.0), (3, 3, 3)).surface
    faces, diagonals = cut(surface.vertices, surface.triangles)
    bent = surface.vertices + 0.1 * np.sin(5.0 * surface.vertices[:, [1, 2, 0]])
    points = np.concatenate([bent, bent[diagonals].mean(axis=1)])
    old, new = areas(bent, surface.triangles), areas(points, faces)
    assert np.linalg.norm(new, axis=1).sum() == pytest.approx(np.linalg.norm(old, axis=1).sum(), rel=1e-12)


def test_quads_that_are_no_flat_rectangles_are_not_split():
    ball = sp.shapes.sphere(radius=0.5, edge_length=0.2).surface
    faces, diagonals = cut(ball.vertices, ball.triangles)
    assert len(diagonals) == 0
    assert np.array_equal(faces, ball.triangles)
    coarse = sp.shapes.box((1, 1, 1), (2, 2, 2)).surface
    assert len(cut(coarse.vertices, coarse.triangles)[1]) == 0
    # Three squares that share one diagonal are no surface.
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0.7]], dtype=float)
    fan = np.array([[0, 1, 2], [0, 2, 3], [0, 2, 4]])
    assert len(cut(corners, fan)[1]) == 0


def two_cubes(divisions, gap=1e-4):
    material = sp.StableNeoHookean(youngs=1e6, poisson=0.3, density=1000.0)
    mesh = sp.shapes.box((SIDE,) * 3, (divisions,) * 3)
    low, high = sp.Body("low", mesh, material), sp.Body("high", mesh, material, position=(0, SIDE + gap, 0))
    scene = sp.Scene([low, high])
    model = contact_model(build_system(scene), IPCContact(dhat=1.25 * gap), np.full(2 * len(mesh.tets), 1e6 / 2.6))
    return model, initial_state(scene).positions


def push(model, x):
    """Force (3,) on the upper cube, and its moment about its own axis, as shares of the pressing force."""
    barrier = Barrier(model.collisions, 1e6)
    gradient = np.zeros_like(x)
    barrier.add_gradient(np.ascontiguousarray(x), gradient)
    upper = slice(len(x) // 2, None)
    forces, arms = -gradient[upper], x[upper] - x[upper].mean(axis=0)
    total = forces.sum(axis=0)
    return total / total[1], np.cross(arms, forces).sum(axis=0)[1] / (0.5 * SIDE * total[1])


@pytest.mark.parametrize("divisions", [4, 5, 8])
def test_equal_cubes_above_each_other_are_pushed_back(divisions):
    """Without the second diagonal, a shift by d is increased by 700 d / m of the pressing force."""
    model, x = two_cubes(divisions)
    upper = slice(len(x) // 2, None)
    share, turn = push(model, x)
    assert np.abs(share[[0, 2]]).max() < 1e-12
    assert abs(turn) < 1e-12
    for d in (1e-8, 1e-6, 1e-5):
        for direction in ([1, 0, 0], [0, 0, 1], [-0.6, 0, 0.8]):
            moved = x.copy()
            moved[upper] += d * np.array(direction)
            share, _ = push(model, moved)
            back = -share @ direction / d
            assert 300 < back < 3000  # [1/m]
            assert np.linalg.norm(share[[0, 2]] + back * d * np.array(direction)[[0, 2]]) < 0.05 * back * d
        angle = d / (0.5 * SIDE)
        moved = x.copy()
        moved[upper, 0] += angle * x[upper, 2]
        moved[upper, 2] -= angle * x[upper, 0]
        assert -2000 < push(model, moved)[1] / d < -100


def test_the_barrier_of_split_quads_has_the_right_derivatives():
    model, x = two_cubes(3)
    assert len(model.surface.middles) == 2 * 54
    chance = np.random.default_rng(3)
    x = x + 2e-6 * chance.standard_normal(x.shape)
    way = chance.standard_normal(x.shape)
    barrier = Barrier(model.collisions, 1e6)
    gradient = np.zeros_like(x)
    barrier.add_gradient(x, gradient)
    h = 1e-10
    slope = (barrier.value(x + h * way) - barrier.value(x - h * way)) / (2 * h)
    assert np.einsum("ij,ij->", gradient, way) == pytest.approx(slope, rel=1e-5)


def rest(count, steps):
    material = sp.StableNeoHookean(youngs=1e7, poisson=0.3, density=1000.0, damping=0.01)
    mesh = sp.shapes.box((SIDE,) * 3)
    bodies = [sp.Body(f"cube{k}", mesh, material, position=(0, (0.51 + 1.01 * k) * SIDE, 0)) for k in range(count)]
    scene = sp.Scene(bodies, [sp.HalfSpace(name="floor")])
    frames = list(sp.simulate(scene, sp.Implicit(), 1 / 50, steps))
    assert {frame.report.status for frame in frames} == {"converged"}
    return frames


def fastest(before, after):
    """Sideways drift, in sizes per second."""
    ways = [after.positions[name].mean(axis=0) - before.positions[name].mean(axis=0) for name in after.positions]
    return max(float(np.hypot(way[0], way[2])) for way in ways) / SIDE / (after.time - before.time)


def test_equal_cubes_of_ordinary_meshes_rest_without_friction():
    frames = rest(2, 40)
    assert fastest(frames[-11], frames[-1]) < 1e-6
    weight = 2 * 9.81 * 1000.0 * SIDE**3
    assert frames[-1].contacts.force_between("cube0", "floor")[1] == pytest.approx(weight, rel=1e-3)
    assert frames[-1].contacts.force_between("cube1", "cube0")[1] == pytest.approx(0.5 * weight, rel=1e-3)


@pytest.mark.slow
def test_five_equal_cubes_of_ordinary_meshes_rest_without_friction():
    frames = rest(5, 500)
    assert fastest(frames[100], frames[-1]) < 1e-6
    assert fastest(frames[-51], frames[-1]) < 1e-6
