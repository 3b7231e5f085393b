"""Tet meshes in files of Universal Scene Description: prims of the type TetMesh (OpenUSD 24.03 and newer).

Source: OpenUSD, UsdGeomTetMesh (https://openusd.org/release/api/class_usd_geom_tet_mesh.html).
"""

# pyright: reportAttributeAccessIssue=false
# (OpenUSD comes without types.)

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from textwrap import shorten

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import TETRA, CellSoup, FormatError, MeshFile
from supple.mesh.io.in_child import read_in_child

USD_SUFFIXES = (".usd", ".usda", ".usdc")

INSTALL = "files of USD need OpenUSD, which is not installed; pip install 'supple[usd]'"


def read_usd(data: bytes) -> CellSoup:
    """The tets of all TetMesh prims of a text or binary file, in the coordinates of its world, in metres.

    Files that it refers to are not read.
    """
    if find_spec("pxr") is None:
        raise FormatError(INSTALL)
    if not data.startswith((b"#usda", b"PXR-USDC")):
        raise FormatError("it is not a USD file: it begins with neither PXR-USDC nor #usda")
    return read_in_child(data, "usd", ".usda" if data.startswith(b"#usda") else ".usdc").soup


def read_file(path: Path) -> MeshFile:
    """The same, in this process."""
    from pxr import Sdf, Tf, Usd

    if path.suffix == ".usdc":  # as text, in which references are not followed
        text = path.with_name("text.usda")
        Sdf.Layer.FindOrOpen(str(path)).Export(str(text))
        path = text
    try:
        path.read_text("utf-8")  # OpenUSD repeats what it cannot read in an error that Python cannot decode
        return MeshFile(_tets_of(Usd.Stage.Open(str(path), Usd.Stage.LoadNone)))
    except UnicodeDecodeError as error:
        raise FormatError(f"byte {error.start} is not UTF-8") from None
    except Tf.ErrorException as error:
        # The text is the place in USD's source, then the reason in quotes.
        reason = str(error).rpartition(" : ")[2].strip("' \n").replace(str(path), "the file")
        raise FormatError(f"OpenUSD cannot read it: {shorten(reason, 200)}") from None


def _tets_of(stage) -> CellSoup:
    from pxr import Usd, UsdGeom

    unit, time = float(UsdGeom.GetStageMetersPerUnit(stage)), Usd.TimeCode.EarliestTime()
    points, tets, count = [np.zeros((0, 3))], [np.zeros((0, 4), dtype=np.int64)], 0
    for prim in stage.Traverse():
        if not prim.IsA(UsdGeom.TetMesh):
            continue
        mesh = UsdGeom.TetMesh(prim)
        x = rows_of(mesh.GetPointsAttr(), time, np.float64, 3)
        rows = rows_of(mesh.GetTetVertexIndicesAttr(), time, np.int64, 4)
        if len(rows) and not (rows.min() >= 0 and rows.max() < len(x)):
            raise FormatError(f"{prim.GetPath()}: a tet names a point outside of 0 to {len(x) - 1}")
        world = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(time))
        with np.errstate(all="ignore"):  # the mesh refuses what is not finite
            points.append(unit * (x @ world[:3, :3] + world[3, :3]))  # USD multiplies rows from the left
        tets.append(rows + count)
        count += len(x)
    return CellSoup.of_rows(np.concatenate(points), np.concatenate(tets), TETRA)


def rows_of(attribute, time, kind: type, columns: int) -> NDArray:
    """The values of an attribute as (n, columns) numbers. A file may declare any type for it, also an unknown one."""
    value = attribute.Get(time)
    rows = np.asarray([] if value is None else value)
    if rows.size == 0:
        return np.zeros((0, columns), dtype=kind)
    if not np.can_cast(rows.dtype, kind, "same_kind") or rows.shape[1:] != (columns,):
        raise FormatError(f"{attribute.GetPath()} is not an array of the type {attribute.GetTypeName()}")
    return rows.astype(kind)


def write_usd(path: Path, vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> None:
    """Write one TetMesh with its surface, in metres; coordinates are stored in single precision, as USD has them."""
    if tets.shape[1] != 4:
        raise FormatError("USD has linear tets only; save mesh.to_order(1)")
    if find_spec("pxr") is None:
        raise FormatError(INSTALL)
    from pxr import Usd, UsdGeom, Vt

    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    mesh = UsdGeom.TetMesh.Define(stage, "/mesh")
    stage.SetDefaultPrim(mesh.GetPrim())
    single = np.ascontiguousarray(vertices, dtype=np.float32)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(single))
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([single.min(axis=0), single.max(axis=0)])))
    mesh.CreateTetVertexIndicesAttr(Vt.Vec4iArray.FromNumpy(np.ascontiguousarray(tets, dtype=np.int32)))
    mesh.CreateSurfaceFaceVertexIndicesAttr(UsdGeom.TetMesh.ComputeSurfaceFaces(mesh, Usd.TimeCode.Default()))
    stage.GetRootLayer().Save()
