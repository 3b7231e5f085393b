"""Candidates for contact: nothing that comes near is missing, and nothing is searched again without need."""

import ipctk
import numba
import numpy as np
import pytest

import supple as sp
from supple.contact.candidates import CandidateFinder, distances
from supple.contact.features.pair_geometry import EDGE_EDGE, VERTEX_TRIANGLE
from supple.contact.mesh.contact_mesh import mesh_of_triangles
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.runtime import parallel_kernel

DHAT = 0.02


def scene(count=3, divisions=3, collide=None, seed=0):
    """Boxes beside each other, the last of which is an obstacle: mesh and places (s, 3)."""
    rng = np.random.default_rng(seed)
    surface = sp.shapes.box((1.0, 1.0, 1.0), (divisions,) * 3).surface
    used, triangles = np.unique(surface.triangles, return_inverse=True)
    one = surface.vertices[used]
    triangles = triangles.reshape(-1, 3)
    x = np.concatenate([one + [0.0, 1.005 * k, 0.0] + 0.1 * rng.random(3) * [1, 0, 1] for k in range(count)])
    owner = np.repeat(np.arange(count, dtype=np.int32), len(one))
    if collide is None:
        collide = np.ones((count, count), dtype=np.bool_)
        collide[-1, -1] = False
    mesh = mesh_of_triangles(
        EmbeddedPoints.at_vertices(np.arange(len(x), dtype=np.int32)),
        np.concatenate([triangles + k * len(one) for k in range(count)]),
        owner,
        x,
        body_count=count - 1,
        names=tuple(map(str, range(count))),
        collide=collide,
    )
    return mesh, x


def near_pairs(mesh, places):
    """Every allowed pair that is nearer than DHAT at one of the places, by the library's broad phase."""
    triangles, edges = np.asfortranarray(mesh.triangles), np.asfortranarray(mesh.edges)
    library = ipctk.CollisionMesh(np.asfortranarray(places[0]), edges, triangles)
    found = set(), set()
    for x in places:
        candidates = ipctk.Candidates()
        candidates.build(library, np.asfortranarray(x), DHAT)
        points = np.array([(c.vertex_id, c.face_id) for c in candidates.fv_candidates], dtype=np.int32).reshape(-1, 2)
        sides = np.array([(c.edge0_id, c.edge1_id) for c in candidates.ee_candidates], dtype=np.int32).reshape(-1, 2)
        points = points[distances(x, VERTEX_TRIANGLE, mesh.triangles, mesh.edges, points) < DHAT]
        sides = np.sort(sides[distances(x, EDGE_EDGE, mesh.triangles, mesh.edges, sides) < DHAT], axis=1)
        owners = mesh.owner[points[:, 0]], mesh.owner[mesh.triangles[points[:, 1], 0]]
        found[0].update(map(tuple, points[mesh.collide[owners]].tolist()))
        owners = mesh.owner[edges[sides[:, 0], 0]], mesh.owner[edges[sides[:, 1], 0]]
        found[1].update(map(tuple, sides[mesh.collide[owners]].tolist()))
    return found


def assert_contains(candidates, needed):
    assert not needed[0] - set(map(tuple, candidates.vertex_triangle.tolist()))
    assert not needed[1] - set(map(tuple, candidates.edge_edge.tolist()))


def along(begin, end, shares=(0.0, 0.2, 0.5, 0.8, 1.0)):
    return [begin + share * (end - begin) for share in shares]


@pytest.mark.parametrize("size", [1e-3, 0.03, 0.3])
def test_ways_of_any_length_miss_nothing(size):
    mesh, x = scene()
    rng = np.random.default_rng(1)
    finder = CandidateFinder(mesh, DHAT)
    count = 0
    for _ in range(6):
        # Parts of bodies move by themselves, bodies as a whole.
        way = size * rng.normal(size=x.shape) + size * rng.normal(size=(3, 3))[mesh.owner]
        found = finder.find(x, x + way)
        needed = near_pairs(mesh, along(x, x + way))
        assert_contains(found, needed)
        for place in along(x, x + way):
            assert_contains(finder.at(place), near_pairs(mesh, [place]))
        count += len(needed[0]) + len(needed[1])
        x = x + 0.3 * way
    assert count > 500


def test_small_motions_renew_candidates_rarely_and_miss_nothing():
    mesh, x = scene()
    rng = np.random.default_rng(2)
    finder = CandidateFinder(mesh, DHAT)
    different = set()
    for _ in range(40):
        x = x + 0.05 * DHAT * rng.normal(size=x.shape) + 0.2 * DHAT * rng.normal(size=(3, 3))[mesh.owner]
        found = finder.at(x)
        different.add(id(found))
        assert_contains(found, near_pairs(mesh, [x]))
    assert 1 < len(different) < 30


def test_candidates_are_kept_while_everything_moves_as_a_whole():
    mesh, x = scene()
    finder = CandidateFinder(mesh, DHAT)
    first = finder.at(x)
    moved = x + np.array([0.5, -1.0, 2.0])
    assert finder.at(moved) is first
    assert finder.find(x, moved) is first
    turned = moved + 0.1 * (moved @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 0]]) - moved[0])
    assert finder.find(moved, turned) is not first
    assert_contains(finder.at(turned), near_pairs(mesh, [turned]))


def test_places_on_the_way_need_no_search(monkeypatch):
    mesh, x = scene()
    rng = np.random.default_rng(4)
    way = 0.2 * rng.normal(size=x.shape)
    finder = CandidateFinder(mesh, DHAT)
    finder.find(x, x + way)
    monkeypatch.setattr("supple.contact.candidates.PatchSearch.find", None)
    for place in along(x, x + way, (1.0, 0.5, 0.25, 0.1, 0.01)):
        assert_contains(finder.at(place), near_pairs(mesh, [place]))


def test_one_search_serves_every_shorter_way_of_each_point():
    mesh, x = scene()
    rng = np.random.default_rng(9)
    way = 0.2 * rng.normal(size=(3, 3))[mesh.owner] + 0.1 * rng.normal(size=x.shape)
    finder = CandidateFinder(mesh, DHAT)
    finder.find(x, x + way)
    needed = 0
    for _ in range(12):
        begin, end = (x + rng.random((3, 1))[mesh.owner] * way for _ in range(2))
        pairs = near_pairs(mesh, along(begin, end))
        assert_contains(finder.find(begin, end), pairs)
        assert_contains(finder.at(end), near_pairs(mesh, [end]))
        needed += len(pairs[0]) + len(pairs[1])
    assert finder.searches == 1
    assert needed > 500


def test_pairs_with_common_points_and_pairs_that_may_not_touch_are_left_out():
    allowed = np.array([[False, True, False], [True, True, True], [False, True, False]])
    mesh, x = scene(collide=allowed)
    rng = np.random.default_rng(5)
    found = CandidateFinder(mesh, DHAT).find(x, x + 0.3 * rng.normal(size=x.shape))
    points, corners = found.vertex_triangle[:, 0], mesh.triangles[found.vertex_triangle[:, 1]]
    assert not (points[:, None] == corners).any()
    assert allowed[mesh.owner[points], mesh.owner[corners[:, 0]]].all()
    one, other = mesh.edges[found.edge_edge[:, 0]], mesh.edges[found.edge_edge[:, 1]]
    assert not (one[:, :, None] == other[:, None]).any()
    assert allowed[mesh.owner[one[:, 0]], mesh.owner[other[:, 0]]].all()
    assert (found.edge_edge[:, 0] < found.edge_edge[:, 1]).all()
    for pairs in (found.vertex_triangle, found.edge_edge):
        assert len(np.unique(pairs, axis=0)) == len(pairs) > 100


def test_candidates_do_not_depend_on_the_number_of_threads(monkeypatch):
    monkeypatch.setattr(parallel_kernel, "_has_rows", lambda arguments, least: True)
    mesh, x = scene(divisions=4)
    results = []
    before = numba.get_num_threads()
    for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
        numba.set_num_threads(threads)
        rng = np.random.default_rng(6)
        finder, place, parts = CandidateFinder(mesh, DHAT), x, []
        for size in (0.3, 0.01, 0.1):
            way = size * rng.normal(size=x.shape)
            parts += [finder.find(place, place + way), finder.at(place + 0.2 * way)]
            place = place + 0.2 * way
        results.append(parts)
    numba.set_num_threads(before)
    for a, b in zip(*results, strict=True):
        np.testing.assert_array_equal(a.vertex_triangle, b.vertex_triangle)
        np.testing.assert_array_equal(a.edge_edge, b.edge_edge)


def test_a_surface_that_cannot_touch_anything_has_no_candidates():
    mesh, x = scene(collide=np.zeros((3, 3), dtype=np.bool_))
    assert len(CandidateFinder(mesh, DHAT).find(x, 0.5 * x)) == 0
