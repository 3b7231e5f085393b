"""How far a step may go: before planes, and against intersections for triangles."""

import ipctk
import numpy as np
import pytest

import supple as sp
from supple.contact.features.half_spaces import HalfSpaces
from supple.model.system import build_system, initial_state
from supple.solvers.implicit.contact.model import contact_model


def largest_plane_step(x, direction, offset=0.0):
    """Of one point before a plane, whose three points come after it."""
    planes = object.__new__(HalfSpaces)
    planes.tets, planes._all = np.array([[1, 2, 3, 0]], dtype=np.int32), np.ones(1, dtype=np.bool_)
    planes.offsets = np.array([offset])
    return planes.largest_step(x, direction)[0]


@pytest.mark.parametrize("scale", [1.0, 1e-9, 1e3])
def test_a_step_towards_a_plane_leaves_a_tenth_of_the_distance(scale):
    x = scale * np.array([[0.3, 0.5, 0.0], [0, 0, 0], [0, 0, 2], [2, 0, 0]])
    direction = scale * np.array([[5.0, -1.0, 0.0], [0, 0, 0], [0, 0, 0], [0, 0, 0]])
    assert largest_plane_step(x, direction) == pytest.approx(0.45, rel=1e-13)
    assert largest_plane_step(x, -direction) == 1.0
    assert largest_plane_step(x, np.zeros_like(x)) == 1.0
    # A tenth of what is beyond an offset.
    assert largest_plane_step(x, direction, 0.3 * scale) == pytest.approx(0.18, rel=1e-13)
    # The plane goes the same way.
    direction[1:, 1] = -scale
    assert largest_plane_step(x, direction) == 1.0


def test_a_plane_that_turns_stops_where_it_meets_a_vertex():
    # A point goes straight from (1, 0) to (0, -1), in x and y: the volume of the vertex (-2, 1) goes with 1 - 3 t.
    x = np.array([[-2.0, 1.0, 0.0], [0, 0, 0], [0, 0, 1], [1, 0, 0]])
    direction = np.array([[0.0, 0, 0], [0, 0, 0], [0, 0, 0], [-1, -1, 0]])
    assert largest_plane_step(x, direction) == pytest.approx(0.3, rel=1e-13)


def test_no_step_at_all_from_behind_a_plane_or_along_something_not_finite():
    x = np.array([[0.0, -1e-9, 0.0], [0, 0, 0], [0, 0, 1], [1, 0, 0]])
    direction = np.zeros_like(x)
    assert largest_plane_step(x, direction) == 0.0
    x[0, 1] = 1.0
    direction[0, 0] = np.nan
    assert largest_plane_step(x, direction) == 0.0
    direction[0, 0] = np.inf
    assert largest_plane_step(x, direction) == 0.0


def two_boxes(gap=0.3, divisions=2):
    material = sp.StableNeoHookean(youngs=1e4, poisson=0.3, density=1000.0)
    mesh = sp.shapes.box((1, 1, 1), (divisions,) * 3)
    scene = sp.Scene([sp.Body("one", mesh, material), sp.Body("two", mesh, material, position=(0.05, 1 + gap, 0.02))])
    model = contact_model(build_system(scene), sp.IPCContact(), np.full(2 * len(mesh.tets), 1e4))
    return model, initial_state(scene).positions


def crosses(model, x, direction, step, samples=20):
    points, faces = model.mesh.points, np.asfortranarray(model.mesh.triangles)
    mesh = ipctk.CollisionMesh(np.asfortranarray(points.positions(x)), ipctk.edges(faces), faces)
    return any(
        ipctk.has_intersections(mesh, np.asfortranarray(points.positions(x + t * direction)))
        for t in step * np.linspace(0, 1, samples)
    )


@pytest.mark.parametrize("speed", [0.3, 3.0, 30.0])
@pytest.mark.parametrize("seed", range(8))
def test_no_two_triangles_cross_within_a_step(seed, speed):
    model, x = two_boxes()
    rng = np.random.default_rng(seed)
    direction = speed * rng.normal(size=x.shape)
    half = len(x) // 2
    # Whole bodies against each other, and every vertex a way of its own.
    direction *= rng.uniform(0, 1)
    direction[:half] += speed * np.array([0.2, 1.0, -0.1])
    direction[half:] -= speed * np.array([0.1, 1.0, 0.3])
    step = model.largest_step(x, direction)[0]
    assert 0.0 < step <= 1.0
    assert not crosses(model, x, direction, step)
    if speed >= 3.0:
        assert step < 1.0
        assert crosses(model, x, direction, min(1.0, 4.0 * step), 60)


@pytest.mark.parametrize("way", [0.1, 1.0, 49.0, 1e3, 1e9])
def test_bodies_that_separate_may_move_any_way(way):
    model, x = two_boxes()
    direction = np.zeros_like(x)
    direction[len(x) // 2 :, 1] = way
    step = model.largest_step(x, direction)[0]
    assert not crosses(model, x, direction, step)
    # What they sweep is apart: nothing is looked at in pieces.
    assert step == 1.0


@pytest.mark.parametrize("way", [1.0, 10.0, 40.0, 1e4])
def test_a_long_step_stops_before_a_body_in_its_way(way):
    """A body flies at another one across many times its size."""
    model, x = two_boxes(gap=8.0)
    direction = np.zeros_like(x)
    direction[: len(x) // 2, 1] = way
    step = model.largest_step(x, direction)[0]
    assert step * way < 8.0
    assert not crosses(model, x, direction, step)
    if way == 1.0:
        assert step == 1.0
    else:
        # A tenth of the distance is kept from where the last piece of the way begins.
        assert step * way > 6.5


@pytest.mark.slow
def test_a_complete_step_in_many_pieces_is_exactly_one():
    """Shares must not add up to slightly less than one: pins must arrive."""
    model, x = two_boxes()
    direction = np.zeros_like(x)
    for way in np.linspace(40.0, 60.0, 12):
        direction[len(x) // 2 :, 1] = way
        assert model.largest_step(x, direction)[0] == 1.0


def test_the_step_along_a_direction_that_is_not_finite_is_zero():
    model, x = two_boxes()
    direction = np.zeros_like(x)
    direction[0, 0] = np.nan
    assert model.largest_step(x, direction)[0] == 0.0


def test_surfaces_are_found_wherever_the_line_search_goes():
    """Contacts at a point of a searched step are those of a new search at that point."""
    model, x = two_boxes(gap=0.01)
    direction = np.zeros_like(x)
    direction[len(x) // 2 :, 1] = -1.0
    collisions = model.collisions
    for way in (1.0, 100.0):
        step = model.largest_step(x, way * direction)[0]
        for share in (1.0, 0.999, 0.5, 0.0):
            at = x + share * step * way * direction
            found = len(collisions.at(at).kinds)
            fresh, _ = two_boxes(gap=0.01)
            assert found == len(fresh.collisions.at(at).kinds)
        assert len(collisions.at(x + 0.99 * step * way * direction).kinds) > 0 or model.scales.dhat < 0.01
