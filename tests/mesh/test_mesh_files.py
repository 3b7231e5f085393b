"""Mesh files: round trips, other programs' files, and what loading corrects."""

import logging
import struct

import meshio
import numpy as np
import pytest

from supple.errors import MeshError
from supple.mesh import shapes
from supple.mesh.io.mesh_files import SURFACE_WRITERS
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh

from .conftest import BALL, BODY, write

# Round trips


@pytest.mark.parametrize("extension", sorted(SURFACE_WRITERS))
def test_surface_round_trip(tmp_path, extension):
    path = tmp_path / f"ball{extension}"
    BALL.save(path)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]  # no temporary file is left
    loaded = SurfaceMesh.load(str(path))
    assert len(loaded.vertices) == len(BALL.vertices)
    assert len(loaded.triangles) == len(BALL.triangles)
    assert loaded.check().ok
    if extension == ".stl":  # single precision, and vertices in the order of triangles
        assert loaded.volume == pytest.approx(BALL.volume, rel=1e-5)
    else:
        assert np.array_equal(loaded.vertices, BALL.vertices)
        assert np.array_equal(loaded.triangles, BALL.triangles)


@pytest.mark.parametrize("name", ["a.msh", "a.vtu", "a.vtk", "a.node", "a.ele", "A.MSH"])
def test_tet_mesh_round_trip(tmp_path, name):
    path = tmp_path / name
    BODY.save(path)
    loaded = TetMesh.load(path)
    assert np.array_equal(loaded.vertices, BODY.vertices)
    assert np.array_equal(loaded.tets, BODY.tets)


def test_saving_the_surface_of_a_tet_mesh_leaves_inner_vertices_out(tmp_path):
    mesh = shapes.sphere(0.5, 0.25)
    mesh.surface.save(tmp_path / "skin.ply")
    assert len(SurfaceMesh.load(tmp_path / "skin.ply").vertices) == len(mesh.surface.used_vertices)


# Files of other programs


@pytest.mark.parametrize("kind", ["gmsh", "gmsh22", "vtk42", "vtk51", "vtu"])
@pytest.mark.parametrize("binary", [True, False])
def test_tets_written_by_meshio(tmp_path, kind, binary):
    path = tmp_path / f"a.{ {'g': 'msh', 'v': kind[:3]}[kind[0]] }"
    meshio.write(path, meshio.Mesh(BODY.vertices, [("tetra", BODY.tets)]), file_format=kind, binary=binary)
    loaded = TetMesh.load(path)
    assert np.array_equal(loaded.tets, BODY.tets)
    assert np.allclose(loaded.vertices, BODY.vertices, atol=1e-15)


@pytest.mark.parametrize("binary", [True, False])
def test_msh_4_0_written_by_meshio(tmp_path, binary):
    mesh = meshio.Mesh(BODY.vertices, [("tetra", BODY.tets)])
    meshio.gmsh.write(tmp_path / "a.msh", mesh, fmt_version="4.0", binary=binary)
    assert np.array_equal(TetMesh.load(tmp_path / "a.msh").tets, BODY.tets)


def test_msh_with_scattered_tags_and_other_elements(tmp_path):
    text = (
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
        "$Nodes\n2 5 7 40000\n2 1 0 2\n9\n40000\n0 0 0\n1 0 0\n"
        "3 1 0 3\n7\n8\n1000\n0 1 0\n0 0 1\n1 1 1\n$EndNodes\n"
        "$Elements\n3 3 1 9\n0 1 15 1\n1 9\n2 1 2 1\n5 9 7 8\n"
        "3 1 4 2\n6 9 40000 7 8\n9 40000 8 7 1000\n$EndElements\n"
    )
    loaded = TetMesh.load(write(tmp_path / "a.msh", text))
    assert loaded.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
    assert loaded.volume == pytest.approx(0.5)
    parametric = text.replace("2 1 0 2", "2 1 1 2").replace("0 0 0\n1 0 0", "0 0 0 0.5 0.5\n1 0 0 0.5 0.5")
    with pytest.raises(MeshError, match="meshio cannot read: ReadError: parametric nodes not implemented"):
        TetMesh.load(write(tmp_path / "b.msh", parametric))


@pytest.mark.parametrize("extension", ["stl", "obj", "ply", "off", "vtu", "vtk"])
def test_surfaces_written_by_meshio(tmp_path, extension):
    path = tmp_path / f"a.{extension}"
    meshio.write(path, meshio.Mesh(BALL.vertices, [("triangle", BALL.triangles)]))
    loaded = SurfaceMesh.load(path)
    assert loaded.check().ok
    assert loaded.volume == pytest.approx(BALL.volume, rel=1e-5)


@pytest.mark.parametrize("mode", ["ascii", "binary", "appended raw", "appended base64"])
@pytest.mark.parametrize("compressor", ["None", "ZLib", "LZMA"])
def test_vtp_written_by_vtk(tmp_path, mode, compressor):
    vtk = pytest.importorskip("vtk")
    source = vtk.vtkSphereSource()
    writer = vtk.vtkXMLPolyDataWriter()
    writer.SetInputConnection(source.GetOutputPort())
    writer.SetDataMode(["ascii", "binary", "appended"].index(mode.split()[0]))
    writer.SetEncodeAppendedData(mode.endswith("base64"))
    getattr(writer, f"SetCompressorTypeTo{compressor}")()
    writer.SetBlockSize(256)
    if compressor == "LZMA":
        writer.SetHeaderTypeToUInt64()
    writer.SetFileName(str(tmp_path / "a.vtp"))
    writer.Write()
    loaded = SurfaceMesh.load(tmp_path / "a.vtp")
    assert len(loaded.vertices) == 50
    assert loaded.check().ok


@pytest.mark.parametrize("version", [42, 51])
@pytest.mark.parametrize("file_type", [1, 2])
@pytest.mark.parametrize("strips", [False, True])
def test_legacy_polydata_written_by_vtk(tmp_path, version, file_type, strips):
    vtk = pytest.importorskip("vtk")
    source, stripper, writer = vtk.vtkSphereSource(), vtk.vtkStripper(), vtk.vtkPolyDataWriter()
    stripper.SetInputConnection(source.GetOutputPort())
    writer.SetInputConnection((stripper if strips else source).GetOutputPort())
    writer.SetFileVersion(version)
    writer.SetFileType(file_type)
    writer.SetFileName(str(tmp_path / "a.vtk"))
    writer.Write()
    loaded = SurfaceMesh.load(tmp_path / "a.vtk")
    assert len(loaded.triangles) == 96
    assert loaded.check().ok


def test_vtk_reads_saved_files(tmp_path):
    vtk = pytest.importorskip("vtk")
    BALL.save(tmp_path / "a.vtp")
    BODY.save(tmp_path / "a.vtu")
    BODY.save(tmp_path / "a.vtk")
    for reader, name, count in (
        (vtk.vtkXMLPolyDataReader(), "a.vtp", len(BALL.triangles)),
        (vtk.vtkXMLUnstructuredGridReader(), "a.vtu", len(BODY.tets)),
        (vtk.vtkUnstructuredGridReader(), "a.vtk", len(BODY.tets)),
    ):
        reader.SetFileName(str(tmp_path / name))
        reader.Update()
        assert reader.GetOutput().GetNumberOfCells() == count


def test_text_stl(tmp_path):
    lines = ["solid ball"]
    for corners in BALL.vertices[BALL.triangles]:
        lines += ["facet normal 0 0 0", " outer loop", *(f"  vertex {x!r} {y!r} {z!r}" for x, y, z in corners.tolist())]
        lines += [" endloop", "endfacet"]
    loaded = SurfaceMesh.load(write(tmp_path / "a.stl", "\n".join([*lines, "endsolid ball"])))
    assert loaded.check().ok
    assert loaded.volume == pytest.approx(BALL.volume)


def test_binary_stl_that_begins_with_solid(tmp_path):
    BALL.save(tmp_path / "a.stl")
    data = (tmp_path / "a.stl").read_bytes()
    loaded = SurfaceMesh.load(write(tmp_path / "b.stl", b"solid " + data[6:]))
    assert len(loaded.triangles) == len(BALL.triangles)


def test_obj_with_all_kinds_of_lines(tmp_path):
    text = "mtllib a.mtl\no cube\nv 0 0 0 1\nv 1 0 0\nv 1 1 0\n# a comment\nv 0 1 0\nvt 0 0\nvn 0 0 1\ns off\n"
    loaded = SurfaceMesh.load(write(tmp_path / "a.obj", text + "usemtl m\nf 1/1/1 2//1 3/1 4\nf -4 \\\n-3 -1\n"))
    assert loaded.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 3]]


def test_big_endian_ply_with_other_elements_and_mixed_faces(tmp_path):
    header = (
        "ply\nformat binary_big_endian 1.0\nelement camera 2\nproperty list uchar short lens\n"
        "element vertex 4\nproperty uchar red\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 2\nproperty list uchar uint vertex_index\nproperty float quality\nend_header\n"
    )
    camera = struct.pack(">Bh", 1, 7) + struct.pack(">Bhh", 2, 7, 8)
    vertices = b"".join(struct.pack(">Bfff", 9, *p) for p in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)))
    faces = struct.pack(">BIIIIf", 4, 0, 1, 2, 3, 0.5) + struct.pack(">BIIIf", 3, 2, 1, 0, 0.5)
    loaded = SurfaceMesh.load(write(tmp_path / "a.ply", header.encode() + camera + vertices + faces))
    assert loaded.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [2, 1, 0]]


@pytest.mark.parametrize("name", ["a.obj", "a.off", "a.ply", "a.stl", "a.vtk", "a.msh"])
def test_byte_order_marks_and_line_ends_of_other_systems(tmp_path, name):
    if name == "a.msh":
        tet = (
            "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n1\n1 4 2 0 1 1 2 3 4\n$EndElements\n"
        )
        text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + tet
    elif name == "a.stl":
        corners = BALL.vertices[BALL.triangles]
        rows = [
            "facet\nouter loop\n" + "".join(f"vertex {x} {y} {z}\n" for x, y, z in t) + "endloop\n" for t in corners
        ]
        text = "solid\n" + "".join(rows)
    elif name in ("a.ply", "a.vtk"):
        # Text as meshio writes it.
        meshio.write(tmp_path / name, meshio.Mesh(BALL.vertices, [("triangle", BALL.triangles)]), binary=False)
        text = (tmp_path / name).read_text()
    else:
        BALL.save(tmp_path / name)
        text = (tmp_path / name).read_text()
    kind = TetMesh if name == "a.msh" else SurfaceMesh
    plain = kind.load(write(tmp_path / name, text))
    variants = [b"\xef\xbb\xbf" + text.encode(), text.replace("\n", "\r\n").encode()]
    if name in ("a.obj", "a.off", "a.stl"):
        variants.append(text.replace("\n", "\r").encode())
    for variant in variants:
        loaded = kind.load(write(tmp_path / name, variant))
        assert np.array_equal(loaded.vertices, plain.vertices)
        assert loaded.volume == plain.volume


def test_concave_polygons_are_cut_inside(tmp_path):
    # An arrowhead whose fan from its first corner would leave the polygon.
    text = "OFF\n4 1 0\n1 0 0\n0 1 0\n-1 0 0\n0 0.3 0\n4 0 1 2 3\n"
    loaded = SurfaceMesh.load(write(tmp_path / "a.off", text))
    assert loaded.area == pytest.approx(0.7)
    spiral = "OFF\n6 1 0\n0 0 0\n2 0 0\n2 1 0\n1 1 0\n1 2 0\n0 2 0\n6 2 3 4 5 0 1\n"
    loaded = SurfaceMesh.load(write(tmp_path / "b.off", spiral))
    assert loaded.area == pytest.approx(3.0)
    assert (loaded.area_vectors[:, 2] > 0).all()


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_concave_polygon_with_a_thousand_corners(tmp_path, axis, turn):
    """A star in a plane across each axis, seen from either side; an algorithm of cubic time would take minutes."""
    angle = np.linspace(0.0, 2.0 * np.pi, 1000, endpoint=False)
    radius = np.where(np.arange(1000) % 2, 1.0, 0.5)
    points = np.roll(np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle]), axis, axis=1)
    lines = ["v {!r} {!r} {!r}".format(*p) for p in points.tolist()]
    lines.append("f " + " ".join(map(str, range(1, 1001)[::turn])))
    loaded = SurfaceMesh.load(write(tmp_path / "a.obj", "\n".join(lines)))
    normals = loaded.area_vectors[:, (2 + axis) % 3]
    assert len(loaded.triangles) == 998
    assert (turn * normals > 0).all()
    assert loaded.area == pytest.approx(0.5 * 1000 * 0.5 * np.sin(2.0 * np.pi / 1000))
    assert loaded.area_vectors.sum() == pytest.approx(turn * loaded.area)


def test_a_concave_polygon_with_very_many_corners_is_refused(tmp_path):
    angle = np.linspace(0.0, 2.0 * np.pi, 10_000, endpoint=False)
    points = "".join(f"v {(2 + k % 2) * np.cos(a)} {(2 + k % 2) * np.sin(a)} 0\n" for k, a in enumerate(angle))
    with pytest.raises(MeshError, match=r"a\.obj: a concave face has 10000 corners; at most 4000 are possible"):
        SurfaceMesh.load(write(tmp_path / "a.obj", points + "f " + " ".join(map(str, range(1, 10_001)))))


def test_a_polygon_that_crosses_itself_is_still_cut(tmp_path):
    """It has no inside, so any triangles between its corners are valid."""
    loaded = SurfaceMesh.load(write(tmp_path / "a.off", "OFF\n5 1 0\n0 0 0\n2 0 0\n0 1 0\n2 1 0\n1 3 0\n5 0 1 2 3 4\n"))
    assert len(loaded.triangles) == 3


# What loading corrects


def test_vertices_at_the_same_place_are_merged(tmp_path, caplog):
    soup = SurfaceMesh(BALL.vertices[BALL.triangles].reshape(-1, 3), np.arange(3 * len(BALL.triangles)).reshape(-1, 3))
    generator = np.random.default_rng(0)
    noisy = SurfaceMesh(soup.vertices + generator.uniform(-2e-8, 2e-8, soup.vertices.shape), soup.triangles)
    for name, surface in (("exact.ply", soup), ("noisy.ply", noisy)):
        surface.save(tmp_path / name)
        with caplog.at_level(logging.INFO):
            loaded = SurfaceMesh.load(tmp_path / name)
        assert len(loaded.vertices) == len(BALL.vertices)
        assert loaded.check().ok
        assert f"{len(soup.vertices) - len(BALL.vertices)} vertices at the place of others" in caplog.text
    apart = SurfaceMesh(soup.vertices + generator.uniform(-1e-5, 1e-5, soup.vertices.shape), soup.triangles)
    apart.save(tmp_path / "apart.ply")
    assert len(SurfaceMesh.load(tmp_path / "apart.ply").vertices) == len(soup.vertices)


def test_collapsed_triangles_and_unused_vertices_are_dropped_and_logged(tmp_path, caplog):
    text = "OFF\n6 3 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n1 0 0\n9 9 9\n3 0 1 2\n3 0 2 3\n3 1 4 2\n"
    loaded = SurfaceMesh.load(write(tmp_path / "a.off", text))
    assert len(loaded.vertices) == 4
    assert loaded.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert "1 triangles that have a vertex twice" in caplog.text
    assert "1 vertices that belong to no triangle" in caplog.text


def test_triangles_that_are_there_twice_are_dropped_and_logged(tmp_path, caplog):
    """In any order of their corners; two that face each other are left, as a surface without thickness is a fault."""
    turned = np.roll(BALL.triangles, 1, axis=1)
    doubled = SurfaceMesh(BALL.vertices, np.vstack([BALL.triangles, turned, BALL.triangles[:3, ::-1]]))
    doubled.save(tmp_path / "a.obj")
    loaded = SurfaceMesh.load(tmp_path / "a.obj")
    assert loaded.triangles.tolist() == [*BALL.triangles.tolist(), *BALL.triangles[:3, ::-1].tolist()]
    assert f"{len(BALL.triangles)} triangles that are there twice" in caplog.text
    assert len(loaded.check().duplicate_triangles) == 3


def test_negative_tets_and_unused_vertices_in_files(tmp_path, caplog):
    tets = BODY.tets.copy()
    tets[::2] = tets[::2][:, [1, 0, 2, 3]]
    points = np.vstack([BODY.vertices, [[7, 7, 7]]])
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(points, [("tetra", tets), ("line", [[0, 1]])]))
    with caplog.at_level(logging.INFO):
        loaded = TetMesh.load(tmp_path / "a.vtu")
    assert loaded.reoriented == len(tets[::2])
    assert loaded.volume == pytest.approx(BODY.volume)
    assert f"{loaded.reoriented} of {len(tets)} tets had negative winding" in caplog.text
    assert "dropped 1 of" in caplog.text
