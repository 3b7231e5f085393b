"""Surfaces that penetrate at the end of a frame are found and named, and only those that must stay apart."""

import numpy as np
import pytest

import supple as sp
from supple.model.system import build_system, initial_state
from supple.solvers.xpbd.assessment.surfaces import SurfaceCheck
from supple.solvers.xpbd.contact.settings import XPBDContact

CUBE = sp.shapes.box((1.0, 1.0, 1.0), (2, 2, 2))
JELLY = sp.StableNeoHookean(youngs=1e5, poisson=0.4)
PLATE = sp.SurfaceMesh([[-2, 0.1, -2], [2, 0.1, -2], [0, 0.1, 3]], [[0, 1, 2]])


def found(scene, settings=None, x=None):
    check = SurfaceCheck(build_system(scene), settings or XPBDContact(), 0.5)
    return [str(item) for item in check.find(initial_state(scene).positions if x is None else x, 0.0)]


def cubes(**more):
    bodies = [sp.Body(name, CUBE, JELLY, position=(0.7 * k, 0.1 * k, 0.13 * k)) for k, name in enumerate("ab")]
    return sp.Scene(bodies, **more)


def test_two_bodies_through_each_other_are_named():
    (text,) = found(cubes())
    assert text.startswith("body 'a' passes through body 'b' (")


@pytest.mark.parametrize(
    ("scene", "settings"),
    [
        (cubes(contact_pairs=[sp.ContactPair("a", "b", collide=False)]), None),
        (cubes(), XPBDContact(body_collision=False)),
        (sp.Scene([sp.Body("a", CUBE, JELLY), sp.Body("b", CUBE, JELLY, position=(1.1, 0, 0))]), None),
    ],
    ids=["excluded pair", "turned off", "apart"],
)
def test_what_may_pass_or_is_apart_is_not_found(scene, settings):
    assert found(scene, settings) == []


def test_a_body_through_itself_is_found_unless_self_contact_is_off():
    bar = sp.shapes.box((3.0, 0.2, 0.2), (12, 1, 1))
    angle = 2.2 * np.pi * (bar.vertices[:, 0] + 1.5) / 3.0
    radius = 0.45 + bar.vertices[:, 1]
    x = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), bar.vertices[:, 2]])
    scene = sp.Scene([sp.Body("ring", bar, JELLY)])
    (text,) = found(scene, x=x)
    assert text.startswith("body 'ring' passes through itself (")
    assert found(scene, XPBDContact(self_collision=False), x) == []


def test_depths_in_obstacles_and_crossed_triangles_are_found():
    floor = sp.HalfSpace(point=(0, -0.4, 0), name="floor")
    sheet = sp.obstacles.TriangleObstacle(PLATE, name="sheet")
    inner = sp.obstacles.Sphere(center=(0, 0, 0), radius=0.6, inside=True, name="room")
    texts = found(sp.Scene([sp.Body("a", CUBE, JELLY)], [floor, sheet, inner]))
    assert texts[0].startswith("body 'a' passes through obstacle 'sheet' (")
    assert texts[1:] == ["body 'a' is 0.1 m deep in obstacle 'floor'", "body 'a' is 0.27 m deep in obstacle 'room'"]


def test_a_vertex_that_barely_overlaps_an_obstacle_is_not_found():
    assert found(sp.Scene([sp.Body("a", CUBE, JELLY)], [sp.HalfSpace(point=(0, -0.49, 0))])) == []


@pytest.mark.parametrize(
    "solid",
    [
        sp.obstacles.Sphere(center=(0.1, -0.6, 0.2), radius=0.2, name="solid"),
        sp.obstacles.Capsule(start=(0.1, -0.6, -3), end=(0.1, -0.6, 3), radius=0.2, name="solid"),
        sp.obstacles.Cylinder(start=(0.1, -0.6, -3), end=(0.1, -0.6, 3), radius=0.2, name="solid"),
    ],
    ids=lambda solid: solid.kind,
)
def test_a_round_solid_between_vertices_is_found(solid):
    cube = sp.shapes.box((1.0, 1.0, 1.0), (1, 1, 1))
    (text,) = found(sp.Scene([sp.Body("a", cube, JELLY)], [solid]))
    assert text.startswith("body 'a' passes through obstacle 'solid' (")


def stitched(x_of_high=None):
    """Two cubes face to face, stitched at the corners of one edge; `x_of_high` moves the upper one."""
    low = sp.Body("low", CUBE, JELLY)
    high = sp.Body("high", CUBE, JELLY, position=(0, 1, 0))
    x = CUBE.vertices
    edge = np.flatnonzero((np.abs(x[:, 0]) > 0.4) & (x[:, 1] < -0.4) & (x[:, 2] < -0.4))
    above = np.flatnonzero((np.abs(x[:, 0]) > 0.4) & (x[:, 1] > 0.4) & (x[:, 2] < -0.4))
    seam = sp.VertexVertexStitch("high", "low", pairs=np.column_stack([edge, above]), stiffness=1e3)
    scene = sp.Scene([low, high], stitches=[seam])
    moved = initial_state(scene).positions.copy()
    if x_of_high is not None:
        moved[len(x) :] = x_of_high(moved[len(x) :])
    return found(scene, x=moved)


def test_stitched_bodies_may_meet_at_the_seam_and_not_beside_it():
    assert stitched() == []
    # Corners at the seam go into the other body; then the whole face does.
    assert stitched(lambda x: x - 1e-3 * ((x[:, 1] < 0.6) & (x[:, 2] < -0.4))[:, None] * [0, 1, 0]) == []
    (text,) = stitched(lambda x: x - [0.05, 0.1, 0.05])
    assert text.startswith("body 'low' passes through body 'high' (")


def test_welded_bodies_may_meet_at_the_weld_and_not_beside_it():
    rigid = sp.RigidBody("rigid", sp.shapes.box_surface((1, 1, 1), (1, 1, 1)), density=1000, position=(0, -1.05, 0))
    bottom = np.flatnonzero((CUBE.vertices[:, 1] < -0.4) & (CUBE.vertices[:, 0] < -0.4))
    scene = sp.Scene([sp.Body("soft", CUBE, JELLY), rigid], welds=[sp.Weld("soft", "rigid", bottom)])
    start = initial_state(scene).positions
    assert found(scene, x=start) == []
    sunk = start.copy()
    sunk[: len(CUBE.vertices)] -= 0.1 * (CUBE.vertices[:, :1] > 0.4) * [0, 1, 0]
    (text,) = found(scene, x=sunk)
    assert text.startswith("body 'soft' passes through body 'rigid' (")
