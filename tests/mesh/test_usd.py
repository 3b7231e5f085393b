"""Tet meshes in USD files: written, read again, and read as OpenUSD writes them."""

from __future__ import annotations

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
    assert "\n" not in str(caught.value)


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
