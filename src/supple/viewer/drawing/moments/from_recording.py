"""Converts recordings to the data that the page draws."""

from __future__ import annotations

import ast
from typing import Any

import numpy as np

from supple.errors import SuppleError
from supple.materials.edges_and_volume import EdgesAndVolume
from supple.materials.material import Material
from supple.materials.registry import ELASTIC_MATERIALS
from supple.output.drawing import view_of
from supple.output.recording.reader import RecordedFrame, Recording
from supple.viewer.drawing.moments.model import Model, ModelBody, Moment

_MATERIALS = {kind.__name__: kind for kind in (*ELASTIC_MATERIALS, EdgesAndVolume)}


def model_of_recording(recording: Recording) -> Model:
    """The constant data of a recording."""
    bodies = tuple(
        ModelBody(body.name, body.vertices, body.tets, body.triangles, body.skin, material_from_text(body.material), i)
        for i, body in enumerate(recording.bodies)
    )
    tets = np.ascontiguousarray(recording.tets, dtype=np.int32)
    return Model(
        bodies,
        recording.obstacles,
        recording.rest_positions,
        tets,
        view_of(recording),
        recorded_stitches=recording.stitches,
    )


def moment_of_frame(model: Model, frame: RecordedFrame) -> Moment:
    """One frame of a recording."""
    return Moment(
        model,
        frame.time,
        frame.state.positions,
        frame.state.velocities,
        frame.obstacle_poses,
        pinned=frame.recording.pinned_vertices.astype(np.int64),
    )


def material_from_text(text: str) -> Material | None:
    """The material of a text such as "StableNeoHookean(youngs=1e4, ...)"; None where the text has another form.

    Only names of materials, plain numbers and the name of an integration are accepted: nothing in the text is executed.
    """
    try:
        call = ast.parse(text, mode="eval").body
        if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Name) or call.args:
            return None
        kind = _MATERIALS.get(call.func.id)
        if kind is None:
            return None
        values: dict[str, Any] = {str(item.arg): _value(str(item.arg), item.value) for item in call.keywords}
        return kind(**values)
    except (SyntaxError, ValueError, TypeError, RecursionError, MemoryError, SuppleError):
        return None


def _value(name: str, node: ast.expr) -> float | str:
    """A number, plain or as NumPy writes it: `np.float64(1.0)`; of `integration` a text."""
    if name == "integration":
        return str(ast.literal_eval(node))
    if isinstance(node, ast.Call) and len(node.args) == 1 and not node.keywords:
        node = node.args[0]
    value = ast.literal_eval(node)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError("not a number")
    return float(value)
