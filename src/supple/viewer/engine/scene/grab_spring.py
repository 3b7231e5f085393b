"""Hands of the person at the page: springs that pull on a patch of a body's surface."""

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

# A body that hangs on one spring swings at this frequency [Hz], or faster where it would sag by more than SAG of its
# diagonal.
FREQUENCY, SAG = 4.0, 0.05
# Radius of the patch that is held, of the body's diagonal. One vertex alone would be pulled out as a spike.
PATCH = 0.06


@dataclass(eq=False)
class GrabSpring:
    """One grab. The spring pulls at the point p = sum w_i x_i with k |target - p|, shared equally by the patch.

    In every step each vertex of the patch is drawn towards x_i + (target - p), with x_i and p as the step begins. So
    the force turns with the body, no torque comes of it, and the motion of the patch is damped a little: like a spring
    with a dashpot of k dt.

    Attributes
    ----------
    command : what was asked for; target : where it pulls to now [m]
    patch : (k,) vertices of the body that are held; stiffness : of all of it [N/m]
    longest : how far the target may draw [m]
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
            self._motion,
            name=f"grab {self.command.grab}",
        )

    def _motion(self, time: float) -> NDArray[np.float64]:
        return self._displacements

    def point(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """(3,) where the spring is fastened, from the body's vertices (n, 3) [m]."""
        return np.asarray(self.command.weights) @ positions[list(self.command.vertices)]

    def pull(self, positions: NDArray[np.float64], anchors: NDArray[np.float64]) -> None:
        """Set the springs for the coming step.

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
        """The spring to draw, with the body's vertices (n, 3) [m]."""
        point, target = self.point(positions).tolist(), self.target.tolist()
        return GrabState(self.command.grab, self.command.body, tuple(point), tuple(target))


def make_spring(
    command: Grab, scene: Scene, part: BodyRange, masses: NDArray[np.float64], positions: NDArray[np.float64]
) -> GrabSpring:
    """The spring of a grab.

    Parameters
    ----------
    part : the body's rows; masses : (n,) [kg] and positions : (n, 3) [m] of the whole system

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
