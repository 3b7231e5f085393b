"""Meshes in files of Universal Scene Description: prims of the types Mesh and TetMesh (OpenUSD 24.03 and newer).

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

from supple.mesh.io.cells import POLYGON, TETRA, CellSoup, FormatError, MeshFile
from supple.mesh.io.in_child import read_in_child

USD_SUFFIXES = (".usd", ".usda", ".usdc")

INSTALL = "files of USD need OpenUSD, which is not installed; pip install 'supple[usd]'"


def read_usd(data: bytes) -> MeshFile:
    """The visible prims of a text or binary file, in the coordinates of its world, in metres: tets and polygons.

    Files that it refers to are not read.
    """
    if find_spec("pxr") is None:
        raise FormatError(INSTALL)
    if not data.startswith((b"#usda", b"PXR-USDC")):
        raise FormatError("it is not a USD file: it begins with neither PXR-USDC nor #usda")
    return read_in_child(data, "usd", ".usda" if data.startswith(b"#usda") else ".usdc")


def read_file(path: Path) -> MeshFile:
    """The same, in this process."""
    from pxr import Sdf, Tf, Usd

    if path.suffix == ".usdc":  # as text, in which references are not followed
        text = path.with_name("text.usda")
        Sdf.Layer.FindOrOpen(str(path)).Export(str(text))
        path = text
    try:
        path.read_text("utf-8")  # OpenUSD repeats what it cannot read in an error that Python cannot decode
        layer = Sdf.Layer.OpenAsAnonymous(str(path))
        others = layer.GetCompositionAssetDependencies()
        for other in others:
            layer.UpdateCompositionAssetDependency(other, "")
        file = _read(Usd.Stage.Open(layer, Usd.Stage.LoadNone))
    except UnicodeDecodeError as error:
        raise FormatError(f"byte {error.start} is not UTF-8") from None
    except Tf.ErrorException as error:
        # The text is the place in USD's source, then the reason in quotes.
        reason = str(error).rpartition(" : ")[2].strip("' \n").replace(str(path), "the file")
        raise FormatError(f"OpenUSD cannot read it: {shorten(reason, 200)}") from None
    if not others:
        if len(file.soup.types) == 0:
            raise FormatError(
                "it has no prims of the types Mesh and TetMesh" + "".join(f"; {note}" for note in file.notes)
            )
        return file
    refers = f"it refers to {len(others)} other files, which are not read; to have them inside: usdcat --flatten"
    if len(file.soup.types) == 0:
        raise FormatError(refers)
    return file._replace(notes=[*file.notes, refers])


def _read(stage) -> MeshFile:
    from pxr import Usd, UsdGeom

    unit, time = float(UsdGeom.GetStageMetersPerUnit(stage)), Usd.TimeCode.EarliestTime()
    points, cells, count, shapes = [np.zeros((0, 3))], [], 0, 0
    hidden = UsdGeom.Tokens.invisible
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        shapes += prim.IsA(UsdGeom.Gprim) and not prim.IsA(UsdGeom.PointBased)
        if not (prim.IsA(UsdGeom.TetMesh) or prim.IsA(UsdGeom.Mesh)):
            continue
        image = UsdGeom.Imageable(prim)
        if image.ComputeVisibility(time) == hidden or image.ComputePurpose() in ("guide", "proxy"):
            continue
        world = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(time))
        x = rows_of(UsdGeom.PointBased(prim).GetPointsAttr(), time, np.float64, 3)
        kind, sizes, flat = cells_of_prim(prim, time, mirrored=bool(np.linalg.det(world[:3, :3]) < 0.0))
        if len(flat) and not (flat.min() >= 0 and flat.max() < len(x)):
            raise FormatError(f"{prim.GetPath()}: a cell names a point outside of 0 to {len(x) - 1}")
        with np.errstate(all="ignore"):  # the mesh refuses what is not finite
            points.append(unit * (x @ world[:3, :3] + world[3, :3]))  # USD multiplies rows from the left
        cells.append((kind, sizes, flat + count))
        count += len(x)
    notes = [f"its {shapes} shapes (cubes, spheres and the like) were left out; only meshes are read"] if shapes else []
    up = str(UsdGeom.GetStageUpAxis(stage)).lower()
    return MeshFile(CellSoup.of_blocks(np.concatenate(points), cells), notes=notes, up=up)


def cells_of_prim(prim, time, *, mirrored: bool = False) -> tuple[int, NDArray[np.int64], NDArray[np.int64]]:
    """The type, sizes and points of the tets or polygons of a prim; polygons counter-clockwise seen from outside."""
    from pxr import UsdGeom

    if prim.IsA(UsdGeom.TetMesh):
        rows = rows_of(UsdGeom.TetMesh(prim).GetTetVertexIndicesAttr(), time, np.int64, 4)
        return TETRA, np.full(len(rows), 4), rows.ravel()
    mesh = UsdGeom.Mesh(prim)
    sizes = rows_of(mesh.GetFaceVertexCountsAttr(), time, np.int64)
    flat = rows_of(mesh.GetFaceVertexIndicesAttr(), time, np.int64)
    if (sizes < 0).any() or sizes.sum() != len(flat):
        raise FormatError(f"{prim.GetPath()}: the numbers of corners of its faces contradict its faces")
    if (mesh.GetOrientationAttr().Get(time) == UsdGeom.Tokens.leftHanded) != mirrored:
        ends = np.cumsum(sizes)  # each face backwards
        flat = flat[np.repeat(2 * ends - sizes - 1, sizes) - np.arange(len(flat))]
    return POLYGON, sizes, flat


def rows_of(attribute, time, kind: type, *columns: int) -> NDArray:
    """The values of an attribute as (n, columns) or (n,) numbers. A file may declare any type for it."""
    value = attribute.Get(time)
    rows = np.asarray([] if value is None else value)
    if rows.size == 0:
        return np.zeros((0, *columns), dtype=kind)
    if not np.can_cast(rows.dtype, kind, "same_kind") or rows.shape[1:] != columns:
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
