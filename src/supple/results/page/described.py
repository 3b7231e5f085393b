"""What the client of the page draws: parts that follow points, and how these points move."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.results.page.packed import Packer, differences, quantized
from supple.results.view.beside import Beside
from supple.results.view.bounds import floor_height
from supple.results.view.camera import direction_of
from supple.results.view.fields import FIELDS, Field, Limits, Range, color_map, nodal_values
from supple.results.view.joints import Sides, joint_segments, lines_of_joints
from supple.results.view.look import drawn_as
from supple.results.view.model import Model, RenderFrame
from supple.results.view.skin_contact import distance_grid
from supple.results.view.surfaces import (
    SKIN_GAP,
    STRETCH,
    RigidSurface,
    SoftSurface,
    Surface,
    boundary_surface,
    obstacle_surfaces,
)
from supple.scene.rows import BodyRows

_VIEWS = {"fit": "corner", "front": "front", "side": "side", "top": "top"}


def described_scene(model: Model, packer: Packer) -> dict[str, Any]:
    """What no frame changes: the parts of the picture, tets, camera and floor."""
    view = model.view
    return {
        "up": view.up.tolist(),
        "center": view.center.tolist(),
        "radius": view.radius,
        "outline": packer.add(view.outline, "f4"),
        "views": {name: direction_of(preset, view).tolist() for name, preset in _VIEWS.items()},
        "gap": SKIN_GAP * view.radius,
        "floor": floor_height(view, model.obstacles),
        "bodies": [_body(model, body, packer) for body in model.bodies],
        "tets": packer.add(model.tets, "u4"),
    }


def _body(model: Model, body: BodyRows, packer: Packer) -> dict[str, Any]:
    """Its vertices among the points, and its surface; also of a rigid body, the surface follows its four points."""
    if body.skin is None:
        whole = boundary_surface(body)
    else:
        rows = np.arange(len(body.skin.corners))
        whole = SoftSurface(body.name, body.skin.triangles, *drawn_as(body), body, True, rows)
    surface = whole.creased(model)
    corners, weights = surface.rows[:, None], np.ones((len(surface.rows), 1))
    if body.skin is not None:
        corners, weights = body.skin.corners[surface.rows], body.skin.weights[surface.rows]
    beyond = model.beyond_tets.get(body.name)
    outside, reach = (np.zeros(0), 0.0) if beyond is None else (beyond[0][surface.rows], beyond[1])
    # The last weight is what the others lack to one, so that rounded ones still move with the body.
    kept = np.ascontiguousarray(weights[:, :-1])
    step = max(float(np.abs(kept).max(initial=0.0)), 1e-30) / 32767.0
    return {
        **_triangles(surface, packer),
        "look": body.body.drawn_look,
        "first": body.vertices.start,
        "count": body.vertices.stop - body.vertices.start,
        "tets": [body.tets.start, 0 if body.rigid else body.tets.stop - body.tets.start],
        "order": weights.shape[1],
        "corners": packer.add(corners, "u2" if corners.max(initial=0) < 65536 else "u4"),
        "weights": packer.add(np.round(kept / step), "i2"),
        "step": step,
        "rest": packer.add(surface.at_rest(model), "f4"),
        "closed": whole.hides_its_backs(model),
        "beside": None if surface.beside is None else _beside(surface.beside, packer),
        "outside": packer.add(outside, "u1"),
        "reach": STRETCH * reach,
    }


def _beside(beside: Beside, packer: Packer) -> dict[str, Any]:
    kind = "u2" if beside.cells.max(initial=0) < 65535 else "u4"
    return {"axes": beside.axes, "cells": packer.add(beside.cells, kind), "away": packer.add(beside.away, "f4")}


def _triangles(surface: Surface, packer: Packer) -> dict[str, Any]:
    triangles = surface.triangles
    kind = "u2" if triangles.max(initial=0) < 65535 else "u4"
    return {"name": surface.name, "color": list(surface.color), "triangles": packer.add(triangles, kind)}


def described_motion(frames: Sequence[tuple[float, RenderFrame]], packer: Packer) -> dict[str, Any]:
    """What changes: points, poses of obstacles, and fields; of at least one frame, each with its time [s]."""
    model, first = frames[0][1].model, frames[0][1]
    lines = lines_of_joints(model)
    x = np.array([points_of(frame, lines) for _, frame in frames])
    n, ends = len(first.positions), 2 * len(model.stitches)
    groups = [(body.vertices.start, body.vertices.stop) for body in model.bodies]
    groups += [(low, high) for low, high in ((n, n + ends), (n + ends, x.shape[1])) if high > low]
    steps, described = np.empty((len(frames), 3, x.shape[1]), dtype=np.uint16), []
    for low, high in groups:
        whole, corner, step = quantized(x[:, low:high])
        steps[:, :, low:high] = whole.transpose(0, 2, 1)
        described.append({"first": low, "count": high - low, "low": corner, "step": step})
    return {
        "times": packer.add([time for time, _ in frames], "f8"),
        "points": x.shape[1],
        "groups": described,
        "motion": packer.add(differences(steps), "u1"),
        "stitches": [n, ends],
        "joints": [n + ends, x.shape[1] - n - ends],
        "pins": packer.add(first.pinned, "u4"),
        "obstacles": [_obstacle(frames, surface, packer) for surface in obstacle_surfaces(model)],
        "fields": [one for field in FIELDS.values() if (one := _field(frames, field, packer))],
    }


def points_of(frame: RenderFrame, lines: list[Sides]) -> NDArray[np.float64]:
    """(n + ..., 3) vertices, then ends of stitches and of the lines of joints [m]."""
    joints = joint_segments(frame, lines) if lines else np.zeros((0, 2, 3))
    more = np.concatenate([frame.stitch_segments, joints]).reshape(-1, 3)
    return np.concatenate([frame.finite_positions, np.nan_to_num(more)])


def _obstacle(frames: Sequence[tuple[float, RenderFrame]], surface: RigidSurface, packer: Packer) -> dict[str, Any]:
    model = frames[0][1].model
    poses = np.nan_to_num([surface.pose(frame) for _, frame in frames])
    moves = bool((poses != poses[0]).any())
    creased = surface.creased(model)
    return {
        **_triangles(creased, packer),
        "vertices": packer.add(creased.vertices, "f4"),
        "poses": packer.add(poses if moves else poses[:1], "f4"),
        "opacity": surface.opacity,
        "container": surface.container,
        "casts": surface.casts_shadow,
        "isFloor": surface.is_floor and not moves,
        "solid": _solid(model, surface, moves, packer),
    }


def _solid(model: Model, surface: RigidSurface, moves: bool, packer: Packer) -> dict[str, Any] | None:
    """The distance from an obstacle, for skins that reach beyond tets; see `distance_grid`."""
    obstacle, view = surface.obstacle, model.view
    reach = max((STRETCH * reach for _, reach in model.beyond_tets.values()), default=0.0)
    if obstacle is None or obstacle.checked_by_triangles or reach == 0.0:
        return None
    low, high = surface.vertices.min(axis=0) - reach, surface.vertices.max(axis=0) + reach
    if not moves:  # only what is seen matters
        low, high = np.maximum(low, view.center - 2.5 * view.radius), np.minimum(high, view.center + 2.5 * view.radius)
    step, distances = distance_grid(obstacle, low, high)
    unit = max(float(np.abs(distances).max()), 1e-30) / 32767.0
    values = packer.add(np.round(distances / unit), "i2")
    return {"low": low.tolist(), "step": step.tolist(), "n": len(distances), "unit": unit, "values": values}


def _field(frames: Sequence[tuple[float, RenderFrame]], field: Field, packer: Packer) -> dict[str, Any] | None:
    """A field at the vertices, in 256 steps of a scale that suits all frames; None where no value is known."""
    of_tets = [field.values(frame) for _, frame in frames]
    at_vertices = [nodal_values(frame, own) for (_, frame), own in zip(frames, of_tets, strict=True)]
    return described_values(field, np.concatenate(of_tets), at_vertices, packer)


def described_values(
    field: Field, known: NDArray[np.float64], at_vertices: Sequence[NDArray[np.float64]], packer: Packer
) -> dict[str, Any] | None:
    """The same of values (n,) of each frame, on a scale that suits `known` (k,)."""
    ends = Limits(field, Range()).follow(known)
    if ends is None:
        return None
    share = np.clip((np.array(at_vertices) - ends[0]) / (ends[1] - ends[0]), 0.0, 1.0)
    return {
        "name": field.name,
        "unit": field.unit,
        "ends": list(ends),
        "colors": color_map(field),
        "values": packer.add(differences(np.round(255.0 * share).astype(np.uint8)), "u1"),
    }
