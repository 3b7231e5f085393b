"""Grabs: springs that pull at a patch of the surface of a body."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from supple.errors import CommandError
from supple.scene.forces import SoftTarget
from supple.scene.scene import Scene
from supple.system import BodyRange
from supple.viewer.protocol import limits
from supple.viewer.protocol.commands import Grab
from supple.viewer.protocol.snapshots import GrabState

# A body that hangs on one spring oscillates at this frequency [Hz], or faster where it would sag by more than SAG of
# its diagonal.
FREQUENCY, SAG = 4.0, 0.05
# Radius of the patch, as a share of the diagonal of the body. A single vertex would be pulled out as a spike.
PATCH = 0.06


@dataclass(eq=False)
class GrabSpring:
    """One grab. The spring pulls at the point p = sum w_i x_i with k |target - p|, distributed equally to the patch.

    In every step each vertex of the patch is pulled towards x_i + (target - p), with x_i and p at the start of the
    step. So the force causes no torque about p, and the motion of the patch is slightly damped, as by a dashpot k dt.

    Attributes
    ----------
    command : the command that created it; target : (3,) its present target [m]
    patch : (k,) vertices of the body that it pulls at; stiffness : total [N/m]
    longest : largest distance over which it pulls [m]
    """

    command: Grab
    patch: NDArray[np.int32]
    stiffness: float
    longest: float
    target: NDArray[np.float64]
    soft_target: SoftTarget = field(init=False)
    _displacements: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        self._displacements = np.zeros((len(self.patch), 3))
        self.soft_target = SoftTarget(
            self.command.body,
            self.patch,
            self.stiffness / len(self.patch),
            lambda time: self._displacements,
            name=f"grab {self.command.grab}",
        )

    def point(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """(3,) the point to which the spring is attached, from the vertices (n, 3) of the body [m]."""
        return np.asarray(self.command.weights) @ positions[list(self.command.vertices)]

    def pull(self, positions: NDArray[np.float64], anchors: NDArray[np.float64]) -> None:
        """Set the displacements of the soft target for the next step.

        Parameters
        ----------
        positions : (n, 3) of the body [m]; anchors : (k, 3) of the soft target in the system [m]
        """
        way = self.target - self.point(positions)
        length = float(np.linalg.norm(way))
        if length > self.longest:
            way *= self.longest / length
        self._displacements = positions[self.patch] + way - anchors

    def state(self, positions: NDArray[np.float64]) -> GrabState:
        """The spring to draw, with the vertices (n, 3) of the body [m]."""
        point, target = self.point(positions).tolist(), self.target.tolist()
        return GrabState(self.command.grab, self.command.body, tuple(point), tuple(target))


def make_spring(
    command: Grab, scene: Scene, part: BodyRange, masses: NDArray[np.float64], positions: NDArray[np.float64]
) -> GrabSpring:
    """The spring of a grab.

    Parameters
    ----------
    part : rows of the body; masses : (n,) [kg] and positions : (n, 3) [m] of the whole system

    Raises
    ------
    CommandError : where the body has no such vertex.
    """
    mesh = part.body.mesh
    count = len(mesh.vertices)
    if max(command.vertices) >= count:
        raise CommandError(f"body {part.name!r} has no vertex {max(command.vertices)}; it has {count}")
    rest = mesh.vertices
    diagonal = float(np.linalg.norm(np.ptp(rest, axis=0)))
    center = np.asarray(command.weights) @ rest[list(command.vertices)]
    skin = np.unique(mesh.surface.triangles)
    near = skin[np.linalg.norm(rest[skin] - center, axis=1) <= PATCH * diagonal]
    patch = np.union1d(near, command.vertices).astype(np.int32)
    g = float(np.linalg.norm(np.asarray(scene.gravity)))
    squared = max((2.0 * math.pi * FREQUENCY) ** 2, g / (SAG * diagonal))
    stiffness = command.stiffness * float(masses[part.vertices].sum()) * squared
    size = float(np.linalg.norm(np.ptp(positions, axis=0)))
    return GrabSpring(command, patch, stiffness, limits.LONGEST_GRAB * size, np.array(command.target))
