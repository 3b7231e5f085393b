"""Measures that several demos share: volumes and spins of bodies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.simulate import Frame
from supple.system import BodyRange


def body_range(frame: Frame, name: str) -> BodyRange:
    """Which rows of the frame's flat arrays belong to that body."""
    return next(part for part in frame.system.bodies if part.name == name)


def volume(frame: Frame, name: str) -> float:
    """Volume of a body [m^3]."""
    part = body_range(frame, name)
    return float(frame.det_F[part.tets] @ frame.system.rest_volumes[part.tets])


def spin(frame: Frame, name: str) -> NDArray[np.float64]:
    """Angular velocity (3,) [rad/s] of the rigid body of the same inertia and angular momentum."""
    part = body_range(frame, name)
    m = frame.system.masses[part.vertices]
    x, v = frame.positions[name], frame.velocities[name]
    r = x - m @ x / m.sum()
    u = v - m @ v / m.sum()
    L = m @ np.cross(r, u)
    inertia = np.einsum("i,ij,ij->", m, r, r) * np.eye(3) - np.einsum("i,ij,ik->jk", m, r, r)
    return np.linalg.solve(inertia, L)
