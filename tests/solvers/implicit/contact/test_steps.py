"""How far a step may go: against exact arithmetic for planes, and against intersections for triangles."""

from fractions import Fraction

import ipctk
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import supple as sp
from supple.contact.barrier import plane_contacts
from supple.model.system import build_system, initial_state
from supple.solvers.implicit.contact.model import contact_model

KEEP = Fraction(1, 10)


def largest_plane_step(x, direction, count=1):
    """Of `count` points before one plane, whose two points come after them."""
    pairs = np.array([[k, count, count + 1] for k in range(count)], dtype=np.int32)
    return plane_contacts.largest_plane_step(x, direction, pairs, float(KEEP))[0]


def exact_product(x, direction, k, t):
    """Distance times length of the normal of vertex k after the share t of a step, in rational numbers."""

    def at(row):
        return [Fraction(a) + t * Fraction(b) for a, b in zip(x[row].tolist(), direction[row].tolist(), strict=True)]

    vertex, base, tip = at(k), at(len(x) - 2), at(len(x) - 1)
    return sum((v - b) * (e - b) for v, b, e in zip(vertex, base, tip, strict=True))


def is_kept(x, direction, step):
    """Whether every vertex keeps a tenth of its distance all the way to `step`, up to round-off."""
    sizes = np.linalg.norm(x - x[-2], axis=1) + step * np.linalg.norm(direction - direction[-2], axis=1)
    rounding = [Fraction(1e-15 * size * sizes[-1]) for size in sizes.tolist()]
    step = Fraction(step)
    for k in range(len(x) - 2):
        now = exact_product(x, direction, k, Fraction(0))
        # A quadratic through three points: its values at 0, 1/2 and 1 of the step.
        p0, p1, p2 = (exact_product(x, direction, k, step * Fraction(i, 2)) for i in range(3))
        a, b = 2 * (p0 - 2 * p1 + p2), -3 * p0 + 4 * p1 - p2
        lowest = min(p0, p2)
        if a > 0 and 0 < -b < 2 * a:
            lowest = p0 - b * b / (4 * a)
        if lowest < (KEEP - Fraction(1, 10**9)) * now - rounding[k] or lowest <= 0:
            return False
    return True


def random_scene(rng, count, scale, away, turning):
    """Vertices before a plane, and a direction; the plane shifts, and turns where `turning`."""
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    base = scale * rng.normal(size=3) + away * rng.normal(size=3)
    across = rng.normal(size=(count, 3))
    across -= (across @ normal)[:, None] * normal
    gaps = 10.0 ** rng.uniform(-8, 0, count)
    points = base + scale * (across + gaps[:, None] * normal)
    x = np.concatenate([points, [base, base + scale * normal]])
    direction = scale * 10.0 ** rng.uniform(-6, 3) * rng.normal(size=x.shape)
    if not turning:
        direction[-1] = direction[-2]
    return x, direction


@settings(max_examples=120, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 2**31),
    scale=st.sampled_from([1.0, 1e-9, 1e-3, 1e6]),
    away=st.sampled_from([0.0, 10.0, 1e4]),
    turning=st.booleans(),
)
def test_steps_before_planes_never_overstep(seed, scale, away, turning):
    x, direction = random_scene(np.random.default_rng(seed), 6, scale, away * scale, turning)
    pairs = np.array([[k, 6, 7] for k in range(6)], dtype=np.int32)
    if plane_contacts.near_planes(x, pairs, np.inf)[3] <= 0.0:
        return  # rounded away by the distance from the origin
    step = largest_plane_step(x, direction, 6)
    assert 0.0 < step <= 1.0
    assert is_kept(x, direction, step)
    # And they are as long as they may be.
    if step < 1.0:
        assert not is_kept(x, direction, step * (1 + 1e-5))


@pytest.mark.parametrize("scale", [1.0, 1e-9, 1e3])
def test_a_step_towards_a_plane_leaves_a_tenth_of_the_distance(scale):
    x = scale * np.array([[0.3, 0.5, 0.0], [0, 0, 0], [0, 2, 0]])
    direction = scale * np.array([[5.0, -1.0, 0.0], [0, 0, 0], [0, 0, 0]])
    assert largest_plane_step(x, direction) == pytest.approx(0.45, rel=1e-14)
    assert largest_plane_step(x, -direction) == 1.0
    assert largest_plane_step(x, np.zeros_like(x)) == 1.0
    # The plane goes the same way.
    direction[1:, 1] = -scale
    assert largest_plane_step(x, direction) == 1.0


def test_a_plane_that_turns_stops_where_it_meets_a_vertex():
    # The tip goes straight from (0, 1) to (1, 0), in x and y: the vertex (-2, 1) is at the distance 1 - 3 t.
    x = np.array([[-2.0, 1.0, 0.0], [0, 0, 0], [0, 1, 0]])
    direction = np.array([[0.0, 0, 0], [0, 0, 0], [1, -1, 0]])
    assert largest_plane_step(x, direction) == pytest.approx(0.3, rel=1e-14)


def test_no_step_at_all_from_behind_a_plane_or_along_something_not_finite():
    x = np.array([[0.0, -1e-9, 0.0], [0, 0, 0], [0, 1, 0]])
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
def test_bodies_that_separate_may_move_as_far_as_the_search_covers(way):
    model, x = two_boxes()
    direction = np.zeros_like(x)
    direction[len(x) // 2 :, 1] = way
    step = model.largest_step(x, direction)[0]
    assert not crosses(model, x, direction, step)
    # Up to 128 pieces of a mean edge each are looked at.
    assert step == 1.0 if way <= 49.0 else 0.0 < step < 1.0


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
