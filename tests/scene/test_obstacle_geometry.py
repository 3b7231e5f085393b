"""Signed distance, normal and triangles of every kind of obstacle."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import supple as sp
from supple.numerics.geometry.triangle_tree import TriangleTree
from supple.scene.obstacles.shape import PARAMETERS
from supple.scene.registry import PARTS

SOLIDS = {
    "HalfSpace": sp.HalfSpace(point=(0.1, 0.2, 0.3), normal=(1, 2, 0.5)),
    "Box": sp.obstacles.Box(center=(0.1, 0.2, 0), size=(1, 0.5, 2), rotation=(0.3, 0.1, 0.5)),
    "Sphere": sp.obstacles.Sphere(center=(0.2, 0, 0), radius=0.7),
    "Capsule": sp.obstacles.Capsule(start=(-0.5, 0, 0.1), end=(0.6, 0.3, 0), radius=0.3),
    "Cylinder": sp.obstacles.Cylinder(start=(-0.5, 0, 0.1), end=(0.6, 0.3, 0), radius=0.3),
    "Torus": sp.obstacles.Torus(center=(0.1, 0, 0), axis=(0.3, 1, 0.2), radius=0.8, tube_radius=0.3),
    "TriangleObstacle": sp.obstacles.TriangleObstacle(sp.shapes.sphere_surface(radius=1.0, edge_length=0.3)),
}
ROOMS = {f"{name} room": replace(one, inside=True) for name, one in SOLIDS.items() if hasattr(one, "inside")}
ALL = SOLIDS | ROOMS


def points_about(count, seed=1):
    return np.random.default_rng(seed).uniform(-1.5, 1.5, (count, 3))


def sampled(points, triangles, spacing):
    """Points on triangles, no farther apart than about `spacing`."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    parts = []
    for corner, u, v in zip(a, b - a, c - a, strict=True):
        n = 1 + int(max(np.linalg.norm(u), np.linalg.norm(v), np.linalg.norm(u - v)) / spacing)
        i, j = np.array([(i, j) for i in range(n + 1) for j in range(n + 1 - i)]).T
        parts.append(corner + np.outer(i / n, u) + np.outer(j / n, v))
    return np.concatenate(parts)


def test_every_registered_kind_is_tested():
    assert set(SOLIDS) <= {kind.__name__ for kind in PARTS["obstacles"].kinds}
    assert {"HalfSpace", "Box", "Sphere", "Capsule", "Cylinder", "Torus", "TriangleObstacle"} == set(SOLIDS)


@pytest.mark.parametrize("name", [name for name in ALL if name != "HalfSpace"])
def test_the_distance_is_that_of_the_triangles(name):
    """By brute force. Polyhedra of round surfaces are within 0.4 % of the radius."""
    from scipy.spatial import cKDTree

    obstacle = ALL[name]
    points = points_about(400)
    distances, _ = obstacle.signed_distance(points)
    surface = sp.SurfaceMesh(*obstacle.triangles())
    brute, _ = cKDTree(sampled(surface.vertices, surface.triangles, 0.02)).query(points)
    np.testing.assert_allclose(np.abs(distances), brute, atol=0.012)
    assert (distances > 0).any()
    assert (distances < 0).any()
    exact = TriangleTree.of(surface.vertices, surface.triangles).nearest(points)[1]
    round_off = 1e-12 if name in ("Box", "Box room", "TriangleObstacle") else 4e-3 * getattr(obstacle, "radius", 0.0)
    np.testing.assert_allclose(np.abs(distances), exact, atol=round_off)


@pytest.mark.parametrize("name", ALL)
def test_the_normal_is_the_gradient_of_the_distance(name):
    obstacle, points, h = ALL[name], points_about(1000), 1e-6
    _, normals = obstacle.signed_distance(points)
    sides = [[obstacle.signed_distance(points + sign * h * axis)[0] for sign in (1, -1)] for axis in np.eye(3)]
    slopes = np.stack([(above - below) / (2 * h) for above, below in sides], axis=1)
    smooth = np.abs(np.linalg.norm(slopes, axis=1) - 1.0) < 1e-6  # not across a ridge
    assert smooth.mean() > 0.99
    np.testing.assert_allclose(normals[smooth], slopes[smooth], atol=2e-8)


@pytest.mark.parametrize("name", [name for name, obstacle in ALL.items() if obstacle.contact_mesh is None])
def test_the_element_function_of_xpbd_agrees(name):
    obstacle, points = ALL[name], points_about(300)
    wanted, normals = obstacle.signed_distance(points)
    gaps, directions = [], []
    for shape in obstacle.shapes():
        local = (points - shape.frame[0]) @ shape.frame[1:].T
        numbers = np.zeros(PARAMETERS)
        numbers[: len(shape.parameters)] = shape.parameters
        found = [shape.contact(numbers, tuple(s), tuple(s)) for s in local]
        gaps.append([gap for gap, _, _ in found])
        directions.append(np.array([n for _, _, n in found]) @ shape.frame[1:])
    nearest = np.argmin(gaps, axis=0)
    rows = np.arange(len(points))
    # Outside of a room of six planes, the distance from one plane can be smaller than that from the room.
    same = wanted > 0.0 if len(gaps) > 1 else np.ones(len(points), dtype=bool)
    np.testing.assert_allclose(np.array(gaps)[nearest, rows][same], wanted[same], atol=1e-14)
    np.testing.assert_allclose(np.array(directions)[nearest, rows][same], normals[same], atol=1e-13)


@pytest.mark.parametrize("name", [name for name in ALL if name != "HalfSpace"])
def test_triangles_are_closed_face_outwards_and_do_not_cross_the_true_surface(name):
    obstacle = ALL[name]
    vertices, triangles = obstacle.triangles()
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    surface = sp.SurfaceMesh(vertices, triangles)
    assert surface.volume > 0.0
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 1e-7
    distances, _ = obstacle.signed_distance(sampled(vertices, triangles, 0.05))
    assert distances.min() > -1e-12
    assert distances.max() < 0.005 * getattr(obstacle, "radius", 0.0) + 1e-12


def test_a_fast_point_stays_in_a_room():
    """Through both ends of a thin cylinder in one substep."""
    (shape,) = sp.obstacles.Cylinder(start=(0, -0.002, 0), end=(0, 0.002, 0), radius=0.5, inside=True).shapes()
    ends = (shape.frame[1:] @ (np.asarray(p) - shape.frame[0]) for p in ((0, 0, 0.2), (0, -3, 0.2)))
    gap, before, normal = shape.contact(np.array([*shape.parameters, 0.0, 0.0]), *map(tuple, ends))
    assert (gap, before) == pytest.approx((-2.998, 0.002))
    np.testing.assert_allclose(normal @ shape.frame[1:], (0, 1, 0), atol=1e-12)


BAD = [
    (lambda: sp.obstacles.Capsule(start=(0, 0)), r"Capsule: start has shape \(2,\)"),
    (
        lambda: sp.obstacles.Capsule(start=(0, 0, 0), end=(0, 0, 0)),
        "Capsule: start and end are the same point; .* use a Sphere",
    ),
    (lambda: sp.obstacles.Capsule(radius=0.0), "Capsule: radius is 0; it must be above zero"),
    (lambda: sp.obstacles.Cylinder(radius=np.inf), "Cylinder: radius is inf; it must be finite"),
    (lambda: sp.obstacles.Cylinder(end=(0, np.nan, 0), name="pole"), "obstacle 'pole': end is .*must be finite"),
    (lambda: sp.obstacles.Cylinder(inside="yes"), "Cylinder: inside is 'yes'; give True or False"),
    (lambda: sp.obstacles.Box(size=(1, 0, 1)), r"Box: size is \[1.0, 0.0, 1.0\]; every edge must be above zero"),
    (lambda: sp.obstacles.TriangleObstacle(), "TriangleObstacle: surface is missing; give surface="),
]


@pytest.mark.parametrize(("make", "words"), BAD)
def test_bad_parameters_raise_a_one_line_error(make, words):
    with pytest.raises(sp.SceneError, match=words):
        make()


def test_points_are_carried_by_the_motion():
    turning = sp.Keyframes(times=[0, 2], angles=[0, np.pi], axis=(0, 1, 0), pivot=(1, 0, 0))
    capsule = sp.obstacles.Capsule(motion=turning)
    points = points_about(20)
    at = [points @ R.T + t for R, t in map(capsule.pose, (0.5, 1.25))]
    np.testing.assert_allclose(capsule.carried(at[0], 0.5, 1.25), at[1], atol=1e-14)
    still = sp.obstacles.Capsule()
    assert still.carried(points, 0.0, 1.0) is points


def test_keyframes_turn_about_any_axes():
    """Each keyframe is met; between two, the rotation is the shortest one, at constant rate, about the pivot."""
    vectors, pivot = [(0.3, 0, 0), (0.3, 1.2, -0.5), (0, 0, 3.0), (0, 0, -3.0)], np.array([1.0, 2.0, 3.0])
    shifts = np.random.default_rng(0).normal(size=(4, 3))
    motion = sp.Keyframes([0, 1, 3, 4], shifts, rotations=vectors, pivot=pivot)
    for time, vector, shift in zip([0, 1, 3, 4], vectors, shifts, strict=True):
        R, t = motion.pose(time)
        np.testing.assert_allclose(R, Rotation.from_rotvec(vector).as_matrix(), atol=1e-14)
        np.testing.assert_allclose(R @ pivot + t, pivot + shift, atol=1e-14)
    turns = [(motion.pose(a)[0].T @ motion.pose(b)[0]) for a, b in ((1.0, 1.5), (1.5, 2.5), (2.5, 3.0))]
    angles = [Rotation.from_matrix(turn).magnitude() for turn in turns]
    np.testing.assert_allclose(angles, angles[0] * np.array([1, 2, 1]), rtol=1e-12)
    assert Rotation.from_matrix(motion.pose(3)[0].T @ motion.pose(4)[0]).magnitude() == pytest.approx(2 * np.pi - 6)
    # The first and last keyframes stay; one axis is the same as angles.
    np.testing.assert_array_equal(motion.pose(9.0)[0], motion.pose(4.0)[0])
    one = sp.Keyframes([0, 1], rotations=[(0, 0, 0), (0, 1.5, 0)], pivot=pivot)
    other = sp.Keyframes([0, 1], angles=[0, 1.5], axis=(0, 1, 0), pivot=pivot)
    for a, b in zip(one.pose(0.3), other.pose(0.3), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-14)
