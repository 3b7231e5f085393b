"""Embedding fine points in coarse tets."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from supple.errors import MeshError
from supple.mesh import shapes
from supple.mesh.skin import Embedding
from supple.mesh.tetmesh import TetMesh

BALL = shapes.sphere(0.5, 0.2)


def test_rest_positions_are_reproduced():
    points = np.random.default_rng(0).uniform(-0.7, 0.7, (2000, 3))
    embedding = Embedding.of(BALL, points)
    assert np.abs(embedding.apply(BALL.vertices) - points).max() < 1e-12
    assert np.abs(embedding.weights.sum(axis=1) - 1).max() < 1e-12
    assert np.array_equal(embedding.corners, BALL.tets[embedding.tets])
    outside = np.linalg.norm(points, axis=1) > 0.5
    assert embedding.outside[outside].all()
    assert not embedding.outside[np.linalg.norm(points, axis=1) < 0.46].any()


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_affine_motions_are_exact(seed):
    generator = np.random.default_rng(seed)
    points = generator.uniform(-0.6, 0.6, (50, 3))
    linear, shift = generator.normal(size=(3, 3)), generator.normal(size=3)
    moved = Embedding.of(BALL, points).apply(BALL.vertices @ linear.T + shift)
    assert np.abs(moved - points @ linear.T - shift).max() < 1e-12


def test_inside_points_lie_in_their_tet():
    generator = np.random.default_rng(1)
    inside = np.einsum("ij,ijk->ik", generator.dirichlet(np.ones(4), len(BALL.tets)), BALL.vertices[BALL.tets])
    embedding = Embedding.of(BALL, inside)
    assert not embedding.outside.any()
    assert np.array_equal(embedding.tets, np.arange(len(BALL.tets)))


def test_every_inside_point_is_found_where_tets_differ_much_in_size():
    generator = np.random.default_rng(2)
    cloud = generator.normal(size=(800, 3)) * generator.uniform(0, 1, (800, 1)) ** 4
    mesh = TetMesh.dropping_unused(cloud, Delaunay(cloud).simplices)
    points = np.einsum("ij,ijk->ik", generator.dirichlet(np.ones(4), len(mesh.tets)), mesh.vertices[mesh.tets])
    embedding = Embedding.of(mesh, points)
    assert not embedding.outside.any()
    assert (embedding.tets == np.arange(len(mesh.tets))).mean() > 0.99  # the rest lie on facets, to round-off


def test_points_outside_follow_a_tet_nearby():
    directions = np.random.default_rng(3).normal(size=(500, 3))
    points = 0.53 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    embedding = Embedding.of(BALL, points)
    centers = BALL.vertices[embedding.corners].mean(axis=1)
    assert np.linalg.norm(centers - points, axis=1).max() < 0.25  # edges are 0.2
    assert embedding.weights.min() > -1.5
    # A local displacement of the mesh moves only points near it.
    bumped = BALL.vertices.copy()
    bumped[np.argmax(bumped[:, 0])] += (0.1, 0, 0)
    moved = np.linalg.norm(embedding.apply(bumped) - points, axis=1)
    assert moved[points[:, 0] < 0].max() < 1e-12


def test_one_tet_and_one_point():
    mesh = TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])
    embedding = Embedding.of(mesh, [[0.25, 0.25, 0.25]])
    assert embedding.weights[0].tolist() == pytest.approx([0.25] * 4)
    assert Embedding.of(mesh, [[5.0, 0, 0]]).outside.tolist() == [True]


def test_the_surface_of_a_bear_follows_its_tets():
    bear, skin = shapes.gummy_bear(1.0, 0.1), shapes.gummy_bear_surface(1.0, 24)
    embedding = Embedding.of(bear, skin.vertices)
    twisted = bear.vertices.copy()
    twisted[:, 1] *= 0.7
    twisted[:, 0] += 0.1 * np.sin(3 * bear.vertices[:, 1])
    expected = skin.vertices.copy()
    expected[:, 0] += 0.1 * np.sin(3 * expected[:, 1])
    expected[:, 1] *= 0.7
    assert np.abs(embedding.apply(twisted) - expected).max() < 0.01


@pytest.mark.parametrize("points", [np.zeros((2, 2)), [[0, 0, np.nan]], np.empty((0, 3)), "bear"])
def test_bad_points_are_errors(points):
    with pytest.raises(MeshError, match="Embedding"):
        Embedding.of(BALL, points)


def test_positions_of_another_mesh_are_errors():
    embedding = Embedding.of(BALL, [[0, 0, 0]])
    with pytest.raises(MeshError, match="must have shape"):
        embedding.apply(BALL.vertices[:-1])
