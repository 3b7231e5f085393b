"""Drawn surfaces face outward and are in view of the camera."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.mesh.surface import SurfaceMesh
from supple.results.export.video import Film
from supple.results.export.video_worker import placed
from supple.results.recording.reader import read_recording
from supple.results.recording.recorder import Recorder
from supple.results.view.bounds import box_corners, view_of_scene
from supple.results.view.camera import direction_of, fitted
from supple.results.view.floor_shadow import FloorShadow
from supple.results.view.from_recording import evenly, model_of_recording, render_frame_of, view_of
from supple.results.view.normals import vertex_normals
from supple.results.view.surfaces import body_surface, obstacle_surfaces, split_at_creases, surfaces_of
from supple.simulate import simulate


@pytest.fixture
def model(recording):
    return model_of_recording(recording)


def test_bodies_are_drawn_by_their_skin_or_boundary(recording, model):
    cube, slab = (body_surface(model, body) for body in model.bodies)
    first = render_frame_of(model, recording[0])
    assert len(cube.at(first)) == 6
    assert len(slab.at(first)) == 26  # all vertices of a 2 x 2 x 2 box but the one within
    for frame in (recording[0], recording[9]):
        stretch = (1.0 + 0.3 * np.sin(4.0 * frame.time)) if frame.index else 1.0
        volume = SurfaceMesh(slab.at(render_frame_of(model, frame)), slab.triangles).volume
        assert volume == pytest.approx(0.3 * stretch)
    assert cube.color != slab.color
    shown, same, *_ = surfaces_of(model, skins=False)
    assert [len(s.triangles) for s in (cube, slab, shown, same)] == [8, 48, 48, 48]
    assert SurfaceMesh(shown.at(first), shown.triangles).volume == pytest.approx(1.0)


def test_obstacles_are_closed_and_face_outward(model):
    drawn = {surface.name.split()[0]: surface for surface in obstacle_surfaces(model)}
    volumes = {name: SurfaceMesh(p.vertices, p.triangles).volume for name, p in drawn.items()}
    assert volumes["Box"] == pytest.approx(0.25)
    assert volumes["Sphere"] == pytest.approx(4.0 / 3.0 * np.pi * 0.027, rel=0.03)
    assert volumes["TriangleObstacle"] == pytest.approx(4.0 / 3.0 * 0.008)
    hidden = {name: surface.hides_its_backs(model) for name, surface in drawn.items()}
    assert hidden == {"Box": True, "Sphere": True, "TriangleObstacle": True, "HalfSpace": False}
    inward = replace(drawn["Box"], triangles=drawn["Box"].triangles[:, ::-1])
    assert not inward.hides_its_backs(model)
    floor = drawn["HalfSpace"]
    np.testing.assert_allclose(floor.vertices[:, 1], 0.0, atol=1e-12)
    normals = vertex_normals(floor.vertices, floor.triangles)
    np.testing.assert_allclose(normals, np.tile([0.0, 1.0, 0.0], (4, 1)), atol=1e-12)


def test_moving_obstacles_follow_their_pose(recording, model):
    box = next(surface for surface in obstacle_surfaces(model) if surface.name.startswith("Box"))
    first, last = (box.at(render_frame_of(model, recording[k])) for k in (0, 24))
    np.testing.assert_allclose(last - first, np.tile([0, 0, 0.8], (8, 1)), atol=1e-12)


@pytest.mark.parametrize(("preset", "slopes"), [("corner", (0.27, 0.27)), ("top", (1.2, 0.6)), ("side", (0.1, 0.3))])
def test_the_camera_sees_every_body_in_every_frame(recording, preset, slopes):
    view = view_of(recording)
    away = direction_of(preset, view)
    target, distance = fitted(view.outline, away, view.up, slopes)
    eye = target + distance * away
    right = np.cross(view.up, away) / np.linalg.norm(np.cross(view.up, away))
    axes = np.stack([right, np.cross(away, right)])
    for frame in recording:
        toward = frame.state.positions - eye
        seen = np.abs(toward @ axes.T) / -(toward @ away)[:, None] / slopes
        assert seen.min() >= 0.0  # before the eye
        assert seen.max() <= 1.0
    seen = (view.outline - eye) @ axes.T / -((view.outline - eye) @ away)[:, None] / slopes
    np.testing.assert_allclose(seen.max(axis=0), -seen.min(axis=0), atol=0.01)  # in the middle
    assert np.abs(seen).max() > 0.75  # and it fills the picture
    assert eye[1] > view.center[1]


@pytest.mark.parametrize(
    ("camera", "share", "expected"),
    [("fit", 0.0, (3, 4, 1)), ("fit", 0.7, (3, 4, 1)), ("orbit", 0.25, (1, 4, -1)), ("orbit", 0.5, (-1, 4, 1))],
)
def test_a_camera_between_places_is_there(recording, camera, share, expected):
    """An orbit turns about the vertical line through the target."""
    film = Film(camera=camera, eye=(3, 4, 1), target=np.array([1, 2, 1]))
    center, away, distance = placed(film, view_of(recording), np.zeros((1, 3)), share)
    np.testing.assert_allclose(center, [1, 2, 1])
    np.testing.assert_allclose(center + distance * away, expected, atol=1e-12)


def test_a_bowl_is_seen_whole_and_a_hall_is_not():
    low, high, up = np.full(3, -0.1), np.full(3, 0.1), np.array([0.0, 1.0, 0.0])

    def view(radius):
        bowl = sp.obstacles.Sphere(radius=radius, inside=True, name="bowl")
        return view_of_scene(box_corners(low, high), up, [bowl])

    np.testing.assert_allclose([view(0.2).low[0], view(0.2).high[0]], [-0.2, 0.2], rtol=0.02)
    assert view(0.2).high[1] == 0.1  # its upper half is not drawn
    assert view(5.0).radius == pytest.approx(0.1 * np.sqrt(3.0))


def test_normals_of_a_ball_point_outward(tools):
    ball = tools.octahedron(2.0, (0.0, 0.0, 0.0))
    np.testing.assert_allclose(vertex_normals(ball.vertices, ball.triangles), ball.vertices / 2.0, atol=1e-12)


def test_frames_are_chosen_evenly():
    assert evenly(25, 4) == [0, 8, 16, 24]
    assert evenly(25, 100) == list(range(25))


def test_vertices_are_split_where_edges_are_sharp(tools):
    box = sp.shapes.box(divisions=(1, 1, 1)).surface
    rows, triangles = split_at_creases(box.vertices, box.triangles)
    assert len(rows) == 24  # three sides at each corner
    np.testing.assert_array_equal(rows[triangles], box.triangles)
    normals = np.abs(vertex_normals(box.vertices[rows], triangles))
    np.testing.assert_allclose(np.sort(normals, axis=1), np.tile([0, 0, 1.0], (24, 1)), atol=1e-12)
    ball = sp.shapes.sphere(0.5, 0.2).surface.compact()
    rows, triangles = split_at_creases(ball.vertices, ball.triangles)
    np.testing.assert_array_equal(np.sort(rows), np.arange(len(ball.vertices)))
    # A triangle without area, and an edge of three triangles, are no faults of a picture.
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [2, 0, 0.0]])
    rows, triangles = split_at_creases(x, np.array([[0, 1, 2], [0, 1, 3], [1, 0, 2], [0, 1, 4]], dtype=np.int32))
    np.testing.assert_array_equal(rows[triangles], [[0, 1, 2], [0, 1, 3], [1, 0, 2], [0, 1, 4]])


def test_a_shadow_is_below_its_body_and_fades_with_height():
    box = sp.shapes.box(size=(0.4, 0.2, 0.4), divisions=(1, 1, 1)).surface  # two triangles on each side
    shadow = FloorShadow(np.zeros(3), np.array([0, 1.0, 0]), np.array([0.3, 0.5, 0]), 1.0, 256)
    low, high = (shadow.darkness([(box.vertices + np.array([0, y, 0]), box.triangles)]) for y in (0.1, 0.9))
    assert low.max() > 0.6 > 0.3 > high.max() > 0.02
    rows, columns = np.nonzero(low > 0.3)
    sides = (shadow.corners[1] - shadow.corners[0]) / 256, (shadow.corners[3] - shadow.corners[0]) / 256
    at = shadow.corners[0] + (columns.mean() + 0.5) * sides[0] + (rows.mean() + 0.5) * sides[1]
    np.testing.assert_allclose(at[[0, 2]], 0.0, atol=0.03)
    assert low[0].max() == 0.0


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
        drawn = obstacle_surfaces(model_of_recording(recording))
    assert {p.name for p in drawn if p.opacity < 1.0} == {"wall", "lid", "room"}
