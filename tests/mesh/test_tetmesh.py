"""TetMesh: normalization, errors, and derived quantities."""

import logging

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from supple.errors import MeshError
from supple.mesh import shapes
from supple.mesh.tetmesh import TetMesh

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])
TWO = [[0, 1, 2, 3], [1, 2, 3, 4]]
REGULAR = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])


def determinants(mesh):
    x = mesh.vertices[mesh.tets]
    return np.linalg.det(x[:, 1:] - x[:, :1])


def test_two_tets():
    mesh = TetMesh(CORNERS, TWO)
    assert mesh.reoriented == 0
    assert mesh.volumes.tolist() == pytest.approx([1 / 6, 1 / 3])
    assert mesh.volume == pytest.approx(0.5)
    assert mesh.adjacency.tolist() == [[1, -1, -1, -1], [-1, -1, -1, 0]]
    assert len(mesh.edges) == 9
    assert mesh.edges.tolist() == sorted(mesh.edges.tolist())
    assert len(mesh.surface.triangles) == 6
    assert mesh.surface.volume == pytest.approx(0.5)
    assert mesh.components.count == 1


def test_winding_is_normalized_and_counted():
    tets = np.array(TWO)
    tets[1] = tets[1][[1, 0, 2, 3]]
    mesh = TetMesh(CORNERS, tets)
    assert mesh.reoriented == 1
    assert (determinants(mesh) > 0).all()
    assert mesh.surface.volume == pytest.approx(0.5)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(1e-9, 1e6))
def test_any_corner_order_of_a_grid_gives_the_same_body(seed, scale):
    generator = np.random.default_rng(seed)
    grid = shapes.box((1.0, 2.0, 1.5), (2, 1, 2))
    tets = np.array([generator.permutation(t) for t in grid.tets])
    rename = generator.permutation(len(grid.vertices))
    vertices = np.empty_like(grid.vertices)
    vertices[rename] = grid.vertices * scale
    mesh = TetMesh(vertices, rename[tets])
    assert (determinants(mesh) > 0).all()
    assert mesh.volume == pytest.approx(3.0 * scale**3)
    assert mesh.surface.volume == pytest.approx(3.0 * scale**3)
    assert mesh.surface.check().ok
    assert len(mesh.edges) == len(grid.edges)
    assert len(mesh.surface.triangles) == len(grid.surface.triangles)


def test_adjacency_is_mutual_and_across_the_opposite_facet():
    mesh = shapes.sphere(1.0, 0.4)
    for t, row in enumerate(mesh.adjacency):
        for k, other in enumerate(row):
            if other >= 0:
                facet = set(mesh.tets[t]) - {mesh.tets[t, k]}
                assert facet < set(mesh.tets[other])
                assert t in mesh.adjacency[other]
    boundary = np.count_nonzero(mesh.adjacency < 0)
    assert boundary == len(mesh.surface.triangles)
    assert (4 * len(mesh.tets) - boundary) % 2 == 0


def test_surface_faces_outward_and_indexes_into_the_mesh():
    mesh = shapes.sphere(1.0, 0.5)
    surface = mesh.surface
    assert len(surface.vertices) == len(mesh.vertices)
    centers = surface.vertices[surface.triangles].mean(axis=1)
    assert (np.einsum("ij,ij->i", centers, surface.area_vectors) > 0).all()
    assert surface.volume == pytest.approx(mesh.volume)


def test_rest_shape_inverse_inverts_the_rest_shape():
    mesh = shapes.torus(1.0, 0.4, 0.3)
    x = mesh.vertices[mesh.tets]
    rest_shape = (x[:, 1:] - x[:, :1]).transpose(0, 2, 1)
    assert np.abs(mesh.rest_shape_inverse @ rest_shape - np.eye(3)).max() < 1e-12


def test_quality_measures_of_known_tets():
    regular = TetMesh(REGULAR, [[0, 1, 2, 3]])
    assert regular.min_dihedrals[0] == pytest.approx(np.degrees(np.arccos(1 / 3)))
    assert regular.radius_ratios[0] == pytest.approx(1)
    corner = TetMesh(CORNERS[:4], [[0, 1, 2, 3]])
    assert corner.min_dihedrals[0] == pytest.approx(np.degrees(np.arccos(1 / np.sqrt(3))))
    inscribed, circumscribed = 1 / (3 + np.sqrt(3)), np.sqrt(3) / 2
    assert corner.radius_ratios[0] == pytest.approx(3 * inscribed / circumscribed)
    sliver = TetMesh([[0, 0, 0], [1, 1, 0.001], [1, 0, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    assert sliver.min_dihedrals[0] < 0.2
    assert sliver.radius_ratios[0] < 0.01


def test_components_are_counted_over_shared_vertices():
    apart = TetMesh(np.vstack([REGULAR, REGULAR + 9]), [[0, 1, 2, 3], [4, 5, 6, 7]])
    assert apart.components.count == 2
    assert apart.components.labels.tolist() == [0, 1]
    assert shapes.box(divisions=(2, 2, 2)).components.count == 1


def test_arrays_are_read_only():
    mesh = TetMesh(CORNERS, TWO)
    for array in (mesh.vertices, mesh.tets, mesh.edges, mesh.volumes, mesh.adjacency, mesh.rest_shape_inverse):
        with pytest.raises(ValueError):
            array[0] = 0
    assert mesh.tets.dtype == np.int32
    assert mesh.edges.dtype == np.int32
    assert mesh.adjacency.dtype == np.int32


def test_unused_vertices_can_be_dropped(caplog):
    vertices = np.insert(CORNERS, 2, [[7, 7, 7]], axis=0)
    tets = np.where(np.array(TWO) >= 2, np.array(TWO) + 1, TWO)
    with pytest.raises(MeshError, match=r"vertex 2 at \(7, 7, 7\) belongs to no tet.*dropping_unused"):
        TetMesh(vertices, tets)
    with caplog.at_level(logging.WARNING):
        mesh = TetMesh.dropping_unused(vertices, tets)
    assert "dropped 1 of 6 vertices" in caplog.text
    assert np.array_equal(mesh.vertices, CORNERS)
    assert mesh.tets.tolist() == TWO
    assert len(TetMesh.dropping_unused(CORNERS, TWO).vertices) == 5


def test_transformed_body():
    mesh = TetMesh(CORNERS, TWO)
    assert mesh.transformed(scale=2.0, translation=(1, 2, 3)).volume == pytest.approx(4.0)
    mirrored = mesh.transformed(scale=(-1, 1, 1))
    assert mirrored.reoriented == 2
    assert mirrored.volume == pytest.approx(0.5)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e3])
def test_thin_tets_are_errors_only_below_round_off(scale):
    def tet(thickness):
        return np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, thickness]]) * scale

    assert TetMesh(tet(1e-12), [[0, 1, 2, 3]]).volume > 0
    with pytest.raises(MeshError, match=r"tet 0 .* is flat"):
        TetMesh(tet(1e-15), [[0, 1, 2, 3]])
    # Far from the origin the same thickness is below the round-off of the coordinates.
    with pytest.raises(MeshError, match="flat"):
        TetMesh(tet(1e-12) + 1e3 * scale, [[0, 1, 2, 3]])


@pytest.mark.parametrize(
    ("vertices", "tets", "words"),
    [
        (np.empty((0, 3)), TWO, "vertices are missing"),
        (CORNERS, [], "tets are missing"),
        (CORNERS[:, :2], TWO, r"\(n, 3\)"),
        (CORNERS, [[0, 1, 2]], r"\(m, 4\)"),
        (CORNERS, np.array(TWO, dtype=float), "integers"),
        (CORNERS, [[0, 1, 2, 5], [1, 2, 3, 4]], "tet 0 .*0 to 4"),
        (CORNERS, [[0, 1, 2, 3], [-1, 2, 3, 4]], "tet 1 .*0 to 4"),
        (CORNERS, np.array(TWO) + 1, "1-based"),
        (np.where(CORNERS == 1, np.nan, CORNERS), TWO, "vertex 1 .*not finite"),
        (CORNERS, [[0, 1, 2, 3], [1, 2, 3, 3]], "tet 1 .*twice"),
        (CORNERS, [*TWO, [2, 1, 3, 0]], "tet 2 .*same four vertices as tet 0"),
        (CORNERS, [TWO[0]], "vertex 4 .*belongs to no tet"),
        (np.vstack([CORNERS[:3], [[0.5, 0.2, 0]]]), [[0, 1, 2, 3]], "tet 0 .*flat"),
        (np.zeros((4, 3)), [[0, 1, 2, 3]], "flat"),
        (np.vstack([CORNERS, [[2, 2, 2]]]), [*TWO, [1, 2, 3, 5]], r"tets 0, 1 and 2 all share the facet \[1, 2, 3\]"),
    ],
)
def test_malformed_meshes_are_errors_of_one_line(vertices, tets, words):
    with pytest.raises(MeshError, match=words):
        TetMesh(vertices, tets)


def test_packed_keys_also_work_beyond_two_million_vertices():
    # Three indices of a facet do not fit into 63 bits there, so the keys are made in another way.
    from supple.mesh.topology import facet_keys

    n = 3_000_000
    triangles = np.array([[0, 1, n - 1], [n - 1, 0, 1], [0, n - 1, n - 2], [1, n - 2, n - 1]], dtype=np.int32)
    keys = facet_keys(triangles, n)
    assert keys[0] == keys[1]
    assert len(set(keys.tolist())) == 3
