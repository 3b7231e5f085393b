"""What a file holds decides, not its name alone: pointers, web pages, archives, other formats; surfaces everywhere."""

import gzip

import meshio
import numpy as np
import pytest

import supple as sp
from supple.app.cli.app import main
from supple.errors import MeshError
from supple.mesh.io.mesh_files import READERS
from supple.mesh.io.tetgen_family import SUFFIXES
from supple.mesh.mesh_file import load_mesh

from .conftest import BALL, BODY, write

POINTER = "version https://git-lfs.github.com/spec/v1\noid sha256:" + 64 * "a" + "\nsize 8724\n"
OTHERS = {
    "lfs": (POINTER, "pointer of Git LFS, not the file itself; fetch that: git lfs pull"),
    "annex": ("/annex/objects/SHA256E-s31--a.stl\n", "pointer of git-annex"),
    "page": ("\n<!DOCTYPE html>\n<html><body>Not found</body></html>", "it is a web page"),
    "page without type": ("<HTML><body>Sign in</body></HTML>", "it is a web page"),
    "page as XML": ('<?xml version="1.0"?>\n<!DOCTYPE html PUBLIC "a">\n<html/>', "it is a web page"),
    "server": ('<?xml version="1.0"?>\n<Error><Code>AccessDenied</Code></Error>', "it is the error of a server"),
    "404": ("404: Not Found", "it is the error of a server"),
    "gzip": (gzip.compress(b"solid"), "it is compressed by gzip; unpack it first"),
    "xz": (b"\xfd7zXZ\0 ...", "it is compressed by xz"),
    "pdf": ("%PDF-1.4", "it is a PDF"),
    "hdf": (b"\x89HDF\r\n\x1a\n ...", "it is an HDF5 file"),
    "blank": ("\r\n \r\n", "it is empty"),
}


@pytest.mark.parametrize("extension", [*READERS, *SUFFIXES])
@pytest.mark.parametrize("case", OTHERS)
def test_what_is_not_a_mesh_is_named(tmp_path, case, extension):
    content, words = OTHERS[case]
    path = write(tmp_path / f"part{extension}", content)
    if extension in SUFFIXES:  # both are read, the nodes first
        write(tmp_path / "part.node", content)
        write(tmp_path / "part.ele", content)
    with pytest.raises(MeshError, match=words):
        load_mesh(path)


def test_a_pointer_is_named_where_its_sibling_is_missing(tmp_path):
    with pytest.raises(MeshError, match=r"part.node: it is a pointer of Git LFS"):
        sp.TetMesh.load(write(tmp_path / "part.node", POINTER))


def test_compressed_names_say_what_to_do(tmp_path):
    with pytest.raises(MeshError, match=r"'.gz' is not one of .*; unpack it first"):
        sp.SurfaceMesh.load(write(tmp_path / "part.stl.gz", gzip.compress(b"solid")))


@pytest.mark.parametrize("wrong", [".stl", ".obj", ".vtk", ".inp", ".dae"])
@pytest.mark.parametrize("right", [".ply", ".off", ".vtk", ".vtp", ".vtu"])
def test_a_wrong_extension_is_read_as_what_it_is(tmp_path, right, wrong, caplog):
    BALL.save(tmp_path / f"a{right}")
    (tmp_path / f"a{right}").rename(tmp_path / f"b{wrong}")
    loaded = load_mesh(tmp_path / f"b{wrong}")
    assert np.array_equal(loaded.triangles, BALL.triangles)
    assert ("and read as that" in caplog.text) == (right != wrong)
    assert right == wrong or right in caplog.text


def test_text_in_utf_16(tmp_path):
    for name in ("a.obj", "a.off"):
        BALL.save(tmp_path / name)
        text = (tmp_path / name).read_text()
        for coding in ("utf-16-le", "utf-16-be"):
            loaded = sp.SurfaceMesh.load(write(tmp_path / name, "\ufeff".encode(coding) + text.encode(coding)))
            assert np.array_equal(loaded.triangles, BALL.triangles)
    with pytest.raises(MeshError, match="it is text in UTF-16, and damaged"):
        sp.SurfaceMesh.load(write(tmp_path / "b.obj", b"\xff\xfev\0 \0\0"))


NODES = "1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n"
GMSH_1 = f"$NOD\n4\n{NODES}$ENDNOD\n$ELM\n2\n1 4 7 1 4 1 2 3 4\n2 2 8 1 3 1 2 3\n$ENDELM\n"


def test_gmsh_1(tmp_path):
    mesh = sp.TetMesh.load(write(tmp_path / "a.msh", GMSH_1))
    assert mesh.volume == pytest.approx(1 / 6)
    for old, new, words in (
        ("4 1 2 3 4", "4 1 2 3", "a.msh:10: an element names 3 nodes, not 4"),
        ("4 1 2 3 4", "x 1 2 3 4", "a.msh:10: number of an element's nodes is 'x'"),
        ("$ENDELM\n", "", r"no \$EndElements: it is truncated"),
        ("1 4 7 1 4", "1 99 7 1 4", "meshio cannot read"),
    ):
        with pytest.raises(MeshError, match=words):
            sp.TetMesh.load(write(tmp_path / "a.msh", GMSH_1.replace(old, new)))


STRIPS = (
    "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
    "element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 0 1\n"
)


def test_strips_of_ply(tmp_path):
    """-1 ends a strip, and the next one begins with a triangle that is not turned."""
    surface = sp.SurfaceMesh.load(write(tmp_path / "a.ply", STRIPS + "10 0 1 2 3 -1 0 2 4 -1 -1\n"))
    assert surface.triangles.tolist() == [[0, 1, 2], [1, 3, 2], [0, 2, 4]]
    with pytest.raises(MeshError, match="goes beyond the end"):
        sp.SurfaceMesh.load(write(tmp_path / "a.ply", STRIPS + "10 0 1 2\n"))


def test_medit(tmp_path):
    """References of tets become sets; a file of triangles is a surface."""
    refs = np.where(BODY.vertices[BODY.tets].mean(axis=1)[:, 0] > 0.0, 3, 7)
    mesh = meshio.Mesh(BODY.vertices, [("tetra", BODY.tets)], cell_data={"medit:ref": [refs]})
    meshio.write(tmp_path / "a.mesh", mesh)
    loaded = sp.TetMesh.load(tmp_path / "a.mesh")
    assert np.array_equal(loaded.tets, BODY.tets)
    np.testing.assert_array_equal(loaded.sets.tets_of("ref 3"), np.flatnonzero(refs == 3))
    np.testing.assert_array_equal(loaded.sets.tets_of("ref 7"), np.flatnonzero(refs == 7))
    meshio.write(tmp_path / "b.mesh", meshio.Mesh(BALL.vertices, [("triangle", BALL.triangles)]))
    assert sp.SurfaceMesh.load(tmp_path / "b.mesh").volume == pytest.approx(BALL.volume)


MEDIT = (
    "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n0 0 0 1\n1 0 0 1\n0 1 0 1\n0 0 1 1\n"
    "Tetrahedra\n1\n1 2 3 4 1\nEnd\n"
)
BAD_MEDIT = {
    "other": ("<mesh/>", "does not begin with 'MeshVersionFormatted'"),
    "index": (MEDIT.replace("1 2 3 4 1", "1 2 3 9 1"), "names point 8"),
    "huge": (MEDIT.replace("Vertices\n4", "Vertices\n4000000000"), "needs more than|could not be|cannot reshape"),
    "cut": (MEDIT[:60], "meshio cannot read"),
    "plane": (MEDIT.replace("Dimension 3", "Dimension 2"), "meshio cannot read|2 coordinates"),
    "words": (MEDIT.replace("0 1 0 1", "0 x 0 1"), "meshio cannot read"),
}


@pytest.mark.parametrize("case", BAD_MEDIT)
def test_malformed_medit(tmp_path, case):
    content, words = BAD_MEDIT[case]
    with pytest.raises(MeshError, match=words):
        sp.TetMesh.load(write(tmp_path / "a.mesh", content))


SCENE = """
bodies: [{{name: a, mesh: {{file: {name}, tets: 100}}, material: {{kind: arap, youngs: 1e4, poisson: 0.1}}}}]
steps: 1
"""


def surface_file(folder, name):
    """The ball as a surface, as another program writes it."""
    path = folder / name
    if name.endswith(".usda"):
        pytest.importorskip("pxr")
        points = ", ".join(str(tuple(x)) for x in BALL.vertices.tolist())
        flat = ", ".join(str(i) for i in BALL.triangles.ravel().tolist())
        sizes = ", ".join(["3"] * len(BALL.triangles))
        write(
            path,
            '#usda 1.0\n(\nmetersPerUnit = 1\n)\ndef Mesh "a" {\n'
            f"point3f[] points = [{points}]\nint[] faceVertexCounts = [{sizes}]\n"
            f"int[] faceVertexIndices = [{flat}]\n}}\n",
        )
    elif name.endswith(".inp"):
        rows = [f"{k}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(BALL.vertices.tolist(), start=1)]
        faces = [f"{k}, {a + 1}, {b + 1}, {c + 1}" for k, (a, b, c) in enumerate(BALL.triangles.tolist(), start=1)]
        write(path, "\n".join(["*NODE", *rows, "*ELEMENT, TYPE=CPS3", *faces, ""]))
    else:
        kind = "gmsh" if name.endswith(".msh") else None
        meshio.write(path, meshio.Mesh(BALL.vertices, [("triangle", BALL.triangles)]), file_format=kind)
    return path


@pytest.mark.parametrize("name", ["a.msh", "a.inp", "a.vtk", "a.vtu", "a.mesh", "a.usda"])
def test_a_surface_in_a_format_of_tets(tmp_path, name):
    """A surface for `SurfaceMesh.load`, in a scene file and in the shell; `TetMesh.load` gives the command."""
    path = surface_file(tmp_path, name)
    loaded = load_mesh(path)
    assert isinstance(loaded, sp.SurfaceMesh)
    assert loaded.volume == pytest.approx(BALL.volume, rel=1e-5)
    with pytest.raises(MeshError, match=f"no tets; fill it with them: supple mesh {name}"):
        sp.TetMesh.load(path)
    write(tmp_path / "s.yaml", SCENE.format(name=name))
    assert sp.load_scene(tmp_path / "s.yaml").bodies[0].mesh.volume == pytest.approx(BALL.volume, rel=0.1)


@pytest.mark.parametrize("name", ["a.msh", "a.usda"])
def test_the_commands_for_such_a_surface(tmp_path, name, capsys, monkeypatch):
    surface_file(tmp_path, name)
    monkeypatch.chdir(tmp_path)
    for command, words in ((["info", name], "surface"), (["mesh", name, "--tets", "100"], "surface triangles")):
        assert main(command) == 0
        assert words in capsys.readouterr().out


@pytest.mark.parametrize("name", ["a.msh", "a.vtu", "a.inp"])
def test_a_mesh_file_is_a_scene_by_itself(tmp_path, name):
    """Tets as they are; a surface in a format of tets is filled."""
    path = surface_file(tmp_path, name)
    assert sp.load_scene(path).bodies[0].mesh.volume == pytest.approx(BALL.volume, rel=0.1)
    BODY.save(path)
    body = sp.load_scene(path).bodies[0]
    assert np.array_equal(body.mesh.tets, BODY.tets)
    assert body.position[1] > 0.0


def test_tets_with_meshing_options_in_a_scene_file_are_refused(tmp_path):
    BODY.save(tmp_path / "a.vtu")
    with pytest.raises(sp.SceneError, match=r"s.yaml:2: .*a.vtu already holds tetrahedra; remove this"):
        sp.load_scene(write(tmp_path / "s.yaml", SCENE.format(name="a.vtu")))
