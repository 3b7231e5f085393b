"""Drawn surfaces face outward and are in view of the camera."""

from __future__ import annotations

import numpy as np
import pytest

import supple as sp
from supple.mesh.surface import SurfaceMesh
from supple.results.drawing import evenly, obstacle_pictures, pictures, vertex_normals, view_of
from supple.results.recording.reader import read_recording
from supple.results.recording.recorder import Recorder
from supple.simulate import simulate


def test_bodies_are_drawn_by_their_skin_or_boundary(recording):
    cube, slab = pictures(recording)
    assert len(cube.at(recording[0])) == 6
    assert len(slab.at(recording[0])) == 26  # all vertices of a 2 x 2 x 2 box but the one within
    for frame in (recording[0], recording[9]):
        stretch = (1.0 + 0.3 * np.sin(4.0 * frame.time)) if frame.index else 1.0
        volume = SurfaceMesh(slab.at(frame), slab.triangles).volume
        assert volume == pytest.approx(0.3 * stretch)
    assert cube.color != slab.color


def test_obstacles_are_closed_and_face_outward(recording):
    drawn = {picture.name.split()[0]: picture for picture in obstacle_pictures(recording.obstacles, view_of(recording))}
    volumes = {name: SurfaceMesh(p.vertices, p.triangles).volume for name, p in drawn.items()}
    assert volumes["Box"] == pytest.approx(0.25)
    assert volumes["Sphere"] == pytest.approx(4.0 / 3.0 * np.pi * 0.027, rel=0.03)
    assert volumes["TriangleObstacle"] == pytest.approx(4.0 / 3.0 * 0.008)
    floor = drawn["HalfSpace"]
    np.testing.assert_allclose(floor.vertices[:, 1], 0.0, atol=1e-12)
    normals = vertex_normals(floor.vertices, floor.triangles)
    np.testing.assert_allclose(normals, np.tile([0.0, 1.0, 0.0], (4, 1)), atol=1e-12)


def test_moving_obstacles_follow_their_pose(recording):
    view = view_of(recording)
    box = next(p for p in obstacle_pictures(recording.obstacles, view) if p.name.startswith("Box"))
    np.testing.assert_allclose(box.at(recording[24]) - box.at(recording[0]), np.tile([0, 0, 0.8], (8, 1)), atol=1e-12)


@pytest.mark.parametrize("angle", [30.0, 60.0])
def test_the_camera_sees_every_body_in_every_frame(recording, angle):
    view = view_of(recording)
    eye = view.eye(angle)
    ahead = view.center - eye
    ahead /= np.linalg.norm(ahead)
    for frame in recording:
        toward = frame.state.positions - eye
        cosines = toward @ ahead / np.linalg.norm(toward, axis=1)
        assert np.degrees(np.arccos(cosines)).max() <= 0.5 * angle
    assert eye[1] > view.center[1]


def test_normals_of_a_ball_point_outward(tools):
    ball = tools.octahedron(2.0, (0.0, 0.0, 0.0))
    np.testing.assert_allclose(vertex_normals(ball.vertices, ball.triangles), ball.vertices / 2.0, atol=1e-12)


def test_frames_are_chosen_evenly(recording):
    assert [frame.number for frame in evenly(recording, 4)] == [0, 8, 16, 24]
    assert len(evenly(recording, 100)) == 25


def test_obstacles_that_would_hide_the_bodies_are_transparent(tmp_path, tools):
    scene = sp.Scene(
        bodies=[sp.Body("cube", tools.box(), sp.EdgesAndVolume(density=1000.0))],
        obstacles=[
            sp.HalfSpace(name="floor"),
            sp.HalfSpace(name="wall", point=(0, 0, 2), normal=(0, 0, -1)),
            sp.HalfSpace(name="lid", point=(0, 2, 0), normal=(0, -1, 0)),
            sp.obstacles.Box(name="room", center=(0.5, 0.5, 0.5), size=(3, 3, 3), inside=True),
            sp.obstacles.Sphere(name="ball", center=(5, 0, 0)),
        ],
    )
    path = tmp_path / "walls.vtkhdf"
    list(simulate(scene, tools.Prescribed(), 1 / 30, 1, sinks=[Recorder(path)]))
    with read_recording(path) as recording:
        drawn = obstacle_pictures(recording.obstacles, view_of(recording))
    assert {p.name for p in drawn if p.opacity < 1.0} == {"wall", "lid", "room"}
