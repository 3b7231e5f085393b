"""Rigid things that bodies collide with: half-space, box, sphere and triangle mesh; static or scripted.

An obstacle's shape is given where it is at time 0; `motion` carries it from there (see `supple.scene.motion`).
"""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.mesh.surface import SurfaceMesh
from supple.scene.motion import Motion, check_motion, rigid_pose
from supple.scene.rotation import rotation_matrix
from supple.scene.values import check_name, finite_vector, non_negative, positive


@dataclass(frozen=True, eq=False, kw_only=True)
class Obstacle(ABC):  # noqa: B024 (solvers look at what is inside; nothing is asked of all alike)
    """What all obstacles share.

    Parameters
    ----------
    friction : Coulomb coefficient between this obstacle and every body.
    motion : None, Keyframes, or t -> displacement (3,) [m].
    name : optional; stands in messages and exports. A scene names the unnamed ones by kind and number.
    """

    friction: float = 0.0
    motion: Motion = None
    name: str | None = None

    def __post_init__(self) -> None:
        if self.name is not None:
            check_name(self.name, "obstacle")
        object.__setattr__(self, "friction", non_negative(self.friction, f"{self.label}: friction"))
        check_motion(self.motion, self.label)

    @property
    def label(self) -> str:
        """How messages call this obstacle."""
        return f"obstacle {self.name!r}" if self.name else type(self).__name__

    def pose(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rotation (3, 3) and translation (3,) [m] from where it is at time 0 to where it is at `time` [s]."""
        return rigid_pose(self.motion, time, self.label)


@dataclass(frozen=True, eq=False)
class HalfSpace(Obstacle):
    """Everything behind a plane: points p with (p - point) . normal < 0.

    Parameters
    ----------
    point : (3,) a point of the plane [m]; normal : (3,) out of the solid, towards the free side.
    """

    point: ArrayLike = (0.0, 0.0, 0.0)
    normal: ArrayLike = (0.0, 1.0, 0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "point", finite_vector(self.point, f"{self.label}: point"))
        normal = finite_vector(self.normal, f"{self.label}: normal", nonzero=True)
        object.__setattr__(self, "normal", normal / np.linalg.norm(normal))


@dataclass(frozen=True, eq=False)
class Box(Obstacle):
    """A solid box, or with `inside=True` a room that keeps bodies in.

    Parameters
    ----------
    center : (3,) [m]; size : (3,) full edge lengths [m]; rotation : (3,) rotation vector about the center [rad].
    inside : True where bodies live inside the box.
    """

    center: ArrayLike = (0.0, 0.0, 0.0)
    size: ArrayLike = (1.0, 1.0, 1.0)
    rotation: ArrayLike = (0.0, 0.0, 0.0)
    inside: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        for key in ("center", "size", "rotation"):
            object.__setattr__(self, key, finite_vector(getattr(self, key), f"{self.label}: {key}"))
        if np.any(np.asarray(self.size) <= 0.0):
            raise SceneError(f"{self.label}: size is {np.asarray(self.size).tolist()}; every edge must be above zero")

    @property
    def orientation(self) -> NDArray[np.float64]:
        """(3, 3) rotation from the box's own axes to the world's, at time 0."""
        return rotation_matrix(self.rotation)


@dataclass(frozen=True, eq=False)
class Sphere(Obstacle):
    """A solid ball, or with `inside=True` a bowl that keeps bodies in.

    Parameters
    ----------
    center : (3,) [m]; radius : [m]; inside : True where bodies live inside the sphere.
    """

    center: ArrayLike = (0.0, 0.0, 0.0)
    radius: float = 1.0
    inside: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "center", finite_vector(self.center, f"{self.label}: center"))
        object.__setattr__(self, "radius", positive(self.radius, f"{self.label}: radius"))


@dataclass(frozen=True, eq=False)
class TriangleObstacle(Obstacle):
    """A rigid triangle mesh. A closed one is solid; an open one is a two-sided sheet.

    Parameters
    ----------
    surface : the triangles, where they are at time 0 [m].
    """

    surface: SurfaceMesh | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.surface, SurfaceMesh):
            raise SceneError(f"{self.label}: surface is {self.surface!r}; give a SurfaceMesh")
