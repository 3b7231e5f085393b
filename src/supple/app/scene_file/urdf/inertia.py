"""Inertia of links as a rigid body can have it.

The second moment S = tr(I) / 2 1 - I of a solid has three eigenvalues above zero: the moments of inertia are then above
zero, and no one is larger than the sum of the two others. Many robots' files have others by rounding, by rods and
plates without thickness, or by mistake. The nearest S with eigenvalues of at least a share of the largest is used.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.app.scene_file.urdf.robot import Geometry, Inertia, Placement

# Below this share of the largest, an eigenvalue is zero up to round-off.
_ROUND_OFF = 1e-9
# What it then becomes: the solid is a hundredth as thick as it is long.
_THIN = 1e-4


# A radius of gyration below a micrometre counts as zero [m^2].
_NO_SIZE = 1e-12
DENSITY = 1000.0  # of what has no mass, or no inertia [kg/m^3]


def projected(given: Inertia) -> NDArray[np.float64] | None:
    """The nearest inertia tensor (3, 3) that a solid has; its own where it is one, None where it is zero, or below."""
    tensor = given.tensor
    squares, axes = np.linalg.eigh(0.5 * np.trace(tensor) * np.eye(3) - tensor)
    if squares[2] <= _NO_SIZE * given.mass:
        return None
    if squares[0] > _ROUND_OFF * squares[2]:
        return tensor
    squares = np.maximum(squares, _THIN * squares[2])
    return squares.sum() * np.eye(3) - (axes * squares) @ axes.T


def of_ball(mass: float) -> NDArray[np.float64]:
    """(3, 3) of a ball of `DENSITY` [kg m^2]."""
    radius = (3.0 * mass / (4.0 * np.pi * DENSITY)) ** (1.0 / 3.0)
    return 0.4 * mass * radius**2 * np.eye(3)


def box_of(inertia: Inertia) -> Geometry:
    """The box with the same inertia, for a link without collision geometry."""
    squares, axes = np.linalg.eigh(0.5 * np.trace(inertia.tensor) * np.eye(3) - inertia.tensor)
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    sides = np.sqrt(12.0 / inertia.mass * squares)
    return Geometry("box", tuple(sides.tolist()), inertia.placement.then(Placement(axes)))
