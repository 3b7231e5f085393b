"""Seams of bodies stitched face to face: their triangles touch in the first frame, and may go on doing so."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.results.check.geometry.box_tree import build_tree, triangle_boxes
from supple.results.check.geometry.surface_pairs import meeting_pairs
from supple.results.check.surfaces import Surfaces
from supple.results.recording.reader import Recording


def seam_keys(recording: Recording, surfaces: Surfaces) -> NDArray[np.int64]:
    """Keys, as in `Surfaces.ignored`, of the pairs of triangles that meet in the first frame, belong to two things that
    are stitched to each other, and have a stitched corner."""
    stitched = surfaces.stitched
    frame = recording[0]
    if not len(stitched) or not np.isfinite(frame.state.positions).all() or not np.isfinite(frame.obstacle_poses).all():
        return np.zeros(0, dtype=np.int64)
    x, triangles, owners = (
        surfaces.place(frame.state.positions, frame.obstacle_poses),
        surfaces.triangles,
        surfaces.owners,
    )
    thing = np.full(len(x), -1)
    thing[triangles] = owners[:, None]
    joined = np.zeros_like(surfaces.allowed)
    ends = thing[stitched]
    for k in range(1, stitched.shape[1]):
        on_surface = (ends[:, 0] >= 0) & (ends[:, k] >= 0)
        joined[ends[on_surface, 0], ends[on_surface, k]] = True
    joined &= surfaces.allowed
    joined |= joined.T
    low, high = triangle_boxes(x, triangles)
    tree = low, high, *build_tree(low, high)
    pairs = np.zeros((0, 2), dtype=np.int64)
    # The first pass counts, the second one writes.
    for _ in range(2):
        found = meeting_pairs(x, triangles, owners, joined, surfaces.ignored, *tree, pairs)
        pairs = np.zeros((found, 2), dtype=np.int64) if len(pairs) < found else pairs
    has_stitch = np.asarray(np.isin(triangles, stitched).any(axis=1))
    pairs = np.sort(pairs[has_stitch[pairs].any(axis=1)], axis=1)
    return pairs[:, 0] * len(triangles) + pairs[:, 1]
