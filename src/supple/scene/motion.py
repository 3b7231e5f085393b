"""Scripted motion: none, keyframes, or a function of time.

A motion displaces points from their positions at time 0. Keyframes can also rotate them; a function of time
returns a displacement, one for all points (3,) or one for each (k, 3).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from supple.errors import SceneError
from supple.kinds.checks import float_array
from supple.kinds.kind import Kind
from supple.kinds.validators import NUMBERS, VECTORS, Direction, Validator, Vector
from supple.scene.rotation import rotation_matrix


@dataclass(frozen=True, eq=False)
class Keyframes(Kind):
    """Piecewise linear motion through keyframes; constant before the first and after the last.

    Parameters
    ----------
    times : (k,) strictly increasing [s]
    displacements : (k, 3) [m], or None for no translation
    angles : (k,) [rad] about one axis, or None; they may count whole turns
    axis, pivot : (3,) axis of the rotation: through `pivot` [m] along `axis`
    rotations : (k, 3) instead of angles: rotation vectors about `pivot` [rad]. From one keyframe to the next, the
        shortest rotation is taken at constant rate (Shoemake, "Animating rotation with quaternion curves", 1985).

    Raises
    ------
    SceneError : where shapes disagree, times do not increase, or a value is not finite.
    """

    kind: ClassVar[str] = "keyframes"
    title: ClassVar[str] = "Keyframes"

    times: Annotated[ArrayLike, NUMBERS]
    displacements: Annotated[ArrayLike | None, VECTORS] = None
    angles: Annotated[ArrayLike | None, NUMBERS] = None
    axis: Annotated[ArrayLike, Direction()] = (0.0, 0.0, 1.0)
    pivot: Annotated[ArrayLike, Vector()] = (0.0, 0.0, 0.0)
    rotations: Annotated[ArrayLike | None, VECTORS] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        times = self._array("times", self.times, (-1,))
        k = len(times)
        if k == 0:
            raise SceneError("Keyframes: times is empty; give at least one keyframe")
        if np.any(np.diff(times) <= 0.0):
            at = int(np.flatnonzero(np.diff(times) <= 0.0)[0]) + 1
            raise SceneError(f"Keyframes: times[{at}] = {times[at]:g} s does not come after {times[at - 1]:g} s")
        if self.displacements is None and self.angles is None and self.rotations is None:
            raise SceneError("Keyframes: give displacements, angles, or both")
        if self.angles is not None and self.rotations is not None:
            raise SceneError("Keyframes: angles and rotations are both given; give one of them")
        displacements = np.zeros((k, 3)) if self.displacements is None else self.displacements
        object.__setattr__(self, "displacements", self._array("displacements", displacements, (k, 3)))
        if self.rotations is None:
            angles = np.zeros(k) if self.angles is None else self.angles
            object.__setattr__(self, "angles", self._array("angles", angles, (k,)))
        else:
            self._array("rotations", self.rotations, (k, 3))

    @staticmethod
    def _array(name: str, value: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float64]:
        array = np.asarray(value, dtype=np.float64)
        if array.ndim != len(shape) or any(want not in (-1, got) for want, got in zip(shape, array.shape, strict=True)):
            want = tuple("k" if s == -1 else s for s in shape)
            raise SceneError(f"Keyframes: {name} has shape {array.shape}; it must have shape {want}, one per keyframe")
        if not np.isfinite(array).all():
            raise SceneError(f"Keyframes: {name} holds a value that is not finite")
        return array

    def pose(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rotation (3, 3) and translation (3,) [m] at `time`: x -> R x + t."""
        times, displacements, pivot = np.asarray(self.times), np.asarray(self.displacements), np.asarray(self.pivot)
        shift = np.array([np.interp(time, times, displacements[:, k]) for k in range(3)])
        R = self._rotation(time)
        return R, pivot - R @ pivot + shift

    def _rotation(self, time: float) -> NDArray[np.float64]:
        times = np.asarray(self.times)
        if self.rotations is None:
            return rotation_matrix(np.interp(time, times, np.asarray(self.angles)) * np.asarray(self.axis))
        rotations = np.asarray(self.rotations)
        place = float(np.interp(time, times, np.arange(len(times))))
        before = int(place)
        begin = Rotation.from_rotvec(rotations[before])
        if place == before:
            return begin.as_matrix()
        turn = (begin.inv() * Rotation.from_rotvec(rotations[before + 1])).as_rotvec()
        return (begin * Rotation.from_rotvec((place - before) * turn)).as_matrix()


Motion = Keyframes | Callable[[float], ArrayLike] | None


@dataclass(frozen=True)
class MotionValidator(Validator):
    """None, `Keyframes`, or a function of time."""

    def checked(self, value: Any, what: str) -> Any:
        if not isinstance(value, Keyframes) and not callable(value):
            raise SceneError(f"{what} is {value!r}; give None, Keyframes, or a function t -> displacement")
        return value


def displacement_at(
    motion: Callable[[float], ArrayLike], time: float, owner: str, count: int | None
) -> NDArray[np.float64]:
    """The checked value of a function of time: (3,), or (count, 3) where `count` is given."""
    value = float_array(motion(time), f"{owner}: motion({time:g})", "it must be an array of numbers")
    if value.shape != (3,) and (count is None or value.shape != (count, 3)):
        want = "(3,)" if count is None else f"(3,) or ({count}, 3)"
        raise SceneError(f"{owner}: motion({time:g}) has shape {value.shape}; it must have shape {want}")
    if not np.isfinite(value).all():
        raise SceneError(f"{owner}: motion({time:g}) is not finite")
    return value


def moved_points(motion: Motion, points: NDArray[np.float64], time: float, owner: str) -> NDArray[np.float64]:
    """Where points (k, 3), given at time 0, are at `time`."""
    if motion is None:
        return points
    if isinstance(motion, Keyframes):
        R, t = motion.pose(time)
        return points @ R.T + t
    return points + displacement_at(motion, time, owner, len(points))


def points_at_origin(motion: Motion, points: NDArray[np.float64], time: float, owner: str) -> NDArray[np.float64]:
    """The inverse of `moved_points`: where points (k, 3), given at `time`, are at time 0."""
    if motion is None:
        return points
    if isinstance(motion, Keyframes):
        R, t = motion.pose(time)
        return (points - t) @ R
    return points - displacement_at(motion, time, owner, len(points))


def rigid_pose(motion: Motion, time: float, owner: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rotation (3, 3) and translation (3,) at `time`, for what cannot deform (obstacles)."""
    if motion is None:
        return np.eye(3), np.zeros(3)
    if isinstance(motion, Keyframes):
        return motion.pose(time)
    return np.eye(3), displacement_at(motion, time, owner, None)
