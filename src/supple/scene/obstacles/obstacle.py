"""The interface of obstacles. A kind is one class in one file, and one line in `registry`.

An obstacle is a solid, a container with a convex inside, or a mesh of triangles. Its shape is given where it is at
time 0; `motion` moves it from there (see `supple.scene.motion`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.kinds.kind import Kind
from supple.kinds.validators import NON_NEGATIVE, Name
from supple.mesh.surface import SurfaceMesh
from supple.scene.motion import Motion, MotionValidator, rigid_pose
from supple.scene.obstacles.shape import Shape


@dataclass(frozen=True, eq=False, kw_only=True)
class Obstacle(Kind, ABC):
    """Base of all obstacles.

    Parameters
    ----------
    friction : Coulomb coefficient between this obstacle and every body.
    motion : None, Keyframes, or t -> displacement (3,) [m].
    name : optional; appears in messages and exports. A scene names unnamed obstacles by kind and number.

    Raises
    ------
    SceneError : where a value is of the wrong kind, not finite or out of range; the text names the obstacle.
    """

    friction: Annotated[float, NON_NEGATIVE] = 0.0
    motion: Annotated[Motion, MotionValidator()] = None
    name: Annotated[str | None, Name()] = None

    title: ClassVar[str] = "obstacle"

    @property
    def label(self) -> str:
        """The name of this obstacle in messages."""
        return f"obstacle {self.name!r}" if self.name else type(self).__name__

    def pose(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rotation (3, 3) and translation (3,) [m] from where it is at time 0 to where it is at `time` [s]."""
        return rigid_pose(self.motion, time, self.label)

    def carried(self, points: NDArray[np.float64], begin: float, end: float) -> NDArray[np.float64]:
        """Where points (k, 3) that move with the obstacle from `begin` to `end` [s] arrive [m].

        Divided by the time between, their displacement is the mean velocity of the obstacle at these points.
        """
        if self.motion is None:
            return points
        (R0, t0), (R1, t1) = self.pose(begin), self.pose(end)
        return (points - t0) @ R0 @ R1.T + t1

    @property
    def is_container(self) -> bool:
        """Whether it keeps bodies in."""
        return bool(getattr(self, "inside", False))

    @property
    def plane(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """A point [m] and the unit normal (3,), (3,) of a half-space at time 0; None for what is bounded."""
        return None

    @property
    def surface_mesh(self) -> SurfaceMesh | None:
        """The triangles of an obstacle that consists of triangles, which can be stitched to; None for others."""
        return None

    @cached_property
    def contact_mesh(self) -> SurfaceMesh | None:
        """The triangles, at time 0, that XPBD keeps apart from those of bodies; None for containers and half-spaces."""
        if self.surface_mesh is not None or self.is_container or self.plane is not None:
            return self.surface_mesh
        return SurfaceMesh(*self.triangles())

    @cached_property
    def center(self) -> NDArray[np.float64]:
        """(3,) at time 0: a point of the plane of a half-space, otherwise the mean of the corners [m]."""
        return self.triangles()[0].mean(axis=0) if self.plane is None else self.plane[0]

    @property
    def checked_by_triangles(self) -> bool:
        """Whether checks compare bodies with `triangles`: the surface, or one about a solid that is not convex."""
        return self.surface_mesh is not None

    @abstractmethod
    def signed_distance(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Distances (k,) [m] of points (k, 3) at time 0, below zero in the solid, and normals (k, 3) out of it.

        The checker and the live page use it. It does not share code with `shapes`, which XPBD uses.
        """

    @abstractmethod
    def triangles(self) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
        """Vertices (k, 3) [m] at time 0 and triangles (t, 3), facing outwards: the surface that Implicit and pages use.

        A polyhedron about a round solid; one inside of a round container. So bodies never cross the true surface.
        """

    def drawn(self, center: NDArray[np.float64], reach: float) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
        """Vertices and triangles to draw; an unbounded surface is cut at about `reach` [m] from `center` (3,)."""
        return self.triangles()

    def shapes(self) -> tuple[Shape, ...]:
        """Shapes for XPBD of what keeps bodies in, or is not bounded; none for an obstacle with a `contact_mesh`."""
        return ()

    def _oriented(
        self, distances: NDArray[np.float64], normals: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Distance and normal of the solid, or of the container with the same wall."""
        return (-distances, -normals) if self.is_container else (distances, normals)


def lengths_and_directions(
    vectors: NDArray[np.float64], otherwise: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lengths (k,) and unit vectors (k, 3) of vectors (k, 3); `otherwise` (3,) for those without a length."""
    lengths = np.linalg.norm(vectors, axis=1)
    safe = np.where(lengths > 0.0, lengths, 1.0)[:, None]
    return lengths, np.where(lengths[:, None] > 0.0, vectors / safe, otherwise)


def distances_from_corner(beyond: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Signed distances (k,) of points beyond (k, m) from the solid where all coordinates are below 0, and normals."""
    outside = np.maximum(beyond, 0.0)
    distances, normals = lengths_and_directions(outside, np.zeros(beyond.shape[1]))
    inside = distances == 0.0
    normals[inside] = np.eye(beyond.shape[1])[beyond[inside].argmax(axis=1)]
    return np.where(inside, beyond.max(axis=1), distances), normals
