"""Universal Scene Description: meshes with a time sample for each frame, of their points or of a rigid body's pose."""

# pyright: reportAttributeAccessIssue=false
# (OpenUSD comes without types.)

from __future__ import annotations

import errno
import re
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from supple.errors import OutputError
from supple.results.drawing import ObstaclePicture, Picture, obstacle_pictures, pictures, view_of
from supple.results.recording.reader import Recording
from supple.runtime.replacing import whole_file


def write_usd(recording: Recording, output: Path) -> None:
    """Write bodies and obstacles to a .usdc (binary), .usda (text) or .usd file: metres, y up, one time code per frame.

    Raises
    ------
    OutputError : where OpenUSD is not installed, or the file cannot be written.
    """
    if find_spec("pxr") is None:
        raise OutputError("export to USD needs OpenUSD, which is not installed; pip install 'supple[usd]'")
    from pxr import Tf

    with whole_file(output) as fresh:
        try:
            _write(recording, fresh)
        except Tf.ErrorException as error:
            # The text contains the line of USD's source, then the reason, then what USD reads back.
            reason = re.search(r"rror occurred writing file: ([^'\n]*)", str(error))
            raise OSError(errno.EIO, reason[1] if reason else "USD could not write it") from None


def _write(recording: Recording, path: Path) -> None:
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(1.0 / recording.dt)
    stage.SetFramesPerSecond(1.0 / recording.dt)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(len(recording) - 1)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/recording").GetPrim())
    obstacles = obstacle_pictures(recording.obstacles, view_of(recording))
    for group, drawn in (("bodies", pictures(recording)), ("obstacles", obstacles)):
        folder = UsdGeom.Scope.Define(stage, f"/recording/{group}").GetPath()
        for i, picture in enumerate(drawn):
            mesh = _define(stage, f"{folder}/{_identifier(picture.name, i)}", picture)
            if isinstance(picture, Picture) and picture.body.rigid:
                _set_points(mesh, picture.rest(recording), None)
                _set_poses(mesh, [picture.pose(frame) for frame in recording])
                continue
            if isinstance(picture, ObstaclePicture) and not picture.moves(recording):
                _set_points(mesh, picture.at(recording[0]), None)
                continue
            for k, frame in enumerate(recording):
                _set_points(mesh, picture.at(frame), k)
    stage.GetRootLayer().Save()


def _define(stage, path: str, picture):
    from pxr import Gf, UsdGeom, Vt

    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.GetPrim().SetDisplayName(picture.name)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    triangles = picture.triangles
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(triangles), 3, dtype=np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(triangles.ravel(), dtype=np.int32)))
    color = np.array(picture.color) / 255.0
    mesh.CreateDisplayColorAttr([Gf.Vec3f(*(float(c) for c in color**2.2))])
    return mesh


def _set_poses(mesh, poses) -> None:
    """A time sample of the transform for each pose (3, 4)."""
    from pxr import Gf, Usd

    operation = mesh.AddTransformOp()
    for k, pose in enumerate(poses):
        matrix = np.vstack([pose, [0.0, 0.0, 0.0, 1.0]]).T  # USD multiplies rows from the left
        operation.Set(Gf.Matrix4d(*matrix.ravel().tolist()), Usd.TimeCode(k))


def _set_points(mesh, x, time: int | None) -> None:
    from pxr import Usd, Vt

    code = Usd.TimeCode.Default() if time is None else Usd.TimeCode(time)
    points = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(x, dtype=np.float32))
    mesh.CreatePointsAttr().Set(points, code)
    bounds = np.stack([x.min(axis=0), x.max(axis=0)]).astype(np.float32)
    mesh.CreateExtentAttr().Set(Vt.Vec3fArray.FromNumpy(bounds), code)


def _identifier(name: str, number: int) -> str:
    """A unique name that USD allows."""
    plain = "".join(c if c.isascii() and c.isalnum() else "_" for c in name)
    return f"_{number}_{plain}" if not plain or plain[0].isdigit() else f"{plain}_{number}"
