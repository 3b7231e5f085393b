"""Meshes of quadratic tets: nodes, curved sides, validity, files, skins."""

import meshio
import numpy as np
import pytest
from tests.mesh.conftest import the_only_line, write

import supple as sp
from supple.errors import MeshError
from supple.mesh.skin import Embedding
from supple.numerics.quadratic_shape_functions import (
    NODE_COORDINATES,
    NODE_EDGES,
    conical_rule,
    four_point_rule,
    reference_gradients,
    shape_functions,
)


def wavy(mesh, size=0.02):
    """The mesh with curved edges."""
    x = mesh.vertices
    return sp.TetMesh(x + size * np.sin(7.0 * x[:, [1, 2, 0]]), mesh.nodes)


BOX = sp.shapes.box((1.0, 0.5, 0.5), (2, 1, 1), order=2)
WAVY = wavy(BOX)


def test_shape_functions_interpolate_and_their_gradients_are_derivatives():
    np.testing.assert_allclose(shape_functions(NODE_COORDINATES), np.eye(10), atol=1e-15)
    places = np.random.default_rng(0).dirichlet(np.ones(4), 5)
    np.testing.assert_allclose(shape_functions(places).sum(axis=1), 1.0)
    for k in range(3):
        step = np.zeros(4)
        step[0], step[k + 1] = -1e-6, 1e-6
        slope = (shape_functions(places + step) - shape_functions(places - step)) / 2e-6
        np.testing.assert_allclose(reference_gradients(places)[:, :, k], slope, atol=1e-9)


@pytest.mark.parametrize(("rule", "degree"), [(four_point_rule(), 2), (conical_rule(3), 5)])
def test_rules_are_exact_up_to_their_degree(rule, degree):
    places, weights = rule
    for a in range(degree + 1):
        for b in range(degree + 1 - a):
            # The mean of l_1^a l_2^b over a tet is 3! a! b! / (a + b + 3)!.
            factorial = [1.0, 1.0, 2.0, 6.0, 24.0, 120.0, 720.0, 5040.0, 40320.0]
            exact = 6.0 * factorial[a] * factorial[b] / factorial[a + b + 3]
            assert weights @ (places[:, 1] ** a * places[:, 2] ** b) == pytest.approx(exact, rel=1e-12)


def test_to_order_adds_the_middles_of_edges():
    linear = sp.shapes.box((1.0, 0.5, 0.5), (2, 1, 1))
    mesh = linear.to_order(2)
    assert (mesh.order, linear.order) == (2, 1)
    assert repr(mesh) == "TetMesh(vertices: 45, quadratic tets: 12, size: 1 x 0.5 x 0.5 m, volume: 0.25 m^3)"
    np.testing.assert_array_equal(mesh.nodes, BOX.nodes)
    assert len(mesh.vertices) == len(linear.vertices) + len(linear.edges)
    ends = mesh.vertices[mesh.tets[:, NODE_EDGES]].mean(axis=2)
    np.testing.assert_allclose(mesh.vertices[mesh.nodes[:, 4:]], ends)
    np.testing.assert_allclose(mesh.volumes, linear.volumes)
    assert len(mesh.edges) == 2 * len(linear.edges)
    assert mesh.components.count == 1
    back = mesh.to_order(1)
    np.testing.assert_array_equal(back.tets, linear.tets)
    np.testing.assert_array_equal(back.vertices, linear.vertices)
    assert mesh.to_order(2) is mesh
    with pytest.raises(MeshError) as error:
        mesh.to_order(3)
    assert "give 1 for linear tets or 2" in the_only_line(error)


def test_surface_is_a_closed_subdivision_through_all_nodes():
    surface = WAVY.surface
    assert surface.check().ok
    assert len(surface.triangles) == 4 * len(BOX.to_order(1).surface.triangles)
    assert surface.volume == pytest.approx(WAVY.volume, rel=1e-3)


def test_volume_of_curved_tets_is_exact():
    """A quadratic map of a box: its volume is the integral of a polynomial, known in closed form."""
    x = BOX.vertices.copy()
    # x' = x + x^2 / 4 + z y: the determinant is 1 + x / 2, with mean 1.
    x[:, 0] += 0.25 * BOX.vertices[:, 0] ** 2 + BOX.vertices[:, 1] * BOX.vertices[:, 2]
    mesh = sp.TetMesh(x, BOX.nodes)
    assert mesh.volume == pytest.approx(0.25, rel=1e-13)
    assert np.ptp(mesh.volumes) > 0.005


@pytest.mark.parametrize("mirror", [0, 1, 2])
def test_tets_that_are_inside_out_are_turned_with_their_nodes(mirror):
    scale = np.ones(3)
    scale[mirror] = -1.0
    mesh = sp.TetMesh(WAVY.vertices * scale, WAVY.nodes)
    assert mesh.reoriented == len(mesh.tets)
    np.testing.assert_allclose(mesh.volumes, WAVY.volumes, rtol=1e-12)


def test_a_fold_between_nodes_is_found():
    """The determinant is positive at all nodes and quadrature points, and negative between them."""
    nodes = np.arange(10)[None]
    found = False
    rng = np.random.default_rng(3)
    dense = np.concatenate([rng.dirichlet(np.full(4, spread), 1500) for spread in (1.0, 0.2)] + [NODE_COORDINATES])
    for _ in range(200):
        x = NODE_COORDINATES[:, 1:] + rng.normal(size=(10, 3)) * 0.16 * (np.arange(10) > 3)[:, None]
        least = np.linalg.det(np.einsum("ai,qaj->qij", x, reference_gradients(dense))).min()
        at_nodes = np.linalg.det(np.einsum("ai,qaj->qij", x, reference_gradients(NODE_COORDINATES))).min()
        if least < 0.0:
            with pytest.raises(MeshError, match=r"folds over itself|is flat"):
                sp.TetMesh(x, nodes)
            found = found or at_nodes > 0.0
        elif least > 0.05:
            assert sp.TetMesh(x, nodes).volume > 0.0
    assert found


def swapped_middle(nodes):
    other = nodes.copy()
    other[0, 4], other[0, 5] = nodes[0, 5], nodes[0, 4]
    return other


@pytest.mark.parametrize(
    ("nodes", "expected"),
    [
        (swapped_middle(BOX.nodes), "share the edge"),
        (BOX.nodes[:, [4, 5, 6, 7, 0, 1, 2, 3, 8, 9]], "in the middle of an edge"),
        (BOX.nodes[:1, [0, 1, 2, 3, 4, 4, 6, 7, 8, 9]], "with a vertex twice"),
    ],
)
def test_wrong_nodes_are_named(nodes, expected):
    with pytest.raises(MeshError) as error:
        sp.TetMesh.dropping_unused(BOX.vertices, nodes)
    assert expected in the_only_line(error)


@pytest.mark.parametrize("extension", ["msh", "vtu", "vtk", "inp"])
def test_files_keep_all_nodes(tmp_path, extension):
    path = tmp_path / f"mesh.{extension}"
    WAVY.save(path)
    again = sp.TetMesh.load(path)
    np.testing.assert_array_equal(again.nodes, WAVY.nodes)
    np.testing.assert_array_equal(again.vertices, WAVY.vertices)
    if extension != "vtk":
        # Another program's reader, which knows the node orders of Gmsh, VTK and Abaqus.
        (block,) = meshio.read(path).cells
        assert block.type == "tetra10"
        np.testing.assert_array_equal(block.data, WAVY.nodes)


@pytest.mark.parametrize("extension", ["msh", "vtu", "inp"])
def test_files_of_another_program_are_read(tmp_path, extension):
    path = tmp_path / f"mesh.{extension}"
    mesh = meshio.Mesh(WAVY.vertices, [("tetra10", WAVY.nodes)])
    meshio.write(path, mesh, file_format={"msh": "gmsh"}.get(extension))
    np.testing.assert_array_equal(sp.TetMesh.load(path).nodes, WAVY.nodes)


def test_gmsh_exchanges_the_last_two_nodes(tmp_path):
    """A text file with the coordinates of the manual's order: node 8 on the edge 2-3, node 9 on the edge 1-3."""
    corners = np.vstack([np.zeros(3), np.eye(3)])
    edges = [(0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3)]
    points = np.concatenate([corners, [corners[list(e)].mean(axis=0) for e in edges]])
    lines = "\n".join(f"{k + 1} {x} {y} {z}" for k, (x, y, z) in enumerate(points))
    text = (
        f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n10\n{lines}\n$EndNodes\n$Elements\n2\n"
        "1 9 2 0 0 1 2 3 5 6 7\n2 11 2 0 0 1 2 3 4 5 6 7 8 9 10\n$EndElements\n"
    )
    mesh = sp.TetMesh.load(write(tmp_path / "a.msh", text))
    assert mesh.volume == pytest.approx(1.0 / 6.0)
    np.testing.assert_allclose(mesh.vertices[mesh.nodes[0, 4:]], mesh.vertices[mesh.nodes[0][NODE_EDGES]].mean(axis=1))


INP = """*HEADING
** a comment
*NODE, NSET=all
7, 0, 0, 0
1, 1, 0, 0
2, 0, 1, 0
3, 0, 0, 1
, ,
*Element, type=S3
1, 7, 1, 2
*ELEMENT, TYPE=C3D4H, ELSET=E
2, 7, 1,
2, 3
*MATERIAL, NAME=rubber
*ELASTIC
1., .3
"""


def test_abaqus_files(tmp_path):
    mesh = sp.TetMesh.load(write(tmp_path / "a.inp", INP))
    assert mesh.volume == pytest.approx(1.0 / 6.0)
    for text, expected in (
        (INP.replace("C3D4H", "C3D7"), "elements of type C3D7 cannot be read"),
        (INP.replace("2, 7, 1,\n2, 3", "2, 7, 1, 2, 9"), "node 9 is used, and does not exist"),
        (INP.replace("2, 7, 1,\n2, 3", "2, 7, 1, 2"), "do not have a number and 4 nodes each"),
        (INP.replace("1, 1, 0, 0", "7, 1, 0, 0"), "node 1 is used, and does not exist"),
        (INP.replace("1, 1, 0, 0", "1, 1, zero, 0"), "not 3 numbers"),
    ):
        with pytest.raises(MeshError) as error:
            sp.TetMesh.load(write(tmp_path / "b.inp", text))
        assert expected in the_only_line(error)


def test_of_both_kinds_in_one_file_the_corners_are_used(tmp_path, caplog):
    mesh = meshio.Mesh(BOX.vertices, [("tetra", BOX.tets[:2]), ("tetra10", BOX.nodes[2:])])
    meshio.write(tmp_path / "a.vtu", mesh)
    loaded = sp.TetMesh.load(tmp_path / "a.vtu")
    assert (loaded.order, len(loaded.tets)) == (1, len(BOX.tets))
    assert loaded.volume == pytest.approx(BOX.volume)
    assert f"of {len(BOX.tets) - 2} quadratic tetrahedra, only the corners are used" in caplog.text


def test_tetgen_files_are_refused(tmp_path):
    with pytest.raises(MeshError) as error:
        BOX.save(tmp_path / "a.1.ele")
    assert "to_order(1)" in the_only_line(error)


@pytest.mark.parametrize(
    ("make", "volume"),
    [
        (lambda order: sp.shapes.sphere(0.5, 0.2, order), 4 / 3 * np.pi * 0.5**3),
        (lambda order: sp.shapes.cylinder(0.5, 1.0, 0.25, order), np.pi * 0.25),
        (lambda order: sp.shapes.spherical_shell(0.3, 0.5, 0.1, order), 4 / 3 * np.pi * (0.5**3 - 0.3**3)),
        (lambda order: sp.shapes.torus(0.5, 0.2, 0.15, order), 2 * np.pi**2 * 0.5 * 0.04),
    ],
)
def test_shapes_have_curved_sides(make, volume):
    linear, curved = make(1), make(2)
    assert abs(curved.volume - volume) < 0.1 * abs(linear.volume - volume)
    assert curved.volume == pytest.approx(volume, rel=1e-2)


def test_points_follow_curved_tets():
    """A quadratic motion of a curved mesh is reproduced at points inside it."""
    rng = np.random.default_rng(1)
    tet = rng.integers(len(WAVY.tets), size=40)
    weights = shape_functions(rng.dirichlet(np.ones(4), 40))
    points = np.einsum("ka,kai->ki", weights, WAVY.vertices[WAVY.nodes[tet]])
    held = Embedding.of(WAVY, points)
    np.testing.assert_allclose(held.apply(WAVY.vertices), points, atol=1e-12)
    moved = WAVY.vertices + rng.normal(size=WAVY.vertices.shape)
    inside = ~held.outside & (held.tets == tet)
    assert inside.sum() > 30
    expected = np.einsum("ka,kai->ki", weights, moved[WAVY.nodes[tet]])
    np.testing.assert_allclose(held.apply(moved)[inside], expected[inside], atol=1e-9)
