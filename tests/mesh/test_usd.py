"""Tet meshes in USD files: written, read again, and read as OpenUSD writes them."""

from pathlib import Path

import numpy as np
import pytest

import supple as sp
from supple.errors import MeshError

pxr = pytest.importorskip("pxr")
from pxr import Gf, Usd, UsdGeom  # noqa: E402

BOX = sp.shapes.box((0.1, 0.2, 0.3), (1, 2, 3))
POINTS = "point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]"


def tet(points: str, tets: str = "int4[] tetVertexIndices = [(0, 1, 2, 3)]", transform: str | None = None) -> str:
    """A file with one TetMesh."""
    order = 'uniform token[] xformOpOrder = ["xformOp:transform"]'
    placed = [] if transform is None else [f"matrix4d xformOp:transform = {transform}", order]
    return "\n".join(["#usda 1.0", 'def TetMesh "a" {', points, tets, *placed, "}\n"])


@pytest.mark.parametrize("suffix", [".usd", ".usda", ".usdc"])
def test_a_mesh_comes_back_in_single_precision(tmp_path: Path, suffix: str) -> None:
    BOX.save(tmp_path / f"box{suffix}")
    again = sp.TetMesh.load(tmp_path / f"box{suffix}")
    assert np.array_equal(again.tets, BOX.tets)
    assert np.array_equal(again.vertices, BOX.vertices.astype(np.float32))


def test_openusd_finds_the_mesh_right(tmp_path: Path) -> None:
    BOX.save(tmp_path / "box.usda")
    stage = Usd.Stage.Open(str(tmp_path / "box.usda"))
    mesh = UsdGeom.TetMesh(stage.GetDefaultPrim())
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert len(UsdGeom.TetMesh.FindInvertedElements(mesh, Usd.TimeCode.Default())) == 0
    faces = np.sort(np.array(mesh.GetSurfaceFaceVertexIndicesAttr().Get()), axis=1)
    assert {tuple(face) for face in faces} == {tuple(face) for face in np.sort(BOX.surface.triangles, axis=1)}


def test_prims_are_placed_in_metres(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "two.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.Xform.Define(stage, "/world").AddTranslateOp().Set(Gf.Vec3d(0.0, 100.0, 0.0))
    for name, x in (("a", 0.0), ("b", 50.0)):
        mesh = UsdGeom.TetMesh.Define(stage, f"/world/{name}")
        mesh.AddTranslateOp().Set(Gf.Vec3d(x, 0.0, 0.0))
        mesh.CreatePointsAttr([(0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 10)])
        mesh.CreateTetVertexIndicesAttr([Gf.Vec4i(0, 1, 2, 3)])
    stage.GetRootLayer().Save()
    both = sp.TetMesh.load(tmp_path / "two.usda")
    assert np.array_equal(both.tets, [[0, 1, 2, 3], [4, 5, 6, 7]])
    np.testing.assert_allclose(both.vertices[0], [0.0, 1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(both.vertices[5], [0.6, 1.0, 0.0], atol=1e-15)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("solid x\n", "not a USD file"),
        ('#usda 1.0\ndef TetMesh "a" {\n', "OpenUSD cannot read it"),
        ("#usda 1.0\n", "no prims of the types Mesh and TetMesh"),
        (
            tet("point3f[] points = [(0, 0, 0)]"),
            "/a: a cell names a point outside of 0 to 0",
        ),
        (tet("pointXf[] points = [(0, 0, 0)]"), r"/a.points is not an array of the type point3f\[\]"),
        (tet("float2[] points = [(0, 1), (2, 3), (4, 5)]"), r"/a.points is not an array of the type point3f\[\]"),
        (tet('string points = "a"'), r"/a.points is not an array of the type point3f\[\]"),
        (tet(POINTS, "float4[] tetVertexIndices = [(nan, 1, 2, 3)]"), r"/a.tetVertexIndices is not .* type int4\[\]"),
        (tet("point3f[] points = [(nan, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]"), "which is not finite"),
        (tet(POINTS, transform="((inf, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))"), "which is not finite"),
        (
            tet(POINTS, transform="((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (1e300, 0, 0, 1))"),
            "coordinates beyond",
        ),
    ],
)
@pytest.mark.filterwarnings("error")
def test_malformed_files_are_one_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "bad.usda"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(MeshError, match=message) as caught:
        sp.TetMesh.load(path)
    assert str(caught.value).startswith(str(path))


CORNERS = "point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]"
FACES = "int[] faceVertexCounts = [3, 3, 3, 3]\nint[] faceVertexIndices = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]"
TURNED = "int[] faceVertexCounts = [3, 3, 3, 3]\nint[] faceVertexIndices = [1, 2, 0, 3, 1, 0, 2, 3, 0, 3, 2, 1]"
LEFT = '\nuniform token orientation = "leftHanded"'


def stage(prims: str, up: str = "Y", unit: str = "0.01") -> str:
    return f'#usda 1.0\n(\nmetersPerUnit = {unit}\nupAxis = "{up}"\n)\n' + prims


def mesh(name: str, more: str = FACES, scale: str = "(1, 1, 1)") -> str:
    order = 'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]'
    move = f"double3 xformOp:translate = (0, 0, 100)\nfloat3 xformOp:scale = {scale}\n{order}"
    return f'def Mesh "{name}" {{\n{CORNERS}\n{more}\n{move}\n}}\n'


@pytest.mark.parametrize(
    "prim", [mesh("a"), mesh("a", TURNED + LEFT), mesh("a", scale="(-1, 1, 1)"), mesh("a", TURNED + LEFT, "(-1, 1, 1)")]
)
def test_meshes_that_are_surfaces_are_placed_and_face_outward(tmp_path: Path, prim: str) -> None:
    (tmp_path / "a.usda").write_text(stage(prim))
    surface = sp.SurfaceMesh.load(tmp_path / "a.usda")
    assert surface.volume == pytest.approx(1e-6 / 6)
    assert surface.bounds[0][2] == pytest.approx(1.0)
    with pytest.raises(MeshError, match=r"no tets; fill it with them: supple mesh a\.usda"):
        sp.TetMesh.load(tmp_path / "a.usda")


def test_the_axis_that_points_up_becomes_y(tmp_path: Path) -> None:
    (tmp_path / "a.usda").write_text(stage(mesh("a"), up="Z"))
    surface = sp.SurfaceMesh.load(tmp_path / "a.usda")
    low, high = surface.bounds
    np.testing.assert_allclose([low, high], [[0, 1, -0.01], [0.01, 1.01, 0]], atol=1e-12)
    assert surface.volume == pytest.approx(1e-6 / 6)
    assert sp.SurfaceMesh.load(tmp_path / "a.usda", keep_axes=True).bounds[0][2] == pytest.approx(1.0)
    (tmp_path / "b.usda").write_text(stage(tet(POINTS).partition("\n")[2], up="Z", unit="1"))
    np.testing.assert_allclose(sp.TetMesh.load(tmp_path / "b.usda").vertices[2:], [[0, 0, -1], [0, 1, 0]])


def test_what_is_hidden_or_a_guide_is_left_out(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    hidden = mesh("b", FACES + '\ntoken visibility = "invisible"')
    guide = mesh("c", FACES + '\nuniform token purpose = "guide"')
    (tmp_path / "a.usda").write_text(stage(mesh("a") + hidden + guide + 'def Sphere "d" {\n}\n'))
    assert sp.SurfaceMesh.load(tmp_path / "a.usda").components.count == 1
    assert "its 1 shapes (cubes, spheres and the like) were left out" in caplog.text


def test_instances_in_the_file_are_placed(tmp_path: Path) -> None:
    place = 'double3 xformOp:translate = ({}, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]\n'
    both = "".join(
        f'def Xform "{name}" (\ninstanceable = true\nreferences = </proto>\n)\n{{\n{place.format(x)}}}\n'
        for name, x in (("one", 0), ("two", 5))
    )
    (tmp_path / "a.usda").write_text(stage(f'class "proto" {{\n{mesh("m")}}}\n' + both, unit="1"))
    surface = sp.SurfaceMesh.load(tmp_path / "a.usda")
    assert surface.components.count == 2
    assert surface.bounds[1][0] == pytest.approx(6.0)


def test_tets_count_before_surfaces(tmp_path: Path) -> None:
    (tmp_path / "a.usda").write_text(stage(mesh("b") + tet(POINTS).partition("\n")[2]))
    assert len(sp.TetMesh.load(tmp_path / "a.usda").tets) == 1


@pytest.mark.parametrize("kind", ["references", "payload"])
def test_other_files_are_not_read(tmp_path: Path, kind: str, caplog: pytest.LogCaptureFixture) -> None:
    """Wherever they are; the message says how to have them inside."""
    other = tmp_path / "other.usda"
    other.write_text('#usda 1.0\n(\ndefaultPrim = "a"\n)\n' + mesh("a"))
    link = f'def "x" (\n{kind} = @{other}@\n)\n{{\n}}\n'
    (tmp_path / "a.usda").write_text(stage(link))
    with pytest.raises(MeshError, match=r"it refers to 1 other files, which are not read; .* usdcat --flatten"):
        sp.SurfaceMesh.load(tmp_path / "a.usda")
    (tmp_path / "a.usda").write_text(stage(mesh("a") + link))
    assert sp.SurfaceMesh.load(tmp_path / "a.usda").components.count == 1
    assert "it refers to 1 other files" in caplog.text


@pytest.mark.parametrize(
    ("faces", "words"),
    [
        ("int[] faceVertexCounts = [3, 4]\nint[] faceVertexIndices = [0, 1, 2]", "contradict its faces"),
        ("int[] faceVertexCounts = [-3]\nint[] faceVertexIndices = [0, 1, 2]", "contradict its faces"),
        ("int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 9]", "a cell names a point outside of 0 to 3"),
        ("float[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]", "is not an array of the type int"),
        ("int[] faceVertexCounts = [2]\nint[] faceVertexIndices = [0, 1]", "a face needs three at least"),
    ],
)
def test_malformed_surfaces_are_one_line(tmp_path: Path, faces: str, words: str) -> None:
    (tmp_path / "a.usda").write_text(stage(mesh("a", faces)))
    with pytest.raises(MeshError, match=words):
        sp.SurfaceMesh.load(tmp_path / "a.usda")


def test_damaged_binary_files_are_one_line(tmp_path: Path) -> None:
    BOX.save(tmp_path / "box.usdc")
    data = bytearray((tmp_path / "box.usdc").read_bytes())
    (tmp_path / "short.usdc").write_bytes(data[: len(data) // 2])
    data[16:24] = (2**44).to_bytes(8, "little")  # where the table of contents is said to begin
    (tmp_path / "far.usdc").write_bytes(data)
    for name in ("short", "far"):
        with pytest.raises(MeshError, match="it is damaged"):
            sp.TetMesh.load(tmp_path / f"{name}.usdc")


def test_quadratic_tets_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=r"save mesh.to_order\(1\)"):
        BOX.to_order(2).save(tmp_path / "box.usda")
    assert not list(tmp_path.iterdir())
