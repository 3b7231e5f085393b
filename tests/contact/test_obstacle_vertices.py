"""Obstacles as scripted vertices, and bodies that they push, lift and drag."""

import numpy as np
import pytest
from tests.scenes import converged

import supple as sp
from supple.contact.mesh.obstacles import obstacle_positions, with_obstacles
from supple.model.system import build_system
from supple.scene.obstacles.polyhedra import SPHERE_SPLITS, round_ball
from supple.scene.rotation import rotation_matrix

SHEET = sp.SurfaceMesh([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 2, 1], [0, 3, 2]])


def cube(name="cube", size=0.2, divisions=1, youngs=1e5, **body):
    material = sp.StableNeoHookean(youngs=youngs, poisson=0.3, density=1000.0)
    return sp.Body(name, sp.shapes.box((size,) * 3, (divisions,) * 3), material, **body)


def ranges_of(*obstacles):
    system = build_system(sp.Scene([cube()], obstacles=list(obstacles)))
    return with_obstacles(system)


def run(scene, dt, steps, **solver):
    frames = converged(sp.simulate(scene, sp.Implicit(**solver), dt, steps))
    assert all(frame.report.min_det_F > 0.0 for frame in frames)
    return frames


def plane_offsets(points, triangles):
    """Distances of every triangle's plane from the origin, along its normal."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    return np.einsum("ij,ij->i", a, normals) / np.linalg.norm(normals, axis=1)


def test_the_polyhedron_in_the_ball_is_closed_round_and_outward():
    points, triangles = round_ball(inscribed=True)
    assert len(points) == 10 * SPHERE_SPLITS**2 + 2
    assert len(triangles) == 20 * SPHERE_SPLITS**2
    assert np.allclose(np.linalg.norm(points, axis=1), 1.0, rtol=1e-14)
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert plane_offsets(points, triangles).min() > 0.75


def test_sphere_polyhedra_enclose_the_ball_or_lie_inside_the_room():
    """No body crosses the true surface, and the polyhedron differs from it by less than 0.4 %."""
    for inside in (False, True):
        _, (part,) = ranges_of(sp.obstacles.Sphere(center=(0.3, -1.0, 2.0), radius=0.7, inside=inside))
        points = part.anchors - np.array([0.3, -1.0, 2.0])
        offsets = plane_offsets(points, part.triangles)
        farthest = np.linalg.norm(points, axis=1).max()
        if inside:
            assert farthest <= 0.7 * (1 + 1e-14)
            assert offsets.min() > 0.7 * (1 - 4e-3)
        else:
            assert offsets.min() >= 0.7 * (1 - 1e-14)
            assert farthest < 0.7 * (1 + 4e-3)


def test_vertices_of_boxes_sheets_and_half_spaces():
    turned = sp.obstacles.Box(center=(1, 2, 3), size=(0.2, 0.4, 0.6), rotation=(0.3, -0.2, 0.9))
    floor = sp.HalfSpace(point=(0, -5, 0), normal=(1, 2, 2))
    sheet = sp.obstacles.TriangleObstacle(surface=SHEET)
    system, (box, plane, triangles) = ranges_of(turned, floor, sheet)
    local = (box.anchors - [1, 2, 3]) @ rotation_matrix([0.3, -0.2, 0.9])
    assert np.allclose(np.abs(local), [0.1, 0.2, 0.3], atol=1e-15)
    assert np.unique(np.round(local, 9), axis=0).shape == (8, 3)
    assert plane_offsets(box.anchors - [1, 2, 3], box.triangles).min() == pytest.approx(0.1)
    axis = np.cross(*(plane.anchors[1:] - plane.anchors[0]))
    assert np.allclose(plane.anchors[0], [0, -5, 0])
    assert np.allclose(axis / np.linalg.norm(axis), np.array([1, 2, 2]) / 3)
    assert len(plane.triangles) == 0
    assert np.array_equal(triangles.anchors, SHEET.vertices)
    assert np.array_equal(triangles.triangles, SHEET.triangles)
    # They follow the bodies' vertices, and are pinned.
    n = 8
    assert len(system.rest_positions) == n + 8 + 3 + 4
    assert np.array_equal(system.pinned_vertices, np.arange(n, n + 15))
    assert (system.masses > 0.0).all()


def test_scripted_obstacles_follow_their_script():
    turning = sp.Keyframes(times=[0, 2], angles=[0, np.pi], axis=(0, 1, 0), pivot=(1, 0, 0))
    _, parts = ranges_of(sp.obstacles.Box(motion=turning), sp.HalfSpace(motion=lambda t: (0, 0.5 * t, 0)))
    x = obstacle_positions(parts, 1.0)
    turn = rotation_matrix([0, np.pi / 2, 0])
    assert np.allclose(x[:8], (parts[0].anchors - [1, 0, 0]) @ turn.T + [1, 0, 0], atol=1e-14)
    assert np.allclose(x[8:], parts[1].anchors + np.array([0, 0.5, 0]), atol=1e-15)


def test_obstacles_without_contact_raise_an_error():
    scene = sp.Scene([cube()], obstacles=[sp.HalfSpace(point=(0, -1, 0), name="floor")])
    with pytest.raises(sp.SolverError, match=r"'floor'.*contact=None"):
        sp.simulate(scene, sp.Implicit(contact=None), 0.01, 1)


def test_a_moving_box_pushes_a_cube():
    """Also where one step of the script is longer than the gap."""
    ram = sp.obstacles.Box(center=(-0.21, 0, 0), size=(0.2, 0.3, 0.3), motion=lambda t: (0.3 * t, 0, 0))
    scene = sp.Scene([cube()], obstacles=[ram], gravity=(0, 0, 0))
    frames = run(scene, 0.1, 8)
    for frame in frames:
        face = -0.11 + 0.3 * frame.time
        assert frame.positions["cube"][:, 0].min() > face
    # No other force acts: the cube is at least as fast as the box.
    assert frames[-1].velocities["cube"][:, 0].mean() > 0.3 * 0.99
    assert np.abs(frames[-1].positions["cube"][:, 1].mean()) < 1e-3


def test_a_rising_floor_lifts_a_cube():
    lift = sp.HalfSpace(motion=lambda t: (0, 0.2 * t, 0))
    scene = sp.Scene([cube(position=(0, 0.1005, 0))], obstacles=[lift])
    frames = run(scene, 0.05, 20)
    for frame in frames:
        assert frame.positions["cube"][:, 1].min() > 0.2 * frame.time
    last = frames[-1]
    assert last.positions["cube"][:, 1].min() == pytest.approx(0.2, abs=1e-3)
    assert last.velocities["cube"][:, 1].mean() == pytest.approx(0.2, rel=2e-2)
    assert last.report.details.contact_forces["cube"][1] == pytest.approx(8 * 9.81, rel=2e-2)


@pytest.mark.parametrize("kind", ["half-space", "box"])
def test_a_conveyor_accelerates_a_cube_to_its_speed(kind):
    def motion(t):
        return (0.5 * t, 0, 0)

    belt = (
        sp.HalfSpace(friction=0.4, motion=motion)
        if kind == "half-space"
        else sp.obstacles.Box(center=(0, -0.5, 0), size=(4, 1, 4), friction=0.4, motion=motion)
    )
    scene = sp.Scene([cube(position=(0, 0.1002, 0))], obstacles=[belt])
    frames = run(scene, 0.01, 50)
    # It slips for v / (mu g) = .127 s, at mu g, and then moves with the belt.
    early = frames[7]
    assert early.velocities["cube"][:, 0].mean() == pytest.approx(0.4 * 9.81 * early.time, rel=0.1)
    moving = [frame.velocities["cube"][:, 0].mean() for frame in frames[40:]]
    assert np.mean(moving) == pytest.approx(0.5, rel=1e-2)
    assert max(frame.velocities["cube"][:, 0].mean() for frame in frames) < 0.5 * 1.1  # it oscillates


def test_a_turntable_rotates_a_cube():
    turning = sp.Keyframes(times=[0, 10], angles=[0, 10.0], axis=(0, 1, 0))
    table = sp.obstacles.Box(center=(0, -0.05, 0), size=(1, 0.1, 1), friction=0.8, motion=turning)
    body = cube(position=(0.25, 0.1002, 0), velocity=(0, 0, -0.25), angular_velocity=(0, 1, 0))
    frames = run(sp.Scene([body], obstacles=[table]), 0.02, 25)
    last = frames[-1]
    center = last.positions["cube"].mean(axis=0)
    expected = rotation_matrix([0, last.time, 0]) @ np.array([0.25, 0.1, 0])
    assert np.linalg.norm(center - expected) < 5e-3
    assert last.positions["cube"][:, 1].min() > 0.0
