"""Universal Scene Description: meshes with a time sample for each frame, of their points or of a rigid body's pose.

Recorded fields are primvars of the meshes of soft bodies. A material of each mesh is a UsdPreviewSurface.
"""

# pyright: reportAttributeAccessIssue=false
# (OpenUSD comes without types.)

from __future__ import annotations

import errno
import re
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from supple.errors import OutputError
from supple.results.export.recorded_fields import fields_on
from supple.results.recording.reader import Recording
from supple.results.view.from_recording import model_of_recording, render_frame_of
from supple.results.view.surfaces import RigidSurface, body_surface, obstacle_surfaces
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
    codes, rate = _time_codes(recording)
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    stage.SetStartTimeCode(codes[0])
    stage.SetEndTimeCode(codes[-1])
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/recording").GetPrim())
    model = model_of_recording(recording)
    bodies = [body_surface(model, body) for body in model.bodies]
    for group, drawn in (("bodies", bodies), ("obstacles", obstacle_surfaces(model))):
        folder = UsdGeom.Scope.Define(stage, f"/recording/{group}").GetPath()
        for i, surface in enumerate(drawn):
            mesh = _define(stage, f"{folder}/{_identifier(surface.name, i)}", surface)
            _set_material(stage, f"/recording/materials/{_identifier(surface.name, i)}_{group}", mesh, surface)
            render_frames = (render_frame_of(model, frame) for frame in recording)
            if isinstance(surface, RigidSurface):
                _set_points(mesh, surface.vertices, None)
                _set_poses(mesh, [surface.pose(render_frame) for render_frame in render_frames], codes)
            else:
                for frame, render_frame, code in zip(recording, render_frames, codes, strict=True):
                    _set_points(mesh, surface.at(render_frame), code)
                    _set_fields(mesh, fields_on(surface, recording, frame, render_frame), code)
    stage.GetRootLayer().Save()


def _time_codes(recording: Recording) -> tuple[list[float], float]:
    """The time code of each frame, from 0, and how many a second has: one for each recorded frame."""
    times = np.asarray(recording.times) - recording.times[0]
    step = float(np.median(np.diff(times))) if len(times) > 1 else recording.dt
    codes = times / step
    near = np.round(codes)
    codes = np.where(np.abs(codes - near) < 1e-6 * np.maximum(1.0, near), near, codes)
    rate = 1.0 / step
    return codes.tolist(), round(rate) if abs(rate - round(rate)) < 1e-6 * rate else rate


def _set_fields(mesh, fields: dict[str, np.ndarray], code: float) -> None:
    """A primvar for each field: of one number, of a vector, or of the numbers of a tensor row by row."""
    from pxr import Sdf, UsdGeom, Vt

    for name, values in fields.items():
        width = values.shape[1]
        kind = Sdf.ValueTypeNames.Float3Array if width == 3 else Sdf.ValueTypeNames.FloatArray
        size = -1 if width in (1, 3) else width
        made = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(name, kind, UsdGeom.Tokens.vertex, size)
        array = Vt.Vec3fArray if width == 3 else Vt.FloatArray
        rows = values if width == 3 else values.ravel()
        made.GetAttr().Set(array.FromNumpy(np.ascontiguousarray(rows, dtype=np.float32)), code)


def _set_material(stage, path: str, mesh, surface) -> None:
    from pxr import Gf, Sdf, UsdShade

    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    opacity = surface.opacity
    for name, value in (
        ("roughness", surface.look.roughness),
        ("metallic", surface.look.metallic),
        ("opacity", opacity),
    ):
        shader.CreateInput(name, Sdf.ValueTypeNames.Float).Set(float(value))
    color = Gf.Vec3f(*_linear(surface.color))
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(color)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)


def _linear(color: tuple[int, int, int]) -> list[float]:
    return [float((channel / 255.0) ** 2.2) for channel in color]


def _define(stage, path: str, surface):
    from pxr import Gf, UsdGeom, Vt

    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.GetPrim().SetDisplayName(surface.name)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    triangles = surface.triangles
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(triangles), 3, dtype=np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(triangles.ravel(), dtype=np.int32)))
    mesh.CreateDisplayColorAttr([Gf.Vec3f(*_linear(surface.color))])
    return mesh


def _set_poses(mesh, poses, codes: list[float]) -> None:
    """The transform: a time sample for each pose (3, 4), or one value where they are the same."""
    from pxr import Gf, Usd

    operation = mesh.AddTransformOp()
    moves = any(np.any(pose != poses[0]) for pose in poses)
    for code, pose in zip(codes, poses if moves else poses[:1], strict=False):
        matrix = np.vstack([pose, [0.0, 0.0, 0.0, 1.0]]).T  # USD multiplies rows from the left
        operation.Set(Gf.Matrix4d(*matrix.ravel().tolist()), Usd.TimeCode(code) if moves else Usd.TimeCode.Default())


def _set_points(mesh, x, time: float | None) -> None:
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
