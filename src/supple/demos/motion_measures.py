"""Measures that several demos share: volumes and spins of bodies."""

from __future__ import annotations

import numpy as np

from supple.simulate import Frame
from supple.system import BodyRange


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
