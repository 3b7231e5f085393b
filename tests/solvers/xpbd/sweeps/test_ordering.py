"""Levels, chunks and colors: constraints that may run in parallel are independent."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import supple as sp
from supple.model.system import build_system
from supple.numerics.coloring import breadth_first_order, independent_groups
from supple.solvers.xpbd.sweeps import ordering
from supple.solvers.xpbd.sweeps.ordering import make_layout, reordered


@st.composite
def constraint_lists(draw):
    n = draw(st.integers(4, 40))
    rows = draw(st.lists(st.lists(st.integers(0, n - 1), min_size=4, max_size=4, unique=True), max_size=60))
    return n, np.array(rows, dtype=np.int32).reshape(-1, 4)


@settings(max_examples=50, deadline=None)
@given(constraint_lists())
def test_constraints_span_at_most_two_levels(case):
    n, constraints = case
    order, levels = breadth_first_order([constraints], n)
    assert sorted(order) == list(range(n))
    assert (np.diff(levels[order]) >= 0).all()
    assert (np.diff(levels[order]) <= 1).all()
    if len(constraints):
        assert np.ptp(levels[constraints], axis=1).max() <= 1


@settings(max_examples=50, deadline=None)
@given(constraint_lists(), st.integers(1, 5), st.integers(1, 20), st.integers(0, 60))
def test_the_members_of_a_group_share_no_vertex(case, width, window, cut):
    n, constraints = case
    starts = np.array([0, min(cut, len(constraints)), len(constraints)])
    members, counts, pointers = independent_groups(constraints, starts, n, width, window)
    of_groups = [row[:count] for row, count in zip(members, counts, strict=True)]
    assert sorted(np.concatenate([[], *of_groups])) == list(range(len(constraints)))
    for group, row, count in zip(of_groups, members, counts, strict=True):
        assert 1 <= count <= width
        assert (row[count:] == row[0]).all()
        assert len(np.unique(constraints[group])) == 4 * count
    for run in range(2):
        inside = [c for group in of_groups[pointers[run] : pointers[run + 1]] for c in group]
        assert sorted(inside) == list(range(starts[run], starts[run + 1]))


def test_groups_of_a_box_are_full():
    mesh = sp.shapes.box((1.0, 1.0, 1.0), (8, 8, 8))
    for constraints in (mesh.tets.astype(np.int32), mesh.edges.astype(np.int32)):
        _, counts, _ = independent_groups(constraints, np.array([0, len(constraints)]), len(mesh.vertices), 16, 1024)
        assert counts.mean() > 0.96 * 16


def test_constraints_of_one_vertex_have_a_group_each():
    star = np.array([[0, k] for k in range(1, 151)], dtype=np.int32)
    members, counts, _ = independent_groups(star, np.array([0, 150]), 151, 16, 64)
    assert (counts == 1).all()
    assert sorted(members[:, 0]) == list(range(150))


@pytest.fixture
def two_bodies():
    mesh = sp.shapes.box((1.0, 1.0, 2.0), (5, 5, 10))
    material = sp.EdgesAndVolume()
    rng = np.random.default_rng(3)
    shuffled = rng.permutation(len(mesh.vertices))
    vertices = np.empty_like(mesh.vertices)
    vertices[shuffled] = mesh.vertices
    bodies = [
        sp.Body("plain", mesh, material),
        sp.Body("shuffled", sp.TetMesh(vertices, shuffled[mesh.tets]), material, position=(3, 0, 0)),
    ]
    pin = sp.Pin("shuffled", vertices=[0, 7])
    return build_system(sp.Scene(bodies=bodies, pins=[pin]))


def test_chunks_of_one_parity_share_no_vertex(two_bodies, monkeypatch):
    monkeypatch.setattr(ordering, "SMALLEST_CHUNK", 200)
    layout = make_layout(two_bodies)
    inner = reordered(two_bodies, layout)
    assert layout.n_chunks > 8
    for constraints in (inner.tets, inner.edges):
        order, chunks = layout.sort(constraints)
        assert sorted(order) == list(range(len(constraints)))
        assert (np.diff(chunks) >= 0).all()
        for parity in (0, 1):
            owner = np.full(len(inner.masses), -1)
            for chunk in range(parity, layout.n_chunks, 2):
                vertices = np.unique(constraints[order[chunks == chunk]])
                assert (owner[vertices] == -1).all(), "a vertex in two chunks that run at the same time"
                owner[vertices] = chunk


def test_the_reordered_system_is_the_same_system(two_bodies):
    layout = make_layout(two_bodies)
    inner = reordered(two_bodies, layout)
    old = layout.old_from_new
    np.testing.assert_array_equal(layout.new_from_old[old], np.arange(len(old)))
    for part in two_bodies.bodies:
        assert set(old[part.vertices]) == set(range(part.vertices.start, part.vertices.stop))
    np.testing.assert_array_equal(old[inner.tets], two_bodies.tets)
    np.testing.assert_array_equal(inner.masses, two_bodies.masses[old])
    np.testing.assert_array_equal(old[inner.pinned_vertices], two_bodies.pinned_vertices)
    np.testing.assert_array_equal(inner.pin_targets(0.0), two_bodies.pin_targets(0.0))


def test_the_order_reduces_the_distance_of_neighbours_in_memory(two_bodies):
    inner = reordered(two_bodies, make_layout(two_bodies))
    part = two_bodies.bodies[1]
    assert np.ptp(inner.tets[part.tets], axis=1).mean() < 0.3 * np.ptp(two_bodies.tets[part.tets], axis=1).mean()
