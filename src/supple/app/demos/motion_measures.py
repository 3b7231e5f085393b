"""Measures that several demos share."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.system import BodyRange
from supple.results.frame import Frame


def body_range(frame: Frame, name: str) -> BodyRange:
    """The rows of the frame's flat arrays that belong to that body."""
    return next(part for part in frame.system.bodies if part.name == name)


def volume(frame: Frame, name: str) -> float:
    """Volume of a body [m^3]."""
    part = body_range(frame, name)
    return float(frame.det_F[part.tets] @ frame.system.rest_volumes[part.tets])


def spin_about(frame: Frame, name: str, axis: int) -> float:
    """Angular momentum over moment of inertia, about a coordinate axis through the center of mass [rad/s]."""
    part = body_range(frame, name)
    m = frame.system.masses[part.vertices]
    x, v = frame.positions[name], frame.velocities[name]
    r = x - m @ x / m.sum()
    L = m @ np.cross(r, v - m @ v / m.sum())
    across = np.delete(r, axis, axis=1)
    return float(L[axis] / (m @ np.einsum("ij,ij->i", across, across)))


def pin_error(frame: Frame) -> float:
    """The largest distance of a pinned vertex from where its motion puts it, along one axis [m]."""
    off = frame.state.positions[frame.system.pinned_vertices] - frame.system.pin_targets(frame.time)
    return float(np.abs(off).max())


def height(frame: Frame, name: str) -> float:
    """The vertical extent of a body [m]."""
    return float(np.ptp(frame.positions[name][:, 1]))


def stitch_lengths(frame: Frame) -> NDArray[np.float64]:
    """(k,) distances from stitched vertices to the centers of the triangles that they are stitched to [m]."""
    x, nodes = frame.state.positions, frame.system.stitching.tets.vertices
    return np.linalg.norm(x[nodes[:, 0]] - x[nodes[:, 1:]].mean(axis=1), axis=1)
