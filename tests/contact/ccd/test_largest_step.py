"""How far surfaces may move: the pair that limits a step, and pieces of a long way."""

import ipctk
import numba
import numpy as np
import pytest

import supple as sp
from supple.contact.candidates import CandidateFinder
from supple.contact.ccd import Along, largest_step
from supple.contact.features.pair_geometry import VERTEX_TRIANGLE
from supple.contact.mesh.contact_mesh import intersects, mesh_of_triangles
from supple.numerics.geometry.embedded_points import EmbeddedPoints


def boxes(distance, divisions=2, count=2):
    surface = sp.shapes.box((1.0, 1.0, 1.0), (divisions,) * 3).surface
    used, triangles = np.unique(surface.triangles, return_inverse=True)
    one, triangles = surface.vertices[used], triangles.reshape(-1, 3)
    x = np.concatenate([one + k * np.array([0.1, 1.0 + distance, 0.07]) for k in range(count)])
    mesh = mesh_of_triangles(
        EmbeddedPoints.at_vertices(np.arange(len(x), dtype=np.int32)),
        np.concatenate([triangles + k * len(one) for k in range(count)]),
        np.repeat(np.arange(count, dtype=np.int32), len(one)),
        x,
        body_count=count,
        names=tuple(map(str, range(count))),
        collide=np.ones((count, count), dtype=np.bool_),
    )
    return mesh, x


@pytest.mark.parametrize("length", [0.3, 2.0, 40.0])
@pytest.mark.parametrize("dhat", [1e-3, 0.03])
def test_a_box_that_falls_on_another_keeps_a_tenth_of_the_distance_or_dhat(length, dhat):
    mesh, x = boxes(0.25)
    way = np.zeros_like(x)
    way[mesh.owner == 1, 1] = -length
    limit = Along(CandidateFinder(mesh, dhat), x, way).largest_step(way)
    left = 0.25 - length * limit.step
    if length < 1.0:  # in one piece; a later piece keeps a tenth of what the earlier ones leave
        assert left == pytest.approx(min(0.025, dhat), rel=0.06)
    assert 1e-4 < left < 0.1
    first, *parts = limit.points if limit.kind == VERTEX_TRIANGLE else limit.points[1:]
    assert {mesh.owner[first], mesh.owner[parts[0]]} == {0, 1}


def test_a_way_that_leads_away_is_taken_completely():
    mesh, x = boxes(1e-6)
    way = np.zeros_like(x)
    way[mesh.owner == 1, 1] = 7.3
    limit = Along(CandidateFinder(mesh, 1e-3), x, way).largest_step(way)
    assert (limit.step, limit.points) == (1.0, ())
    assert Along(CandidateFinder(mesh, 1e-3), x, np.zeros_like(x)).largest_step(np.zeros_like(x)).step == 1.0


@pytest.mark.parametrize("value", [np.inf, np.nan])
def test_a_way_that_is_not_finite_is_not_taken(value):
    mesh, x = boxes(0.1)
    way = np.zeros_like(x)
    way[3, 1] = value
    assert Along(CandidateFinder(mesh, 1e-3), x, way).largest_step(way).step == 0.0


def distance_of(mesh, limit, x):
    if limit.kind == VERTEX_TRIANGLE:
        return np.sqrt(ipctk.point_triangle_distance(*x[list(limit.points)]))
    one, other = list(limit.points[:2]), list(limit.points[2:])
    return np.sqrt(ipctk.edge_edge_distance(*x[one], *x[other]))


def test_random_ways_never_lead_to_intersections_and_end_at_a_tenth_of_a_distance():
    rng = np.random.default_rng(0)
    mesh, x = boxes(0.05)
    finder = CandidateFinder(mesh, 0.5)
    limited = 0
    for _ in range(60):
        way = rng.normal(size=x.shape) * 10.0 ** rng.uniform(-2.5, 1)
        limit = Along(finder, x, way).largest_step(way)
        for share in (0.3, 0.7, 1.0):
            assert not intersects(mesh, x + share * limit.step * way)
        if limit.points and np.linalg.norm(way, axis=1).max() < mesh.edge_lengths.mean():  # in one piece
            end = distance_of(mesh, limit, x + limit.step * way)
            assert 0.0999 <= end / distance_of(mesh, limit, x) <= 0.106
            limited += 1
        x = x + 0.9 * limit.step * way
    assert limited > 15


def test_steps_do_not_depend_on_the_number_of_threads():
    rng = np.random.default_rng(1)
    mesh, x = boxes(0.05, divisions=4)
    candidates = CandidateFinder(mesh, 0.3).find(x, x)
    ways = 0.2 * rng.normal(size=(5, *x.shape))
    before = numba.get_num_threads()
    found = []
    for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
        numba.set_num_threads(threads)
        found.append([largest_step(mesh, x, way, candidates) for way in ways])
    numba.set_num_threads(before)
    assert found[0] == found[1]
    assert all(limit.step < 1.0 for limit in found[0])


def test_surfaces_intersect_where_triangles_that_may_touch_cross():
    mesh, x = boxes(0.1)
    assert not intersects(mesh, x)
    through = x - [0.0, 0.2, 0.0] * mesh.owner[:, None]
    assert intersects(mesh, through)
    mesh.collide[:] = np.eye(2, dtype=np.bool_)
    assert not intersects(mesh, through)
