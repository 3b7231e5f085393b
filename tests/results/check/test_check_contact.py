"""Bodies and obstacles that meet, contain each other or come near, where they may and where they may not."""

import numpy as np
import pytest
from tests.recordings import set_in_scene, system_in

import supple as sp
from supple.results.check.recorded import RecordedTrajectory

from .conftest import JELLY, X, failures, octahedron, recorded

CONTACT = ["intersection", "containment", "distance"]


def apart(file, n, frame, gap):
    """Shift the right block until its lowest x is `gap` away from the left block's highest."""
    x = file[X][frame * n : (frame + 1) * n]
    half = n // 2
    x[half:, 0] += x[:half, 0].max() + gap - x[half:, 0].min()
    # Straight faces: the block's own shape decides nothing here.
    x[:half] = system_in(file).rest_positions[:half]
    x[half:] = system_in(file).rest_positions[half:] + np.array([1.0 + gap, 0.0, 0.0])
    file[X][frame * n : (frame + 1) * n] = x


@pytest.mark.parametrize("gap", [1e-9, -1e-9, 0.0])
def test_a_surface_pushed_through_another(free, corrupted, gap):
    path = corrupted(free, lambda file, n: apart(file, n, 2, gap))
    if gap > 0.0:
        assert failures(path, only=CONTACT) == {}
        report = sp.check_recording(path)
        assert report["distance"].worst == pytest.approx(gap, rel=1e-6)
        assert report["distance"].frame == 2
    else:
        assert failures(path, only=CONTACT) == {"intersection": 2, "distance": 2}
        assert "of left and triangle" in sp.check_recording(path)["intersection"].where


def test_a_body_that_meets_itself(free, corrupted):
    def change(file, n):
        # The left block's end is pulled through its middle.
        x = file[X][n : 2 * n]
        rest = system_in(file).rest_positions[: n // 2]
        end = rest[:, 0] == rest[:, 0].max()
        x[: n // 2][end] -= [1.0, 0.1, 0.1]
        file[X][n : 2 * n] = x

    assert failures(corrupted(free, change), only=["intersection"]) == {"intersection": 1}


@pytest.mark.parametrize("tip", range(4))
def test_a_body_stitched_at_its_tip_is_not_contained(tmp_path, corrupted, tip):
    """A stitched vertex 1e-9 m below its surface does not make the body contained."""
    material = sp.StableNeoHookean(youngs=1e5, poisson=0.3)
    low = sp.Body("low", sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), material)
    corners = np.roll([[0.0, 0.0, 0.0], [0.01, 0.02, 0.0], [-0.01, 0.02, 0.01], [-0.01, 0.02, -0.01]], tip, axis=0)
    high = sp.Body("high", sp.TetMesh(corners, [[0, 1, 2, 3]]), material, position=(0.01, 0.05, 0.02))
    seam = sp.SoftVertexTriangleStitch("high", "low", max_distance=1e-6, youngs=1e5, poisson=0.3)
    path = tmp_path / "r.vtkhdf"
    scene = sp.Scene([low, high], stitches=[seam], gravity=(0, 0, 0))
    list(sp.simulate(scene, sp.XPBD(substeps=10), 1 / 60, 1, sinks=[sp.Recorder(path)]))

    def push_in(file, n):
        x = np.concatenate([low.mesh.vertices, high.mesh.vertices + high.position])
        x[n - 4 :, 1] -= 1e-9
        file[X][n : 2 * n] = x

    pushed = corrupted(path, push_in)
    assert failures(pushed, only=["intersection", "containment"]) == {}


def test_a_body_completely_inside_another(free, corrupted):
    def change(file, n):
        x = file[X][2 * n : 3 * n]
        left, right = x[: n // 2], x[n // 2 :]
        x[n // 2 :] = (right - right.mean(axis=0)) * 0.3 + left.mean(axis=0)
        file[X][2 * n : 3 * n] = x

    report = sp.check_recording(corrupted(free, change), only=CONTACT)
    assert [(result.name, result.first_failure) for result in report.failures] == [("containment", 2)]
    assert report["containment"].where == "right in left"


def test_excluded_pairs_are_left_out(free, corrupted):
    def overlap(file, n):
        apart(file, n, 2, -0.1)
        set_in_scene(file, "scene/contact_pairs", (sp.ContactPair("right", "left", collide=False),))

    assert failures(corrupted(free, overlap), only=CONTACT) == {}


def test_vertices_that_may_touch_a_triangle_are_left_out(free, corrupted):
    def touch(file, n, exempt):
        """One vertex of the right block on the middle of a triangle of the left one."""
        left, right = (body.boundary for body in system_in(file).bodies)
        x = file[X][2 * n : 3 * n]
        rest = system_in(file).rest_positions[: n // 2]
        facing = [row for row in left if (rest[row, 0] == rest[:, 0].max()).all()]
        vertex = n // 2 + int(right.min()) + int(np.argmin(system_in(file).rest_positions[n // 2 :, 0]))
        x[vertex] = x[facing[0]].mean(axis=0) - [1e-6, 0, 0]
        file[X][2 * n : 3 * n] = x
        if exempt:
            row = next(k for k, corners in enumerate(left) if (corners == facing[0]).all())
            seam = sp.SoftVertexTriangleStitch("right", "left", pairs=[(vertex - n // 2, row)], youngs=1.0, poisson=0.3)
            set_in_scene(file, "scene/stitches", (seam,))

    assert failures(corrupted(free, lambda file, n: touch(file, n, False)), only=["intersection"]) == {
        "intersection": 2
    }
    assert failures(corrupted(free, lambda file, n: touch(file, n, True)), only=["intersection"]) == {}


def move_to(lowest, frame=3):
    """Put the cube's corner of lowest coordinates somewhere."""

    def change(file, n):
        x = file[X][frame * n : (frame + 1) * n]
        file[X][frame * n : (frame + 1) * n] = x - x.min(axis=0) + np.asarray(lowest)

    return change


BY_FORMULA = {
    "floor": [-0.5, -1e-12, -0.5],
    "slope": [2.6, 0.5, 0.0],
    "door": [-2.1, 1.0, 0.0],
    "room": [0.0, 1.0, -6.5],
    "bowl": [0.0, 8.1, 0.0],
    "ball": [-0.5, 0.5, 1.65],
    "log": [0.5, 0.5, 3.2],
    "drum": [-0.5, 2.4, 2.9],
    "tank": [-0.5, 1.0, 5.6],
}


@pytest.mark.parametrize("name", BY_FORMULA)
def test_a_body_in_an_obstacle_that_is_a_formula(around, corrupted, name):
    report = sp.check_recording(corrupted(around, move_to(BY_FORMULA[name])), only=["obstacles"])
    found = report["obstacles"]
    assert (found.verdict, found.first_failure, found.failed_frames) == ("fail", 3, 1)
    assert name in found.where
    assert found.worst < 0.0


def test_a_body_just_above_the_floor_and_just_beside_the_moving_door_passes(around, corrupted):
    assert failures(corrupted(around, move_to([-0.5, 1e-12, -0.5])), only=["obstacles", "distance"]) == {}
    door = -2.0 - 0.5 * 3 / 60
    assert failures(corrupted(around, move_to([door + 1e-9, 1.0, 0.0])), only=["obstacles"]) == {}
    assert failures(corrupted(around, move_to([door - 1e-9, 1.0, 0.0])), only=["obstacles"]) == {"obstacles": 3}


@pytest.mark.parametrize(("lowest", "name"), [([-0.2, 0.9, -2.3], "crate"), ([0.3, 2.0, 0.2], "rock")])
def test_a_body_that_meets_an_obstacle_made_of_triangles(around, corrupted, lowest, name):
    report = sp.check_recording(corrupted(around, move_to(lowest)), only=["intersection"])
    assert report["intersection"].first_failure == 3
    assert f"obstacle {name}" in report["intersection"].where


@pytest.mark.parametrize(
    ("lowest", "size", "where"),
    [
        ([-0.1, 0.95, -2.05], 0.1, "cube in crate"),
        ([0.25, 2.95, 0.15], 0.1, "cube in rock"),
        ([-0.5, 2.0, -0.5], 4.0, "rock in cube"),
        ([-2.0, 0.0, 0.5], 4.0, "ball in cube"),
        ([-1.5, 2.0, 1.5], 4.0, "drum in cube"),
    ],
)
def test_bodies_inside_obstacles_and_obstacles_inside_bodies(around, corrupted, lowest, size, where):
    def change(file, n):
        x = system_in(file).rest_positions
        x = (x - x.min(axis=0)) * size + np.asarray(lowest)
        file[X][5 * n : 6 * n] = x

    report = sp.check_recording(corrupted(around, change), only=["containment"])
    assert report["containment"].first_failure == 5
    assert report["containment"].where == where


def test_contact_that_never_intersects_passes(tmp_path):
    cube = sp.shapes.box((1, 1, 1), (1, 1, 1))
    scene = sp.Scene(
        [
            sp.Body("left", cube, JELLY, friction=0.3),
            sp.Body("right", cube, JELLY, position=(1.05, 0.1, 0.2), velocity=(-4, 0, 0), friction=0.3),
        ]
    )
    report = sp.check_recording(recorded(tmp_path / "r.vtkhdf", scene, sp.Implicit()))
    not_here = ("cells", "obstacles", "rigidity", "welds", "joints", "works")
    assert {result.verdict for result in report.results if result.name not in not_here} == {"pass"}
    # They did touch.
    assert 0.0 < report["distance"].worst < 5e-3
    assert report["distance"].frame > 0


def test_excluded_and_stitched_pairs_are_recorded(tmp_path):
    cube = sp.shapes.box((1, 1, 1), (1, 1, 1))
    rock = octahedron((0.5, 0.5, 2.5), 1.0)
    scene = sp.Scene(
        [
            sp.Body("a", cube, JELLY),
            sp.Body("b", cube, JELLY, position=(0.9, 0, 0)),
            sp.Body("c", cube, JELLY, position=(0, 3, 0)),
        ],
        [sp.HalfSpace(name="floor", point=(0, -1, 0)), sp.obstacles.TriangleObstacle(name="rock", surface=rock)],
        contact_pairs=[sp.ContactPair("a", "b", collide=False), sp.ContactPair("c", "*", collide=False)],
        stitches=[
            sp.SoftVertexTriangleStitch("c", "a", pairs=[(0, 3)], youngs=1e3, poisson=0.3),
            sp.VertexVertexStitch("b", "rock", pairs=[(1, 4)], stiffness=10.0),
        ],
        gravity=(0, 0, 0),
    )
    path = tmp_path / "r.vtkhdf"
    with sp.read_recording(recorded(path, scene, sp.XPBD(substeps=2))) as recording:
        trajectory = RecordedTrajectory(recording)
        excluded_pairs = set(map(tuple, np.argwhere(~trajectory.surfaces.allowed).tolist()))
        n = len(recording.rest_positions)
        assert {(0, 1), (0, 2), (1, 2), (2, 2)} <= excluded_pairs
        assert not {(0, 0), (1, 1), (0, 3)} & excluded_pairs
        a = scene.bodies[0].mesh.surface.triangles[3]
        assert [row.tolist() for row in np.sort(recording.stitches.nodes)] == [
            [*sorted(a), 2 * n // 3],
            [n // 3 + 1, n, n, n],
        ]
        assert recording.stitches.nodes[:, 0].tolist() == [2 * n // 3, n // 3 + 1]
        np.testing.assert_array_equal(recording.stitches.anchor_owners, [1])
        np.testing.assert_array_equal(recording.stitches.anchors, recording.obstacles[1].surface.vertices[[4]])
        surfaces = trajectory.surfaces
        at = surfaces.place(recording[0].state.positions, recording[0].obstacle_poses)
        np.testing.assert_array_equal(at[surfaces.stitched[1, 1]], recording.obstacles[1].surface.vertices[4])
        assert len(recording.stitches) == 2
    # a and b overlap, and may.
    assert failures(path, only=CONTACT) == {}
