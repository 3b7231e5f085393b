"""Hexahedra, wedges, pyramids and voxels become tets that fit each other, with the same volume."""

import itertools

import meshio
import numpy as np
import pytest

import supple as sp
from supple.errors import MeshError
from supple.mesh.io.cells import (
    HEXAGONAL_PRISM,
    HEXAHEDRON,
    KINDS,
    PENTAGONAL_PRISM,
    PYRAMID,
    TETRA,
    VOXEL,
    WEDGE,
    CellSoup,
    checked,
)
from supple.mesh.io.splitting import tets_of
from supple.mesh.topology import TET_FACETS, facet_keys

RANDOM = np.random.default_rng(7)
HEX = np.array(list(itertools.product((0, 1), repeat=3)))[[0, 4, 6, 2, 1, 5, 7, 3]]  # in the order of VTK


def grid(n):
    """Points of n^3 cubes, and their corners (n^3, 8) in the order of VTK's hexahedra."""
    points = np.array(list(itertools.product(range(n + 1), repeat=3)), dtype=np.float64)
    start = np.array(list(itertools.product(range(n), repeat=3)))
    return points, (start[:, None] + HEX) @ np.array([(n + 1) ** 2, n + 1, 1])


def soup_of(points, **blocks):
    made = [(number, np.full(len(rows), rows.shape[1]), rows.ravel()) for number, rows in blocks.values()]
    return checked(CellSoup.of_blocks(points, made))


def renumbered(points, *blocks, random=RANDOM):
    """The same cells with vertices in a random order."""
    order = random.permutation(len(points))
    place = np.argsort(order)
    return points[order], [(number, place[rows]) for number, rows in blocks]


def assert_fills(points, blocks, volume):
    """All facets inside are of two tets, and the whole is as large as the cells."""
    result = tets_of(soup_of(points, **{str(k): block for k, block in enumerate(blocks)}))
    mesh = sp.TetMesh.dropping_unused(result.points, result.tets)
    assert mesh.reoriented == 0
    assert mesh.volume == pytest.approx(volume, rel=1e-12)
    keys = np.concatenate([facet_keys(mesh.tets[:, facet], len(mesh.vertices)) for facet in TET_FACETS])
    _, counts = np.unique(keys, return_counts=True)
    assert counts.max() <= 2
    boundary = mesh.surface.triangles
    assert sp.SurfaceMesh(mesh.vertices, boundary, shares_vertices=True).check().watertight
    return mesh, result


def outside(mesh, n):
    """Whether all vertices of the surface are on the sides of the cube."""
    points = mesh.vertices[mesh.surface.used_vertices]
    return bool(((points < 1e-9) | (points > n - 1e-9)).any(axis=1).all())


@pytest.mark.parametrize("trial", range(5))
def test_random_numbers_of_cubes(trial):
    points, rows = grid(4)
    points, blocks = renumbered(points, (HEXAHEDRON, rows))
    mesh, result = assert_fills(points, blocks, 64.0)
    assert outside(mesh, 4)
    assert len(mesh.tets) == 6 * 64
    assert np.array_equal(np.bincount(result.cells), np.full(64, 6))
    assert result.notes == ["64 hexahedra were split into 384 tets"]


@pytest.mark.parametrize("trial", range(5))
def test_cubes_of_all_kinds_of_cells_side_by_side(trial):
    """Each cube is a hexahedron, a voxel, or six pyramids about its middle."""
    points, rows = grid(3)
    kinds = RANDOM.integers(0, 3, len(rows))
    hexes = [rows[kinds == 0]]
    pyramids, middles = [], []
    for row in rows[kinds == 1]:
        middle = len(points) + len(middles)
        middles.append(points[row].mean(axis=0))
        faces = row[[[3, 2, 1, 0], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]]
        pyramids.append(np.column_stack([faces[:, ::-1], np.full(6, middle)]))
    voxels = rows[kinds == 2][:, [0, 1, 3, 2, 4, 5, 7, 6]]
    points = np.vstack([points, np.array(middles).reshape(-1, 3)])
    blocks = [(HEXAHEDRON, np.concatenate(hexes)), (VOXEL, voxels), (PYRAMID, np.concatenate(pyramids))]
    points, blocks = renumbered(points, *blocks)
    mesh, _ = assert_fills(points, blocks, 27.0)
    assert outside(mesh, 3)


@pytest.mark.parametrize("turned", [False, True], ids=["as Abaqus", "as VTK"])
def test_columns_of_wedges(turned):
    """Both orders of a wedge's triangles are in use."""
    points, rows = grid(3)
    wedges = np.concatenate([rows[:, [0, 1, 2, 4, 5, 6]], rows[:, [0, 2, 3, 4, 6, 7]]])
    if turned:
        wedges = wedges[:, [0, 2, 1, 3, 5, 4]]
    points, blocks = renumbered(points, (WEDGE, wedges))
    mesh, result = assert_fills(points, blocks, 27.0)
    assert len(mesh.tets) == 3 * 54
    assert outside(mesh, 3)
    assert result.notes == ["54 wedges were split into 162 tets"]


@pytest.mark.parametrize(("number", "n"), [(PENTAGONAL_PRISM, 5), (HEXAGONAL_PRISM, 6)])
def test_stacked_prisms(number, n):
    angle = 2.0 * np.pi * np.arange(n) / n
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    points = np.concatenate([ring + np.array([0.0, 0.0, z]) for z in range(4)])
    rows = np.arange(2 * n) + n * np.arange(3)[:, None]
    points, blocks = renumbered(points, (number, rows))
    assert_fills(points, blocks, 3.0 * 0.5 * n * np.sin(2.0 * np.pi / n))


def test_warped_cubes_get_a_vertex_inside():
    """Where a tet from the vertex of the smallest number would be turned inside out, neighbours still fit."""
    random = np.random.default_rng(5)
    points, rows = grid(4)
    inner = ((points > 0.5) & (points < 3.5)).all(axis=1)
    points[inner] += random.uniform(-0.3, 0.3, (int(inner.sum()), 3))
    points, blocks = renumbered(points, (HEXAHEDRON, rows), random=random)
    mesh, result = assert_fills(points, blocks, 64.0)
    assert len(result.points) == len(points) + 1
    assert len(mesh.tets) == 63 * 6 + 12
    assert result.notes == ["64 hexahedra were split into 390 tets, with 1 new vertex in the middle of a warped one"]


def test_a_cube_with_corners_that_are_one_is_a_wedge():
    """Of old decks: two pairs of corners have the same number."""
    points, rows = grid(1)
    mesh, _ = assert_fills(points, [(HEXAHEDRON, rows[:, [0, 1, 2, 2, 4, 5, 6, 6]])], 0.5)
    assert len(mesh.tets) == 3


def test_a_cube_that_folds_over_itself_is_refused(tmp_path):
    points, rows = grid(1)
    rows = rows[:, [1, 0, 2, 3, 4, 5, 6, 7]]
    with pytest.raises(MeshError, match=r"cell 0 \(counted from 0\) is a hexahedron that is flat or folds over itself"):
        load(tmp_path / "a.vtu", points, [("hexahedron", rows)])


def load(path, points, cells, **more):
    meshio.write(path, meshio.Mesh(points, cells, **more), file_format="gmsh" if path.suffix == ".msh" else None)
    return sp.TetMesh.load(path)


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        (name, kind)
        for name in ("a.vtu", "a.vtk", "a.msh", "a.inp", "a.mesh")
        for kind in ("hexahedron", "wedge", "pyramid")
        if (name, kind) != ("a.inp", "pyramid")  # which meshio does not write
    ],
)
def test_files_of_each_format(tmp_path, name, kind, caplog):
    points, rows = grid(2)
    volume = 8.0
    if kind == "wedge":
        rows = np.concatenate([rows[:, [0, 1, 2, 4, 5, 6]], rows[:, [0, 2, 3, 4, 6, 7]]])
    if kind == "pyramid":
        rows, volume = np.column_stack([rows[:, :4], rows[:, 6]]), 8.0 / 3.0
    mesh = load(tmp_path / name, points, [(kind, rows)])
    assert mesh.volume == pytest.approx(volume)
    tets = {"hexahedron": 6, "wedge": 3, "pyramid": 2}[kind] * len(rows)
    assert (
        f"{name}: {len(rows)} {KINDS[{'hexahedron': 12, 'wedge': 13, 'pyramid': 14}[kind]].plural} were split"
        in caplog.text
    )
    assert len(mesh.tets) == tets


@pytest.mark.parametrize("name", ["a.vtu", "a.vtk", "a.msh", "a.inp"])
def test_quadratic_bricks_are_split_by_their_corners(tmp_path, name, caplog):
    points, rows = grid(2)
    ends = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    pairs = np.sort(rows[:, ends], axis=2).reshape(-1, 2)
    edges, which = np.unique(pairs, axis=0, return_inverse=True)
    middles = len(points) + which.reshape(len(rows), 12)
    every = np.vstack([points, points[edges].mean(axis=1)])
    mesh = load(tmp_path / name, every, [("hexahedron20", np.hstack([rows, middles]))])
    assert (mesh.order, len(mesh.tets), len(mesh.vertices)) == (1, 48, 27)
    assert mesh.volume == pytest.approx(8.0)
    assert "8 quadratic hexahedra were split by their corners into 48 tets" in caplog.text


def test_sets_are_those_of_the_cells(tmp_path):
    """Beside tets that stay as they are, in the order of the file."""
    points, rows = grid(2)
    left = np.flatnonzero(points[rows].mean(axis=1)[:, 0] < 1.0)
    text = "*NODE\n" + "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate(points, start=1))
    text += "*ELEMENT, TYPE=C3D8R, ELSET=all\n" + "".join(
        f"{k}, {', '.join(str(i + 1) for i in row)}\n" for k, row in enumerate(rows, start=1)
    )
    text += "*ELSET, ELSET=left\n" + ", ".join(str(k + 1) for k in left) + "\n"
    text += "*NSET, NSET=wall\n" + ", ".join(str(k + 1) for k in np.flatnonzero(points[:, 0] == 0)) + "\n"
    (tmp_path / "a.inp").write_text(text)
    mesh = sp.TetMesh.load(tmp_path / "a.inp")
    centers = mesh.vertices[mesh.tets].mean(axis=1)
    np.testing.assert_array_equal(mesh.sets.tets_of("left"), np.flatnonzero(centers[:, 0] < 1.0))
    assert len(mesh.sets.tets_of("all")) == len(mesh.tets) == 48
    np.testing.assert_array_equal(mesh.sets.vertices_of("wall"), np.flatnonzero(mesh.vertices[:, 0] == 0.0))


def test_tets_among_others_keep_their_place():
    points, rows = grid(1)
    points = np.vstack([points, [[2.0, 0.5, 0.5]]])
    soup = soup_of(points, a=(PYRAMID, np.array([[*rows[0][[1, 2, 6, 5]], 8]])), b=(TETRA, rows[:, [0, 1, 2, 6]]))
    result = tets_of(soup)
    assert result.cells.tolist() == [0, 0, 1]
    assert result.notes == ["1 pyramid was split into 2 tets"]
