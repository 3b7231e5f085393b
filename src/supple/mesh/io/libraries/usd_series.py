"""TetMesh and Mesh prims of USD with time samples of their points and of the transforms above them."""

# pyright: reportAttributeAccessIssue=false
# (OpenUSD comes without types.)

from __future__ import annotations

from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.mesh.io.cells import CellSoup, FormatError
from supple.mesh.io.libraries.positions_file import Facts, written_series
from supple.mesh.io.libraries.usd import cells_of_prim, rows_of
from supple.mesh.io.splitting import cells_of


def read_series(path: Path, out: Path) -> Facts:
    """All prims, at the times of their samples, in the coordinates of the world, in metres."""
    from pxr import Sdf, Tf, Usd

    try:
        with path.open("rb") as file:
            if not file.read(8).startswith((b"#usda", b"PXR-USDC")):
                raise FormatError("it is not a USD file: it begins with neither PXR-USDC nor #usda")
        layer = Sdf.Layer.OpenAsAnonymous(str(path))
        if layer.GetCompositionAssetDependencies():
            raise FormatError("it refers to other files; flatten it: usdcat --flatten")
        return _read(Usd.Stage.Open(layer, Usd.Stage.LoadNone), out)
    except Tf.ErrorException as error:
        reason = str(error).rpartition(" : ")[2].strip("' \n").replace(str(path), "the file")
        raise FormatError(f"OpenUSD cannot read it: {shorten(reason, 200)}") from None


def _read(stage: Any, out: Path) -> Facts:
    from pxr import Usd, UsdGeom

    unit = float(UsdGeom.GetStageMetersPerUnit(stage))
    rate = float(stage.GetTimeCodesPerSecond()) or 24.0
    prims = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.TetMesh) or prim.IsA(UsdGeom.Mesh)]
    prims = [prim for prim in prims if UsdGeom.Imageable(prim).ComputeVisibility() != UsdGeom.Tokens.invisible]
    codes: set[float] = set()
    for prim in prims:
        codes.update(UsdGeom.PointBased(prim).GetPointsAttr().GetTimeSamples())
        above = prim
        while above and above.IsA(UsdGeom.Xformable):
            codes.update(UsdGeom.Xformable(above).GetTimeSamples())
            above = above.GetParent()
    times = sorted(codes)
    first = Usd.TimeCode(times[0]) if times else Usd.TimeCode.EarliestTime()
    tets, triangles, part, count = [np.zeros((0, 4), np.int64)], [np.zeros((0, 3), np.int64)], [], 0
    for k, prim in enumerate(prims):
        points = rows_of(UsdGeom.PointBased(prim).GetPointsAttr(), first, np.float64, 3)
        kind, sizes, flat = cells_of_prim(prim, first)
        if len(sizes):
            for rows, own in zip(
                cells_of(CellSoup.of_blocks(points, [(kind, sizes, flat)])), (tets, triangles), strict=True
            ):
                own.append(rows + count)
        part.append(np.full(len(points), k))
        count += len(points)
    moving = [_has_other_cells(prim) for prim in prims]
    starting = [_cell_numbers(prim, first) if own else None for prim, own in zip(prims, moving, strict=True)]

    def points_of(frame: int) -> NDArray[Any] | str:
        code = Usd.TimeCode(times[frame]) if times else first
        found = [np.zeros((0, 3))]
        for prim, begin in zip(prims, starting, strict=True):
            if begin is not None and not np.array_equal(begin, _cell_numbers(prim, code)):
                return f"{prim.GetPath()} has other cells"
            x = rows_of(UsdGeom.PointBased(prim).GetPointsAttr(), code, np.float64, 3)
            world = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(code))
            # USD multiplies rows from the left. What does not turn and stretch is not rounded.
            turned = x if np.array_equal(world[:3, :3], np.eye(3)) else x @ world[:3, :3]
            with np.errstate(all="ignore"):
                found.append(unit * (turned + world[3, :3]))
        return np.concatenate(found)

    cells: dict[str, Any] = {
        "tets": np.concatenate(tets),
        "triangles": np.concatenate(triangles),
        "part": np.concatenate([np.zeros(0, np.int64), *part]),
    }
    if times:
        cells["times"] = np.array(times) / rate
    names = [str(prim.GetName()) for prim in prims]
    return written_series(out, max(1, len(times)), points_of, cells, names, [])


def _indices(prim: Any) -> list[Any]:
    from pxr import UsdGeom

    if prim.IsA(UsdGeom.TetMesh):
        return [UsdGeom.TetMesh(prim).GetTetVertexIndicesAttr()]
    mesh = UsdGeom.Mesh(prim)
    return [mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr()]


def _has_other_cells(prim: Any) -> bool:
    return any(attribute.GetNumTimeSamples() > 1 for attribute in _indices(prim))


def _cell_numbers(prim: Any, code: Any) -> NDArray[np.int64]:
    return np.concatenate([np.asarray(item.Get(code) or [], dtype=np.int64).ravel() for item in _indices(prim)])
