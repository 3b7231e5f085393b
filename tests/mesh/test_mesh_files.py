"""Mesh files: round trips, other programs' files, and malformed ones."""

import logging
import struct

import meshio
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from supple.errors import MeshError
from supple.mesh import shapes
from supple.mesh.mesh_files import SURFACE_READERS, SURFACE_WRITERS
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh

BALL = shapes.sphere_surface(0.3, 0.2).transformed(translation=(1.0, 2.0, 3.0))
BODY = shapes.box((1.0, 0.1, 1 / 3), (3, 1, 2))
SQUARE = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n"


def write(path, content):
    """Write text or bytes."""
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def the_only_line(error):
    text = str(error.value)
    assert "\n" not in text
    assert len(text) < 400
    assert text.isprintable()
    return text


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


def test_msh_with_scattered_tags_parameters_and_other_elements(tmp_path):
    text = (
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 0\n$EndEntities\n"
        "$Nodes\n2 5 7 4000000000000\n2 1 1 2\n9\n4000000000000\n0 0 0 0.5 0.5\n1 0 0 0.5 0.5\n"
        "3 1 0 3\n7\n8\n1000\n0 1 0\n0 0 1\n1 1 1\n$EndNodes\n"
        "$Elements\n3 3 1 9\n0 1 15 1\n1 9\n2 1 2 1\n5 9 7 8\n3 1 4 2\n6 9 4000000000000 7 8\n"
        "9 4000000000000 8 7 1000\n$EndElements\n"
    )
    loaded = TetMesh.load(write(tmp_path / "a.msh", text))
    assert loaded.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
    assert loaded.volume == pytest.approx(0.5)


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


def test_vtk_reads_what_we_write(tmp_path):
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


def test_obj_with_everything(tmp_path):
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


def test_concave_polygons_are_cut_inside(tmp_path):
    # An arrowhead whose fan from its first corner would leave the polygon.
    text = "OFF\n4 1 0\n1 0 0\n0 1 0\n-1 0 0\n0 0.3 0\n4 0 1 2 3\n"
    loaded = SurfaceMesh.load(write(tmp_path / "a.off", text))
    assert loaded.area == pytest.approx(0.7)
    spiral = "OFF\n6 1 0\n0 0 0\n2 0 0\n2 1 0\n1 1 0\n1 2 0\n0 2 0\n6 2 3 4 5 0 1\n"
    loaded = SurfaceMesh.load(write(tmp_path / "b.off", spiral))
    assert loaded.area == pytest.approx(3.0)
    assert (loaded.area_vectors[:, 2] > 0).all()


# What loading mends


def test_vertices_in_the_same_place_are_merged(tmp_path, caplog):
    soup = SurfaceMesh(BALL.vertices[BALL.triangles].reshape(-1, 3), np.arange(3 * len(BALL.triangles)).reshape(-1, 3))
    generator = np.random.default_rng(0)
    noisy = SurfaceMesh(soup.vertices + generator.uniform(-2e-8, 2e-8, soup.vertices.shape), soup.triangles)
    for name, surface in (("exact.ply", soup), ("noisy.ply", noisy)):
        surface.save(tmp_path / name)
        with caplog.at_level(logging.INFO):
            loaded = SurfaceMesh.load(tmp_path / name)
        assert len(loaded.vertices) == len(BALL.vertices)
        assert loaded.check().ok
        assert f"{len(soup.vertices) - len(BALL.vertices)} vertices in the place of others" in caplog.text
    apart = SurfaceMesh(soup.vertices + generator.uniform(-1e-5, 1e-5, soup.vertices.shape), soup.triangles)
    apart.save(tmp_path / "apart.ply")
    assert len(SurfaceMesh.load(tmp_path / "apart.ply").vertices) == len(soup.vertices)


def test_collapsed_triangles_and_unused_vertices_are_dropped_and_told(tmp_path, caplog):
    text = "OFF\n6 3 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n1 0 0\n9 9 9\n3 0 1 2\n3 0 2 3\n3 1 4 2\n"
    loaded = SurfaceMesh.load(write(tmp_path / "a.off", text))
    assert len(loaded.vertices) == 4
    assert loaded.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert "1 triangles with a vertex twice" in caplog.text
    assert "1 vertices that belong to no triangle" in caplog.text


def test_negative_tets_and_unused_vertices_in_files(tmp_path, caplog):
    tets = BODY.tets.copy()
    tets[::2] = tets[::2][:, [1, 0, 2, 3]]
    points = np.vstack([BODY.vertices, [[7, 7, 7]]])
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(points, [("tetra", tets), ("line", [[0, 1]])]))
    with caplog.at_level(logging.INFO):
        loaded = TetMesh.load(tmp_path / "a.vtu")
    assert loaded.turned == len(tets[::2])
    assert loaded.volume == pytest.approx(BODY.volume)
    assert f"{loaded.turned} of {len(tets)} tets had negative winding" in caplog.text
    assert "dropped 1 of" in caplog.text


# Malformed files

PLY = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
PLY_FACES = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
VTK = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\n"
VTU = '<VTKFile type="{}" byte_order="LittleEndian"><{}><Piece {}>{}</Piece></{}></VTKFile>'
GARBAGE = bytes(np.random.default_rng(5).integers(0, 256, 3000, dtype=np.uint8))


def vtp(counts, points, connectivity, offsets):
    def array(name, kind, text):
        return f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="3" format="ascii">{text}</DataArray>'

    body = f"<Points>{array('p', 'Float32', points)}</Points>"
    body += f"<Polys>{array('connectivity', 'Int32', connectivity)}{array('offsets', 'Int32', offsets)}</Polys>"
    return VTU.format("PolyData", "PolyData", counts, body, "PolyData")


MALFORMED_SURFACES = {
    "no extension": ("bear", SQUARE, "no extension"),
    "wrong extension": ("a.docx", SQUARE, "'.docx' is not one of .obj, .off"),
    "tets' extension": ("a.msh", SQUARE, "TetMesh.load"),
    "empty stl": ("a.stl", "", "empty"),
    "blank obj": ("a.obj", " \n\n", "empty"),
    "short stl": ("a.stl", b"\x01" * 50, "too few"),
    "lying stl": ("a.stl", b"\0" * 80 + struct.pack("<I", 4_000_000_000) + b"\0" * 50, "4000000000 triangles.*for 1"),
    "truncated stl": ("a.stl", b"\0" * 80 + struct.pack("<I", 3) + b"\0" * 149, "3 triangles.*for 2"),
    "stl without triangles": ("a.stl", b"\0" * 84, "no vertices"),
    "nan stl": (
        "a.stl",
        b"\0" * 80 + struct.pack("<I", 1) + struct.pack("<12fH", *[np.nan] * 12, 0),
        "vertex 0 .*finite",
    ),
    "flat stl": ("a.stl", b"\0" * 80 + struct.pack("<I", 1) + b"\0" * 50, "degenerate"),
    "text stl word": ("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 x\n", "a.stl:4: vertex is '0 0 x'"),
    "text stl cut": ("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 1\n", "truncated"),
    "text stl loop": ("a.stl", "solid a\nouter loop\nvertex 0 0 1\nendloop\n", "a.stl:4: .*three vertices"),
    "text stl poem": ("a.stl", "solid as a rock\nroses are red\n", "a.stl:2: 'roses are red'"),
    "obj word": ("a.obj", "v 0 0 0\nv 1 0 one\n", "a.obj:2: vertex"),
    "obj short": ("a.obj", "v 0 0 0\nv 1 0\n", "a.obj:2: vertex needs 3"),
    "obj index": ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "face 0 names vertex 4"),
    "obj zero": ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "a.obj:4: .*start at 1"),
    "obj back": ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -4 1 2\n", "a.obj:4: .*-3"),
    "obj huge index": ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9999999999999999999999\n", "a.obj"),
    "obj two corners": ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "a.obj:4: face has 2 corners"),
    "obj points": ("a.obj", "v 0 0 0\nv 1 0 0\n", "no triangles"),
    "obj garbage": ("a.obj", GARBAGE, "not a text file"),
    "obj inf": ("a.obj", "v 0 0 0\nv 1 inf 0\nv 0 1 0\nf 1 2 3\n", "vertex 1 .*finite"),
    "off head": ("a.off", "4 2 0\n", "a.off:1: .*instead of 'OFF'"),
    "off counts": ("a.off", "OFF\n4\n", "a.off:2: the counts"),
    "off negative": ("a.off", "OFF\n-4 2 0\n", "a.off:2: -4 vertices"),
    "off huge": ("a.off", "OFF\n4000000000 1 0\n0 0 0\n", "4000000000 vertices"),
    "off cut": ("a.off", SQUARE[:-8], "2 faces: it is truncated|1 of 2 faces"),
    "off index": ("a.off", SQUARE.replace("3 0 2 3", "3 0 2 4"), "a.off:8: .*indices run to 3"),
    "off face": ("a.off", SQUARE.replace("3 0 2 3", "5 0 2 3"), "a.off:8: face announces 5"),
    "off binary": ("a.off", "OFF BINARY\n", "binary OFF"),
    "ply head": ("a.ply", "plywood\n", "no PLY header"),
    "ply format": ("a.ply", "ply\nformat morse 1.0\nend_header\n", "none of ascii"),
    "ply word": ("a.ply", PLY.replace("float z", "quaternion z") + PLY_FACES, "a.ply:6: .*quaternion"),
    "ply huge": ("a.ply", PLY.replace("vertex 3", "vertex 4000000000") + PLY_FACES, "a.ply:3: 4000000000 rows"),
    "ply cut": ("a.ply", PLY + PLY_FACES + "0 0 0\n1 0 0\n", "only 2 lines are left"),
    "ply no z": (
        "a.ply",
        PLY.replace("property float z\n", "") + PLY_FACES + "0 0\n" * 3 + "3 0 1 2\n",
        "no x, y and z",
    ),
    "ply no faces": ("a.ply", PLY + "end_header\n" + "0 0 0\n" * 3, "no 'face' element"),
    "ply list": ("a.ply", PLY + PLY_FACES + "0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n", "a.ply:13: .*too short"),
    "ply index": ("a.ply", PLY + PLY_FACES + "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "cell 0 names point 3"),
    "ply binary cut": (
        "a.ply",
        (PLY + PLY_FACES).replace("ascii", "binary_little_endian").encode() + b"\0" * 36 + b"\3" + b"\0" * 8,
        "beyond the end",
    ),
    "vtk head": ("a.vtk", "vtk\n", "a.vtk:1: "),
    "vtk grid": ("a.vtk", VTK.replace("POLYDATA", "STRUCTURED_GRID"), "a.vtk:4: .*POLYDATA"),
    "vtk huge": ("a.vtk", VTK + "POINTS 4000000000 float\n0 0 0\n", "a.vtk:5: 12000000000 numbers"),
    "vtk cut": ("a.vtk", VTK + "POINTS 3 float\n0 0 0\n1 0", "5 of 9 numbers"),
    "vtk cells": ("a.vtk", VTK + "POINTS 3 float\n0 0 0 1 0 0 0 1 0\nPOLYGONS 1 4\n5 0 1 2\n", "POLYGONS"),
    "vtk index": ("a.vtk", VTK + "POINTS 3 float\n0 0 0 1 0 0 0 1 0\nPOLYGONS 1 4\n3 0 1 -2\n", "names point -2"),
    "vtk lines": ("a.vtk", VTK + "POINTS 3 float\n0 0 0 1 0 0 0 1 0\nLINES 1 3\n2 0 1\n", "no triangles"),
    "vtp xml": ("a.vtp", "<VTKFile type=", "not well-formed"),
    "vtp kind": ("a.vtp", VTU.format("ImageData", "ImageData", "", "", "ImageData"), "'ImageData'"),
    "vtp counts": ("a.vtp", vtp('NumberOfPoints="4000000000"', "0 0 0 1 0 0 0 1 0", "0 1 2", "3"), "4000000000 points"),
    "vtp no counts": ("a.vtp", vtp("", "0 0 0 1 0 0 0 1 0", "0 1 2", "3"), "NumberOfPoints"),
    "vtp offsets": ("a.vtp", vtp('NumberOfPoints="3"', "0 0 0 1 0 0 0 1 0", "0 1 2", "4"), "offsets of its Polys"),
    "vtp word": ("a.vtp", vtp('NumberOfPoints="3"', "0 0 0 1 0 0 0 1 zero", "0 1 2", "3"), "cannot be decoded"),
    "vtp index": ("a.vtp", vtp('NumberOfPoints="3"', "0 0 0 1 0 0 0 1 0", "0 1 3", "3"), "names point 3"),
    **{f"garbage {e}": (f"g{e}", GARBAGE, f"g{e}") for e in SURFACE_READERS},
}


@pytest.mark.parametrize("case", MALFORMED_SURFACES)
def test_malformed_surface_files_give_one_line(tmp_path, case):
    name, content, words = MALFORMED_SURFACES[case]
    path = write(tmp_path / name, content)
    with pytest.raises(MeshError, match=words) as caught:
        SurfaceMesh.load(path)
    assert the_only_line(caught).startswith(str(path))


MSH = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
MSH_TAIL = "$Elements\n1\n1 4 2 0 1 1 2 3 4\n$EndElements\n"
MSH_NODES = "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
VTK_TETS = VTK.replace("POLYDATA", "UNSTRUCTURED_GRID") + "POINTS 4 double\n0 0 0 1 0 0 0 1 0 0 0 1\n"

MALFORMED_TET_FILES = {
    "surface's extension": ("a.stl", b"\0" * 84, "SurfaceMesh.load"),
    "extension": ("a.xyz", "x", "'.xyz' is not one of"),
    "empty": ("a.msh", "", "empty"),
    "msh head": ("a.msh", "mesh\n", "MeshFormat"),
    "msh nodes": ("a.msh", MSH + MSH_TAIL, r"\$Nodes"),
    "msh cut": ("a.msh", MSH + MSH_NODES[:30], "a.msh"),
    "msh huge": ("a.msh", MSH + MSH_NODES.replace("\n4\n", "\n4000000000\n") + MSH_TAIL, "a.msh:5: .*counts"),
    "msh negative": ("a.msh", MSH + MSH_NODES.replace("\n4\n", "\n-4\n") + MSH_TAIL, "a.msh:5: .*counts"),
    "msh word": ("a.msh", MSH + MSH_NODES.replace("4 0 0 1", "4 0 zero 1") + MSH_TAIL, "a.msh:9: .*not a number"),
    "msh index": ("a.msh", MSH + MSH_NODES + MSH_TAIL.replace("3 4\n", "3 9\n"), "names node 9, which does not exist"),
    "msh twice": ("a.msh", MSH + MSH_NODES.replace("4 0 0 1", "3 0 0 1") + MSH_TAIL, "node 3 is given twice"),
    "msh version": ("a.msh", MSH.replace("2.2", "1.0") + MSH_NODES + MSH_TAIL, "version '1.0'"),
    "msh kind": ("a.msh", MSH + MSH_NODES + MSH_TAIL.replace("1 4 2", "1 77 2"), "elements of type 77"),
    "msh float": ("a.msh", MSH + MSH_NODES + MSH_TAIL.replace("1 4 2", "1 4.5 2"), "whole one"),
    "msh no end": ("a.msh", MSH + MSH_NODES + MSH_TAIL[:-6], r"no \$EndElements"),
    "msh elements": ("a.msh", MSH + MSH_NODES + MSH_TAIL.replace("s\n1\n", "s\n7000000000\n"), "a.msh:12: .*counts"),
    "msh wedge": ("a.msh", MSH + MSH_NODES + MSH_TAIL.replace("4 2 0 1 1 2 3 4", "6 0 1 2 3 4 1 2"), "wedge cells"),
    "msh flat": ("a.msh", MSH + MSH_NODES.replace("4 0 0 1", "4 1 1 0") + MSH_TAIL, "tet 0 .*flat"),
    "msh triangle": (
        "a.msh",
        MSH + MSH_NODES + MSH_TAIL.replace("1 4 2 0 1 1 2 3 4", "1 2 2 0 1 1 2 3"),
        "no tetrahedra",
    ),
    "vtk hexahedron": ("a.vtk", VTK_TETS + "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n12\n", "hexahedron cells"),
    "vtk no types": ("a.vtk", VTK_TETS + "CELLS 1 5\n4 0 1 2 3\n", "CELL_TYPES"),
    "vtk types": ("a.vtk", VTK_TETS + "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 2\n10 10\n", "1 cells, but 2 cell types"),
    "vtk five": ("a.vtk", VTK_TETS + "CELLS 1 6\n5 0 1 2 3 0\nCELL_TYPES 1\n10\n", "5 points, not 4"),
    "vtk index": ("a.vtk", VTK_TETS + "CELLS 1 5\n4 0 1 2 4\nCELL_TYPES 1\n10\n", "names point 4"),
    "vtk twice": ("a.vtk", VTK_TETS + "CELLS 1 5\n4 0 1 2 2\nCELL_TYPES 1\n10\n", "vertex twice"),
    "vtk nan": (
        "a.vtk",
        VTK_TETS.replace("0 0 1\n", "0 nan 1\n") + "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n",
        "finite",
    ),
    "vtu surface": ("a.vtu", vtp('NumberOfPoints="3"', "0 0 0 1 0 0 0 1 0", "0 1 2", "3"), "no tetrahedra"),
    **{f"garbage {e}": (f"g{e}", GARBAGE, f"g{e}") for e in (".msh", ".vtu", ".vtk", ".node", ".ele")},
}


@pytest.mark.parametrize("case", MALFORMED_TET_FILES)
def test_malformed_tet_files_give_one_line(tmp_path, case, capfd):
    name, content, words = MALFORMED_TET_FILES[case]
    path = write(tmp_path / name, content)
    with pytest.raises(MeshError, match=words) as caught:
        TetMesh.load(path)
    assert str(path)[:-4] in the_only_line(caught)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("load", [SurfaceMesh.load, TetMesh.load])
def test_missing_files_and_folders(tmp_path, load):
    (tmp_path / "folder.vtk").mkdir()
    with pytest.raises(MeshError, match="it is a folder"):
        load(tmp_path / "folder.vtk")
    with pytest.raises(MeshError, match="there is no such file"):
        load(tmp_path / "none.vtk")


def test_a_surface_of_tets_is_refused_with_the_mend(tmp_path):
    BODY.save(tmp_path / "a.vtu")
    with pytest.raises(MeshError, match=r"tetrahedron cells, which are no surface; load it with TetMesh\.load"):
        SurfaceMesh.load(tmp_path / "a.vtu")
    BALL.save(tmp_path / "b.vtk")
    with pytest.raises(MeshError, match="no tetrahedra; a surface is loaded with"):
        TetMesh.load(tmp_path / "b.vtk")


@pytest.mark.parametrize(("mesh", "name"), [(BALL, "a.stl"), (BALL, "a.obj"), (BODY, "a.vtu"), (BODY, "a.msh")])
def test_unwritable_output_leaves_nothing(tmp_path, mesh, name):
    with pytest.raises(MeshError, match="cannot be written") as caught:
        mesh.save(tmp_path / "missing" / name)
    the_only_line(caught)
    (tmp_path / name).mkdir()
    with pytest.raises(MeshError, match="cannot be written"):
        mesh.save(tmp_path / name)
    assert [p.name for p in tmp_path.iterdir()] == [name]
    with pytest.raises(MeshError, match="is not one of"):
        mesh.save(tmp_path / "a.docx")


SAMPLES = [*SURFACE_WRITERS, "tets.msh", "tets.vtu", "tets.vtk"]


@pytest.mark.parametrize("kind", SAMPLES)
def test_damaged_files_never_do_worse_than_a_mesh_error(tmp_path, kind, capfd):
    mesh = BODY if kind.startswith("tets") else shapes.box_surface(divisions=(1, 1, 1))
    path = tmp_path / f"sample{kind.removeprefix('tets')}"
    mesh.save(path)
    original = path.read_bytes()

    @settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow], database=None)
    @given(
        cut=st.integers(0, len(original)),
        at=st.lists(st.integers(0, len(original) - 1), max_size=4),
        byte=st.sampled_from([0, 1, 0x20, 0x2D, 0x30, 0x39, 0x3C, 0x65, 0x7F, 0xFF]),
        truncate=st.booleans(),
    )
    def damage(cut, at, byte, truncate):
        data = bytearray(original)
        for place in at:
            data[place] = byte
        path.write_bytes(bytes(data[:cut]) if truncate else bytes(data))
        try:
            type(mesh).load(path)
        except MeshError as error:
            text = str(error)
            assert text.startswith(str(path))
            assert "\n" not in text

    damage()
    assert capfd.readouterr().out == ""
