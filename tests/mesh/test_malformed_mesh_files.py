"""Mesh files that are malformed, damaged or missing: an error of one line names file, fault and place."""

import lzma
import struct
import tracemalloc
import zlib
from base64 import b64encode

import numpy as np
import pytest

from supple.errors import MeshError
from supple.mesh.io.mesh_files import SURFACE_READERS
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh

from .conftest import BALL, BODY, SQUARE, the_only_line, write

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
    "wrong extension": ("a.docx", SQUARE, "'.docx' is not one of .3mf, .dae, .edge"),
    "empty stl": ("a.stl", "", "empty"),
    "blank obj": ("a.obj", " \n\n", "empty"),
    "short stl": ("a.stl", b"\x01" * 50, "too few"),
    "false stl count": (
        "a.stl",
        b"\0" * 80 + struct.pack("<I", 4_000_000_000) + b"\0" * 50,
        "4000000000 triangles.*for 1",
    ),
    "truncated stl": ("a.stl", b"\0" * 80 + struct.pack("<I", 3) + b"\0" * 149, "3 triangles.*for 2"),
    "stl without triangles": ("a.stl", b"\0" * 84, "no vertices"),
    "nan stl": (
        "a.stl",
        b"\0" * 80 + struct.pack("<I", 1) + struct.pack("<12fH", *[np.nan] * 12, 0),
        "vertex 0 .*finite",
    ),
    "signaling nan stl": (
        "a.stl",
        b"\0" * 80 + struct.pack("<I", 1) + b"\0" * 12 + 9 * struct.pack("<I", 0x7F800001) + b"\0\0",
        "not finite",
    ),
    "flat stl": ("a.stl", b"\0" * 80 + struct.pack("<I", 1) + b"\0" * 50, "degenerate"),
    "text stl word": ("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 x\n", "a.stl:4: vertex is '0 0 x'"),
    "text stl cut": ("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 1\n", "truncated"),
    "text stl loop": ("a.stl", "solid a\nouter loop\nvertex 0 0 1\nendloop\n", "a.stl:4: .*three vertices"),
    "text stl other words": ("a.stl", "solid a\nother words here\n", "a.stl:2: 'other words here'"),
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
    "ply cut": ("a.ply", PLY + PLY_FACES + "0 0 0\n1 0 0\n", "announces 3 rows of 'vertex', but only 2 are left"),
    "ply no z": (
        "a.ply",
        PLY.replace("property float z\n", "") + PLY_FACES + "0 0\n" * 3 + "3 0 1 2\n",
        "no x, y and z",
    ),
    "ply no faces": ("a.ply", PLY + "end_header\n" + "0 0 0\n" * 3, "no 'face' element"),
    "ply list": ("a.ply", PLY + PLY_FACES + "0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n", "row 0 of 'face' goes beyond the end"),
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
    "surface's extension": (
        "a.stl",
        b"\0" * 80 + struct.pack("<I", 1) + b"\0" * 50,
        "surface of 1 cells.*supple mesh a.stl",
    ),
    "extension": ("a.xyz", "x", "'.xyz' is not one of"),
    "empty": ("a.msh", "", "empty"),
    "msh head": ("a.msh", "mesh\n", "MeshFormat"),
    "msh nodes": ("a.msh", MSH + MSH_TAIL, r"no \$EndNodes: it is truncated"),
    "msh cut": ("a.msh", MSH + MSH_NODES[:30], "a.msh"),
    "msh huge": (
        "a.msh",
        MSH + MSH_NODES.replace("\n4\n", "\n4000000000\n") + MSH_TAIL,
        "needs more than 2048 MiB",
    ),
    "msh negative": ("a.msh", MSH + MSH_NODES.replace("\n4\n", "\n-4\n") + MSH_TAIL, "meshio cannot read: "),
    "msh word": ("a.msh", MSH + MSH_NODES.replace("4 0 0 1", "4 0 zero 1") + MSH_TAIL, "could not be read to its end"),
    "msh index": ("a.msh", MSH + MSH_NODES + MSH_TAIL.replace("3 4\n", "3 9\n"), "meshio cannot read: IndexError"),
    "msh twice": ("a.msh", MSH + MSH_NODES.replace("4 0 0 1", "3 0 0 1") + MSH_TAIL, "meshio cannot read: IndexError"),
    "msh version": ("a.msh", MSH.replace("2.2", "1.0") + MSH_NODES + MSH_TAIL, r"got 1\.0"),
    "msh kind": ("a.msh", MSH + MSH_NODES + MSH_TAIL.replace("1 4 2", "1 77 2"), "meshio cannot read: KeyError: 77"),
    "msh float": ("a.msh", MSH + MSH_NODES + MSH_TAIL.replace("1 4 2", "1 4.5 2"), "invalid literal for int.*'4.5'"),
    "msh cut elements": ("a.msh", MSH + MSH_NODES + MSH_TAIL[:-18], r"no \$EndElements: it is truncated"),
    "msh elements": (
        "a.msh",
        MSH + MSH_NODES + MSH_TAIL.replace("s\n1\n", "s\n7000000000\n"),
        "invalid literal",
    ),
    "msh wedge": (
        "a.msh",
        MSH + MSH_NODES + MSH_TAIL.replace("4 2 0 1 1 2 3 4", "6 0 1 2 3 4 1 2"),
        "cell 0 .* is a wedge that is flat or folds",
    ),
    "msh flat": ("a.msh", MSH + MSH_NODES.replace("4 0 0 1", "4 1 1 0") + MSH_TAIL, "tet 0 .*flat"),
    "msh triangle": (
        "a.msh",
        MSH + MSH_NODES + MSH_TAIL.replace("1 4 2 0 1 1 2 3 4", "1 2 2 0 1 1 2 3"),
        "surface of 1 cells, and no tets; fill it with them: supple mesh a.msh",
    ),
    "vtk hexahedron": ("a.vtk", VTK_TETS + "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n12\n", "hexahedron of 4 points, not 8"),
    "vtk polyhedron": ("a.vtk", VTK_TETS + "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n42\n", "polyhedron cells"),
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
    "vtu surface": ("a.vtu", vtp('NumberOfPoints="3"', "0 0 0 1 0 0 0 1 0", "0 1 2", "3"), "surface of 1 cells"),
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
    with pytest.raises(MeshError, match="the file does not exist"):
        load(tmp_path / "none.vtk")


def test_tets_as_a_surface_are_an_error_with_a_remedy(tmp_path):
    BODY.save(tmp_path / "a.vtu")
    with pytest.raises(MeshError, match=r"it holds 36 solid cells, .*use it as it is; it is loaded with TetMesh\.load"):
        SurfaceMesh.load(tmp_path / "a.vtu")
    BALL.save(tmp_path / "b.vtk")
    with pytest.raises(
        MeshError, match=r"it holds a surface of 80 cells, and no tets; fill it with them: supple mesh b\.vtk"
    ):
        TetMesh.load(tmp_path / "b.vtk")


@pytest.mark.parametrize(("mesh", "name"), [(BALL, "a.stl"), (BALL, "a.obj"), (BODY, "a.vtu"), (BODY, "a.msh")])
def test_unwritable_output_leaves_no_file(tmp_path, mesh, name):
    with pytest.raises(MeshError, match="cannot be written") as caught:
        mesh.save(tmp_path / "missing" / name)
    the_only_line(caught)
    (tmp_path / name).mkdir()
    with pytest.raises(MeshError, match="is a folder; give the name of a file"):
        mesh.save(tmp_path / name)
    assert [p.name for p in tmp_path.iterdir()] == [name]
    with pytest.raises(MeshError, match="is not one of"):
        mesh.save(tmp_path / "a.docx")


@pytest.mark.parametrize("compressor", ["vtkZLibDataCompressor", "vtkLZMADataCompressor"])
@pytest.mark.parametrize("said", [0, 36, 2**15])
def test_a_block_that_swells_beyond_what_it_says_is_refused_without_the_memory(tmp_path, compressor, said):
    zeros = bytes(2**25)
    bomb = zlib.compress(zeros) if "ZLib" in compressor else lzma.compress(zeros, preset=0)
    data = b64encode(struct.pack("<4I", 1, said, said, len(bomb))) + b64encode(bomb)
    file = tmp_path / "bomb.vtp"
    file.write_bytes(
        f'<VTKFile type="PolyData" byte_order="LittleEndian" compressor="{compressor}"><PolyData><Piece '
        'NumberOfPoints="3" NumberOfPolys="1"><Points><DataArray type="Float32" NumberOfComponents="3" '
        f'format="binary">{data.decode()}</DataArray></Points></Piece></PolyData></VTKFile>'.encode()
    )
    tracemalloc.start()
    with pytest.raises(MeshError, match="cannot be decoded: the file is damaged"):
        SurfaceMesh.load(file)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2**20
