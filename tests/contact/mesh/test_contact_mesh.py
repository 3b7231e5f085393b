"""The contact mesh: where its points are, what is adjacent to what, and what stitches exclude."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.contact.candidates import distances
from supple.contact.features.pair_geometry import EDGE_EDGE, VERTEX_TRIANGLE
from supple.contact.mesh.contact_mesh import contact_mesh, intersects, mesh_of_triangles
from supple.contact.mesh.obstacles import obstacle_positions, with_obstacles
from supple.model.system import build_system, initial_state
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.scene.contact_pairs import pair_table
from supple.scene.stitches.masks import stitched_edges, stitched_triangles

RUBBER = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0)


def mesh_of(scene):
    system, obstacles = with_obstacles(build_system(scene))
    start = np.concatenate([initial_state(scene).positions, obstacle_positions(obstacles, 0.0)])
    return contact_mesh(system, obstacles, pair_table(scene).collide, start), system, start


def combinations(seed=0):
    """Points that are combinations of one to four of 20 vertices, as W (7, 20) and as embedded points."""
    rng = np.random.default_rng(seed)
    start, vertices, weights, W = [0], [], [], np.zeros((7, 20))
    for i in range(7):
        chosen = rng.choice(20, 1 + i % 4, replace=False)
        share = rng.random(len(chosen))
        W[i, chosen] = share / share.sum()
        vertices += chosen.tolist()
        weights += W[i, chosen].tolist()
        start.append(len(vertices))
    return W, EmbeddedPoints(np.array(start, np.int32), np.array(vertices, np.int32), np.array(weights))


def test_embedded_points_are_combinations_and_forces_go_back_by_the_transpose():
    W, points = combinations()
    rng = np.random.default_rng(1)
    x, forces = rng.normal(size=(20, 3)), rng.normal(size=(7, 3))
    assert not points.are_vertices
    np.testing.assert_allclose(points.positions(x), W @ x, atol=1e-14)
    out = np.ones((20, 3))
    points.add_forces(forces, out)
    np.testing.assert_allclose(out, 1.0 + W.T @ forces, atol=1e-14)


def test_points_at_vertices_are_these_vertices():
    points = EmbeddedPoints.at_vertices(np.array([4, 1, 7], dtype=np.int32))
    x, forces, out = np.arange(30.0).reshape(10, 3), np.ones((3, 3)), np.zeros((10, 3))
    assert points.are_vertices
    np.testing.assert_array_equal(points.positions(x), x[[4, 1, 7]])
    assert points.positions(x).flags.c_contiguous
    points.add_forces(forces, out)
    np.testing.assert_array_equal(out.any(axis=1), np.isin(np.arange(10), [1, 4, 7]))
    twice = EmbeddedPoints(np.arange(3, dtype=np.int32), np.array([2, 2], np.int32), np.ones(2))
    assert not twice.are_vertices
    out[:] = 0.0
    twice.add_forces(forces[:2], out)
    assert out[2].tolist() == [2.0, 2.0, 2.0]


def test_adjacency_of_a_surface_with_a_boundary_and_an_edge_of_three_triangles():
    triangles = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4], [2, 1, 5]], dtype=np.int32)
    rest = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [2, 2, 0]], dtype=float)
    mesh = mesh_of_triangles(
        EmbeddedPoints.at_vertices(np.arange(6, dtype=np.int32)),
        triangles,
        np.zeros(6, dtype=np.int32),
        rest,
        body_count=1,
        names=("a",),
        collide=np.ones((1, 1), dtype=np.bool_),
    )
    expected = sorted({tuple(sorted((t[k], t[k - 1]))) for t in triangles.tolist() for k in range(3)})
    assert mesh.edges.tolist() == [list(edge) for edge in expected]
    for t, sides in enumerate(mesh.triangle_edges):
        for k in range(3):
            assert set(mesh.edges[sides[k]]) == {triangles[t, k], triangles[t, (k + 1) % 3]}
    for e, edge in enumerate(mesh.edges):
        around = [t for t in range(4) if set(edge) <= set(triangles[t])]
        assert (
            mesh.edge_triangles.items[mesh.edge_triangles.start[e] : mesh.edge_triangles.start[e + 1]].tolist()
            == around
        )
    for v in range(6):
        near = sorted({w for edge in expected if v in edge for w in edge} - {v})
        assert mesh.neighbors.items[mesh.neighbors.start[v] : mesh.neighbors.start[v + 1]].tolist() == near
        around = [t for t in range(4) if v in triangles[t]]
        lists = mesh.vertex_triangles
        assert lists.items[lists.start[v] : lists.start[v + 1]].tolist() == around
    assert mesh.edge_lengths[0] == 1.0
    total = (
        0.5 * np.linalg.norm(np.cross(*(rest[triangles[:, k]] - rest[triangles[:, 0]] for k in (1, 2))), axis=1).sum()
    )
    assert mesh.areas.sum() == pytest.approx(total)
    assert mesh.stitched is None


def test_a_scene_with_obstacles():
    box = sp.shapes.box((1, 1, 1), (2, 2, 2))
    scene = sp.Scene(
        [sp.Body("a", box, RUBBER), sp.Body("b", box, RUBBER, position=(0, 2, 0))],
        [sp.HalfSpace(), sp.obstacles.Box(center=(0, -1.5, 0), name="table")],
    )
    mesh, system, start = mesh_of(scene)
    assert mesh.names[:2] == ("a", "b")
    assert mesh.names[3] == "table"
    assert mesh.body_count == 2
    assert np.unique(mesh.owner).tolist() == [0, 1, 3]  # a half-space has no triangles
    assert not mesh.collide[3, 3]
    np.testing.assert_array_equal(mesh.points.positions(start), start[mesh.points.vertices])
    assert len(mesh.triangles) == len(system.triangles) + 12


def test_stitched_pairs_and_pairs_that_touch_at_the_start_are_excluded():
    box = sp.shapes.box((1, 1, 1), (3, 3, 3))
    stitch = sp.SoftVertexTriangleStitch(
        "a", "b", max_distance=0.02, youngs=1e5, poisson=0.4, min_separate_distance=1e-3
    )
    bodies = [sp.Body("a", box, RUBBER), sp.Body("b", box, RUBBER, position=(0, 1.0, 0))]
    mesh, system, start = mesh_of(sp.Scene(bodies, stitches=[stitch]))
    x, s = mesh.points.positions(start), len(mesh.points)
    number = np.full(len(start) + 1, -1)
    number[mesh.points.vertices] = np.arange(s)
    nodes = number[system.stitching.nodes()]
    stitched = np.isin(np.arange(s), nodes)
    apart = mesh.owner[:, None] != mesh.owner
    # Brute force over all pairs of the two bodies.
    points, faces = np.meshgrid(np.arange(s), np.arange(len(mesh.triangles)), indexing="ij")
    pairs = np.column_stack([points.ravel(), faces.ravel()]).astype(np.int32)
    pairs = pairs[apart[pairs[:, 0], mesh.triangles[pairs[:, 1], 0]]]
    near = distances(x, VERTEX_TRIANGLE, mesh.triangles, mesh.edges, pairs) < 1e-6
    near &= stitched[pairs[:, 0]] | stitched[mesh.triangles[pairs[:, 1]]].any(axis=1)
    expected = set(map(tuple, pairs[near].tolist())) | set(
        zip(*map(np.ndarray.tolist, stitched_triangles(nodes, mesh.triangles, s)), strict=True)
    )
    assert listed(mesh.stitched.triangles_of_point) == expected
    one, other = np.triu_indices(len(mesh.edges), 1)
    pairs = np.column_stack([one, other]).astype(np.int32)
    pairs = pairs[apart[mesh.edges[pairs[:, 0], 0], mesh.edges[pairs[:, 1], 0]]]
    near = (distances(x, EDGE_EDGE, mesh.triangles, mesh.edges, pairs) < 1e-6) & stitched[mesh.edges[pairs]].any(
        axis=(1, 2)
    )
    masked = np.column_stack(stitched_edges(nodes, mesh.edges, s)).tolist()
    expected = {pair for a, b in pairs[near].tolist() + masked for pair in ((a, b), (b, a))}
    assert listed(mesh.stitched.edges_of_edge) == expected
    assert len(expected) > 100


def listed(lists):
    return {
        (k, item)
        for k in range(len(lists.start) - 1)
        for item in lists.items[lists.start[k] : lists.start[k + 1]].tolist()
    }


def test_touching_seams_do_not_count_as_intersections():
    half = sp.shapes.box((1, 1, 0.2), (6, 6, 1))
    stitch = sp.SoftVertexTriangleStitch(
        "a", "b", max_distance=0.02, youngs=1e5, poisson=0.4, min_separate_distance=1e-3
    )
    bodies = [sp.Body("a", half, RUBBER), sp.Body("b", half, RUBBER, position=(0, 0, 0.2))]
    mesh, _, start = mesh_of(sp.Scene(bodies, stitches=[stitch]))
    x = mesh.points.positions(start)
    assert not intersects(mesh, x)
    plain = replace(mesh, stitched=None)
    assert intersects(plain, x)
    through = x + np.array([0.1, 0.1, 0.25]) * (mesh.owner == 0)[:, None]
    assert intersects(mesh, through)
