"""Intersections at the start: they are found exactly, classified, and reported in one line."""

from fractions import Fraction

import numpy as np
import pytest

import supple as sp
from supple.contact.start.intersections import intersections_of
from supple.contact.start.start_error import raise_if_intersecting
from supple.contact.start.surfaces import start_surfaces
from supple.model.system import build_system, initial_state
from supple.numerics.geometry.exact_predicates import side_of_plane
from supple.scene.contact_pairs import pair_table

RUBBER = sp.StableNeoHookean(youngs=1e5, poisson=0.4)


def cube(name, position, divisions=2, size=1.0, rotation=(0, 0, 0)):
    mesh = sp.shapes.box((size, size, size), (divisions,) * 3)
    return sp.Body(name, mesh, RUBBER, position=position, rotation=rotation)


def find_intersections(system, x, time, table):
    return intersections_of(start_surfaces(system, x, time), table)


def found_in(scene, positions=None, time=0.0):
    x = initial_state(scene, positions).positions
    return find_intersections(build_system(scene), x, time, pair_table(scene))


def one(scene, positions=None):
    (item,) = found_in(scene, positions)
    return item


def error_of(scene, positions=None):
    system, x = build_system(scene), initial_state(scene, positions).positions
    with pytest.raises(sp.SceneError) as caught:
        raise_if_intersecting(system, x, 0.0, pair_table(scene))
    return str(caught.value)


def exact_det(a, b, c, d):
    u, v, w = ([Fraction(float(q)) - Fraction(float(p)) for p, q in zip(a, r, strict=True)] for r in (b, c, d))
    return w[0] * (u[1] * v[2] - u[2] * v[1]) + w[1] * (u[2] * v[0] - u[0] * v[2]) + w[2] * (u[0] * v[1] - u[1] * v[0])


def sign(value):
    return (value > 0) - (value < 0)


def test_sides_are_those_of_rational_arithmetic_also_within_round_off():
    rng = np.random.default_rng(1)
    zeros = doubtful = 0
    for k in range(300):
        a, b, c = rng.uniform(-1, 1, (3, 3)) * 10.0 ** rng.integers(-3, 4)
        s, t = rng.uniform(-1, 1, 2)
        d = a + s * (b - a) + t * (c - a)  # in the plane but for rounding
        if k % 3 == 0:  # exactly in it
            a, b, c, d = np.round(np.array([a, b, c, d]) * 8) / 8
            d = a + b - c
        expected = sign(exact_det(a, b, c, d))
        assert side_of_plane(tuple(a), tuple(b), tuple(c), tuple(d)) == expected
        zeros += expected == 0
        doubtful += abs(np.linalg.det([b - a, c - a, d - a])) < 1e-13
    assert zeros > 50
    assert doubtful > 200


def segment_meets_triangle(p, q, a, b, c):
    """Rational arithmetic, for segments that are in no plane of a triangle."""
    dp, dq = exact_det(a, b, c, p), exact_det(a, b, c, q)
    assert dp != 0
    assert dq != 0
    sides = {sign(exact_det(p, q, *edge)) for edge in ((a, b), (b, c), (c, a))}
    return sign(dp) != sign(dq) and sides in ({1}, {-1})


@pytest.mark.parametrize("seed", range(4))
def test_crossing_triangles_are_those_of_brute_force_in_random_scenes(seed):
    rng = np.random.default_rng(seed)
    bodies = [cube(f"c{i}", rng.uniform(-0.4, 0.4, 3), 1, size=0.7, rotation=rng.uniform(-3, 3, 3)) for i in range(3)]
    sheet = sp.SurfaceMesh(rng.uniform(-1, 1, (6, 3)), [[0, 1, 2], [3, 4, 5]])
    scene = sp.Scene(bodies, [sp.obstacles.TriangleObstacle(surface=sheet, name="sheet")])
    soup = [body.place(body.mesh.vertices)[body.mesh.surface.triangles] for body in bodies] + [
        sheet.vertices[sheet.triangles]
    ]
    expected = {}
    for a in range(3):
        for b in range(a + 1, 4):
            pairs = set()
            for i, s in enumerate(soup[a]):
                for j, t in enumerate(soup[b]):
                    if (s.min(axis=0) > t.max(axis=0)).any() or (t.min(axis=0) > s.max(axis=0)).any():
                        continue
                    edges = [(s[k], s[k - 1], *t) for k in range(3)] + [(t[k], t[k - 1], *s) for k in range(3)]
                    if any(segment_meets_triangle(*edge) for edge in edges):
                        pairs.add((i, j))
            if pairs:
                expected[a, b] = pairs
    found = {(item.first, item.second): item for item in found_in(scene)}
    assert {key: set(map(tuple, item.triangles.tolist())) for key, item in found.items()} == expected
    assert len(expected) >= 3
    assert {item.kind for item in found.values()} == {"overlaps"}


def test_bodies_far_from_the_origin_do_not_intersect():
    bodies = [cube("a", (0, 0.6, 0)), cube("b", (1.0 + 1e-12, 0.6, 0)), cube("c", (0, 2.0, 0), rotation=(0.3, 0, 0.1))]
    obstacles = [sp.HalfSpace(), sp.obstacles.Sphere(center=(0, 3.9, 0)), sp.obstacles.Box(size=(9, 9, 9), inside=True)]
    obstacles += [sp.obstacles.Sphere(radius=9, inside=True), sp.obstacles.Box(center=(2.6, 0, 0), rotation=(0, 1, 0))]
    scene = sp.Scene(bodies, obstacles)
    assert found_in(scene) == []
    raise_if_intersecting(build_system(scene), initial_state(scene).positions, 0.0, pair_table(scene))


def test_the_error_for_overlapping_cubes_names_a_separating_translation():
    a, b = cube("a", (0, 0, 0)), cube("b", (0.8, 0.1, 0.2))
    item = one(sp.Scene([a, b]))
    assert item.kind == "overlaps"
    assert item.depth == pytest.approx(0.2, abs=1e-9)
    assert np.abs(item.point - (0.4, 0, 0)).max() <= 0.6
    text = error_of(sp.Scene([a, b]))
    i, j = item.triangles[0]
    assert text.startswith(f"body 'a' overlaps body 'b' at the start (triangles {i} with {j}, ")
    assert (
        "m, about 0.2 m deep; move body 'b' by (0.2057, 0, 0), or run `supple run --separate`, which moves it" in text
    )
    assert found_in(sp.Scene([a, cube("b", (1.0057, 0.1, 0.2))])) == []


def test_touching_is_an_error_of_its_own_kind():
    item = one(sp.Scene([cube("a", (0, 0, 0)), cube("b", (1, 0.3, 0))]))
    assert (item.kind, item.depth) == ("touches", 0.0)
    assert "body 'a' touches body 'b' at the start" in error_of(sp.Scene([cube("a", (0, 0, 0)), cube("b", (1, 0, 0))]))
    assert one(sp.Scene([cube("a", (0, 0.5, 0))], [sp.HalfSpace()])).kind == "touches"


def test_aligned_cubes_overlap_though_no_edge_goes_through_a_face():
    assert one(sp.Scene([cube("a", (0, 0, 0)), cube("b", (0.5, 0, 0))])).kind == "overlaps"
    assert one(sp.Scene([cube("a", (0, 0, 0)), cube("b", (0, 0, 0))])).kind == "overlaps"


INSIDE = {
    "solid sphere": (sp.obstacles.Sphere(), "is inside"),
    "solid box": (sp.obstacles.Box(), "is inside"),
    "solid triangles": (sp.obstacles.TriangleObstacle(surface=sp.shapes.sphere_surface(1.0, 0.5)), "is inside"),
    "half-space": (sp.HalfSpace(point=(0, 3, 0)), "is inside"),
    "small sphere in the body": (sp.obstacles.Sphere(radius=0.05), "is around"),
    "room elsewhere": (sp.obstacles.Box(center=(5, 0, 0), inside=True), "is outside"),
    "bowl elsewhere": (sp.obstacles.Sphere(center=(0, 5, 0), inside=True), "is outside"),
    "bowl too small": (sp.obstacles.Sphere(radius=0.05, inside=True), "is outside"),
}


@pytest.mark.parametrize("what", INSIDE)
def test_bodies_completely_inside_a_solid_or_outside_a_room(what):
    obstacle, kind = INSIDE[what]
    scene = sp.Scene([cube("a", (0, 0, 0), size=0.3)], [obstacle])
    assert one(scene).kind == kind
    assert f"body 'a' {kind} obstacle" in error_of(scene)
    off = sp.Scene(
        scene.bodies, scene.obstacles, contact_pairs=[sp.ContactPair("a", str(scene.obstacles[0].name), collide=False)]
    )
    assert found_in(off) == []


def test_a_body_completely_inside_another_and_one_in_a_room():
    assert one(sp.Scene([cube("a", (0, 0, 0), size=0.3), cube("b", (0, 0, 0))])).kind == "is inside"
    assert found_in(sp.Scene([cube("a", (0, 0, 0), size=0.3)], [sp.obstacles.Sphere(inside=True)])) == []
    assert one(sp.Scene([cube("a", (0, 0.9, 0), size=0.3)], [sp.obstacles.Sphere(inside=True)])).kind == "overlaps"


def test_a_cube_half_in_the_floor_names_its_triangles_and_the_way_out():
    body = cube("a", (0, 0.0, 0))
    scene = sp.Scene([body], [sp.HalfSpace(name="floor")])
    item = one(scene)
    heights = body.mesh.vertices[body.mesh.surface.triangles][:, :, 1].min(axis=1)
    assert item.triangles[:, 0].tolist() == np.flatnonzero(heights <= 0).tolist()
    assert item.depth == 0.5
    assert item.point[1] == -0.5
    assert "move body 'a' by (0, 0.5057, 0)" in error_of(scene)


def test_scripted_obstacles_are_where_they_are_at_that_time():
    floor = sp.HalfSpace(motion=sp.Keyframes([0, 1], displacements=[(0, 0, 0), (0, 1, 0)]))
    scene = sp.Scene([cube("a", (0, 1, 0))], [floor])
    assert found_in(scene) == []
    (item,) = found_in(scene, time=1.0)
    assert item.depth == pytest.approx(0.5)


def bent(overlap):
    """A long bar bent round until its two ends go `overlap` [m] into each other."""
    mesh = sp.shapes.box((6.0, 0.4, 0.4), (24, 1, 1))
    x, y, z = mesh.vertices.T
    radius = 6.0 / (2 * np.pi)
    angle = x / 6.0 * (2 * np.pi + overlap / radius)
    ring = np.stack([(radius + y) * np.sin(angle), (radius + y) * np.cos(angle), z * (1.0 + 0.1 * x)], axis=1)
    return sp.Body("ring", mesh, RUBBER), {"ring": ring}


@pytest.mark.parametrize(("overlap", "there"), [(-0.3, False), (0.3, True)])
def test_a_body_folded_onto_itself(overlap, there):
    body, start = bent(overlap)
    found = found_in(sp.Scene([body]), start)
    assert len(found) == there
    if there:
        (item,) = found
        assert (item.first, item.second, item.kind) == (0, 0, "overlaps")
        ends = np.abs(body.mesh.vertices[body.mesh.surface.triangles][:, :, 0].mean(axis=1)) > 2.4
        assert ends[item.triangles].all()
        text = error_of(sp.Scene([body]), start)
        assert text.startswith("body 'ring' intersects itself at the start (triangles ")
        assert "no translation separates a body from itself" in text
        switched_off = sp.Scene([body], contact_pairs=[sp.ContactPair("ring", "ring", collide=False)])
        assert found_in(switched_off, start) == []


@pytest.mark.slow
def test_fifty_thousand_triangles_and_the_one_that_is_wrong():
    a, b = cube("a", (0, 0, 0), 46), cube("b", (1.001, 0, 0), 46)
    scene = sp.Scene([a, b])
    assert sum(len(body.mesh.surface.triangles) for body in scene.bodies) > 50_000
    x = initial_state(scene).positions
    system = build_system(scene)
    table = pair_table(scene)
    assert find_intersections(system, x, 0.0, table) == []
    vertex = int(np.argmin(np.abs(x - (0.5, 0, 0)).sum(axis=1)))
    x[vertex, 0] += 0.0015
    (item,) = find_intersections(system, x, 0.0, table)
    around = np.flatnonzero((a.mesh.surface.triangles == vertex).any(axis=1))
    assert set(item.triangles[:, 0].tolist()) <= set(around.tolist())


def test_a_pinned_body_is_not_the_one_that_is_moved():
    bodies = [cube("a", (0, 0, 0)), cube("b", (0.8, 0.1, 0.2))]
    assert "move body 'a' by (-0.2057, 0, 0)" in error_of(sp.Scene(bodies, pins=[sp.Pin("b", [0])]))
    assert "pins hold what would have to move" in error_of(sp.Scene(bodies, pins=[sp.Pin("b", [0]), sp.Pin("a", [0])]))
