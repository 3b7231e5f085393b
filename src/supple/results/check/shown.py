"""The place of the first failure: the surfaces of its frame, and a picture of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.results.check.report import CheckResult
from supple.results.check.trajectory import Trajectory
from supple.results.view.look import body_color
from supple.runtime.figures import paper_figure

# Of failures in the same frame, the first of these is shown.
_ORDER = ("inversion", "intersection", "tunnelling", "distance", "containment", "volume")
_TET_FACETS = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
_MOST_TRIANGLES = 30_000
_RED = (0.85, 0.1, 0.12)
# How far around what is at fault the second view reaches, in its sizes; at least this share of everything.
_AROUND, _LEAST = 1.8, 0.04
_LIGHT = np.array([0.35, 0.25, 0.9])


@dataclass(frozen=True, eq=False)
class Place:
    """What is drawn.

    Attributes
    ----------
    title : one line; frame : its number
    points : (n, 3); triangles : (t, 3) of all surfaces; owners : (t,) the numbers of their bodies and obstacles
    marked : (k, 3) triangles at fault, and facets of tets at fault
    up : the axis that points up in the picture
    """

    title: str
    frame: int
    points: NDArray[np.float64]
    triangles: NDArray[np.int64]
    owners: NDArray[np.int64]
    marked: NDArray[np.int64]
    up: int


def place_of(of: Trajectory, failures: Sequence[CheckResult]) -> Place | None:
    """The worst frame of the most informative failure; None where no failure belongs to a frame that can be drawn."""
    rank = {name: k for k, name in enumerate(_ORDER)}
    for result in sorted(failures, key=lambda result: rank.get(result.name, len(rank))):
        if result.frame is None:
            continue
        at = of.snapshot(result.frame)
        if not at.finite:
            continue
        surfaces = of.surfaces
        marked = np.zeros((0, 3), dtype=np.int64)
        if result.name == "inversion":
            marked = of.tets[at.signs <= 0].astype(np.int64)[:, _TET_FACETS].reshape(-1, 3)
        elif result.name in ("intersection", "distance"):
            marked = surfaces.triangles[np.unique(at.meeting[1])]
        elif result.name == "tunnelling" and result.frame > 0:
            before = of.snapshot(result.frame - 1)
            if before.finite:
                marked = surfaces.triangles[np.unique(surfaces.pairs(before.tree, before.points, at.points)[1])]
        gravity = np.abs(of.gravity)
        up = int(np.argmax(gravity)) if gravity.any() else 2 if "files" in of.knows else 1
        text = f"{result.name} in frame {result.frame}: {result.message}"
        return Place(text, result.frame, at.points[:-2], surfaces.triangles, surfaces.owners, marked, up)
    return None


def draw(place: Place, output: Path) -> Path:
    """Write a PNG, PDF or SVG file.

    Raises
    ------
    OutputError : where it cannot be written.
    """
    with paper_figure(output, 10.0, 5.4) as figure:
        corners = place.points[place.marked.ravel()]
        views = [(place.points[np.unique(place.triangles)], 1.0)]
        if len(corners):
            views.append((corners, _AROUND))
        whole = float(np.ptp(views[0][0], axis=0).max())
        for k, (points, factor) in enumerate(views):
            low, high = points.min(axis=0), points.max(axis=0)
            reach = 0.5 * factor * max(float((high - low).max()), _LEAST * whole if k else 0.0)
            axes = figure.add_subplot(1, len(views), k + 1)
            _view(axes, place, 0.5 * (low + high), reach, bool(k))
        figure.suptitle(fill(place.title, 110), fontsize=10)
    return output


def _view(axes: Any, place: Place, center: NDArray[np.float64], reach: float, close: bool) -> None:
    from matplotlib.collections import PolyCollection

    flat = _projected(place.points - center, place.up)
    shown = place.triangles
    middles = place.points[shown].mean(axis=1)
    near = (np.abs(middles - center) <= 1.5 * reach).all(axis=1)
    # Without those in front of the place, which would hide it.
    if close:
        depth = flat[shown, 2].mean(axis=1)
        near &= depth <= flat[place.marked.ravel(), 2].max() + 0.1 * reach
    rows = np.flatnonzero(near)
    rows = rows[:: max(1, len(rows) // _MOST_TRIANGLES)]
    triangles = np.concatenate([shown[rows], place.marked])
    is_marked = np.arange(len(triangles)) >= len(rows)
    corner, first, second = flat[triangles].transpose(1, 0, 2)
    normals = np.cross(first - corner, second - corner)
    lengths = np.linalg.norm(normals, axis=1)
    light = np.abs(normals @ (_LIGHT / np.linalg.norm(_LIGHT))) / np.where(lengths > 0.0, lengths, 1.0)
    owners = np.concatenate([place.owners[rows], np.zeros(len(place.marked), dtype=np.int64)])
    base = np.array([body_color(int(k)) for k in range(int(owners.max(initial=0)) + 1)])[owners] / 255.0
    base[is_marked] = _RED
    colors = np.column_stack([base * (0.55 + 0.45 * light)[:, None], np.where(is_marked, 1.0, 0.55 if close else 0.8)])
    order = np.lexsort([flat[triangles, 2].mean(axis=1), is_marked])
    edges = np.where(is_marked, "#5a0008", "#00000030")[order] if len(order) < 4000 else "none"
    axes.add_collection(
        PolyCollection(list(flat[triangles[order], :2]), facecolors=colors[order], edgecolors=edges, linewidths=0.4)
    )
    seen = np.array([[-reach, -reach], [reach, reach]]) if close else flat[np.unique(shown), :2]
    low, high = seen.min(axis=0), seen.max(axis=0)
    middle, width = 0.5 * (low + high), 0.55 * float((high - low).max())
    axes.set_xlim(middle[0] - width, middle[0] + width)
    axes.set_ylim(middle[1] - width, middle[1] + width)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title("the place" if close else f"frame {place.frame}", fontsize=10)


def _projected(x: NDArray[np.float64], up: int) -> NDArray[np.float64]:
    """(n, 3) across, above and towards the viewer, who looks down on a corner."""
    turned = x[:, [(up + 1) % 3, (up + 2) % 3, up]]
    a, b = np.radians(35.0), np.radians(22.0)
    across = np.cos(a) * turned[:, 0] + np.sin(a) * turned[:, 1]
    ahead = -np.sin(a) * turned[:, 0] + np.cos(a) * turned[:, 1]
    above = np.cos(b) * turned[:, 2] + np.sin(b) * ahead
    return np.column_stack([across, above, np.sin(b) * turned[:, 2] - np.cos(b) * ahead])
