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
_ELEVATION, _AZIMUTH = 22.0, 35.0  # from where it is seen [degrees]


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
            axes = figure.add_subplot(1, len(views), k + 1, projection="3d", computed_zorder=False)
            _view(axes, place, 0.5 * (low + high), reach, bool(k))
        figure.suptitle(fill(place.title, 110), fontsize=10)
    return output


def _view(axes: Any, place: Place, center: NDArray[np.float64], reach: float, close: bool) -> None:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    axes.set_proj_type("ortho")
    axes.view_init(_ELEVATION, _AZIMUTH, vertical_axis="xyz"[place.up])
    middles = place.points[place.triangles].mean(axis=1)
    near = (np.abs(middles - center) <= 1.5 * reach).all(axis=1)
    if close:  # without those in front of the place, which would hide it
        a, b = np.radians([_ELEVATION, _AZIMUTH])
        towards = np.roll([np.cos(a) * np.cos(b), np.cos(a) * np.sin(b), np.sin(a)], place.up - 2)
        near &= middles @ towards <= (place.points[place.marked.ravel()] @ towards).max() + 0.1 * reach
    rows = np.flatnonzero(near)
    rows = rows[:: max(1, len(rows) // _MOST_TRIANGLES)]
    base = np.array([body_color(int(k)) for k in range(int(place.owners.max(initial=0)) + 1)]) / 255.0
    colors = np.column_stack([base[place.owners[rows]], np.full(len(rows), 0.55 if close else 0.8)])
    lines: dict[str, Any] = {"edgecolors": "#00000030" if len(rows) < 4000 else "none", "linewidths": 0.4}
    axes.add_collection3d(Poly3DCollection(place.points[place.triangles[rows]], facecolors=colors, shade=True, **lines))
    if len(place.marked):
        marked: dict[str, Any] = {"facecolors": _RED, "edgecolors": "#5a0008", "linewidths": 0.4, "zorder": 9}
        axes.add_collection3d(Poly3DCollection(place.points[place.marked], **marked))
    for set_limits, middle in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), center, strict=True):
        set_limits(middle - reach, middle + reach)
    axes.set_box_aspect((1, 1, 1), zoom=1.5)
    axes.set_axis_off()
    axes.set_title("the place" if close else f"frame {place.frame}", fontsize=10)
