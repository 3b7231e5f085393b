"""The place of the first failure: the surfaces of its frame, with the triangles and tets that are at fault."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.results.check.checks.tunnelling import passing_between
from supple.results.check.report import CheckResult
from supple.results.check.snapshot import Scene

# Of failures in the same frame, the first of these is shown.
_ORDER = ("inversion", "intersection", "tunnelling", "distance", "containment", "volume")
_TET_FACETS = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


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


def place_of(scene: Scene, failures: Sequence[CheckResult]) -> Place | None:
    """The worst frame of the most telling failure, or None where no failure belongs to a frame that can be drawn."""
    rank = {name: k for k, name in enumerate(_ORDER)}
    for result in sorted(failures, key=lambda result: rank.get(result.name, len(rank))):
        if result.frame is None:
            continue
        at = scene.snapshot(result.frame)
        if not at.finite:
            continue
        surfaces = scene.surfaces
        marked = np.zeros((0, 3), dtype=np.int64)
        if result.name == "inversion":
            marked = scene.recording.tets[at.signs <= 0].astype(np.int64)[:, _TET_FACETS].reshape(-1, 3)
        elif result.name in ("intersection", "distance"):
            marked = surfaces.triangles[np.unique(at.meeting[1])]
        elif result.name == "tunnelling" and result.frame > 0:
            before = scene.snapshot(result.frame - 1)
            if before.finite:
                marked = surfaces.triangles[np.unique(passing_between(before, at.points)[1])]
        gravity = np.abs(scene.recording.gravity)
        up = int(np.argmax(gravity)) if gravity.any() else 2 if "files" in scene.recording.knows else 1
        text = f"{result.name} in frame {result.frame}: {result.message}"
        return Place(text, result.frame, at.points[:-2], surfaces.triangles, surfaces.owners, marked, up)
    return None
