"""Simple shapes: planes and the walls of rooms, whose free side is convex.

A point keeps its side where both ends of its way are on it, so that shapes need no truncation. A point that a substep
leaves beyond a wall is put back onto it. This is a projection onto a convex set that contains the beginning of the way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.obstacles import ObstaclePoses
from supple.model.system import System
from supple.numerics.mat3 import row
from supple.runtime.kernel_cache import njit, reached_code
from supple.scene.contact_pairs import pair_table
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.obstacles.shape import PARAMETERS


@dataclass(frozen=True, eq=False)
class ObstacleShapes:
    """k simple shapes where they are at time 0.

    Attributes
    ----------
    contacts : (k,) how a point meets each shape; see `supple.scene.obstacles.shape.Shape`
    owners : (k,) which obstacle of the scene a shape belongs to
    frames : (k, 4, 3) an anchor point [m], then three axes, row by row
    parameters : (k, PARAMETERS) numbers of each shape
    moving : (k,) whether the shape is scripted
    """

    contacts: tuple[Callable[..., Any], ...]
    owners: NDArray[np.int32]
    frames: NDArray[np.float64]
    parameters: NDArray[np.float64]
    moving: NDArray[np.bool_]

    @cached_property
    def any_moves(self) -> bool:
        return bool(self.moving.any())

    def placed(self, poses: ObstaclePoses, time: float) -> NDArray[np.float64]:
        """Frames (k, 4, 3) at `time` [s]."""
        if not self.any_moves:
            return self.frames
        R, t = poses.at(time)
        R, t = R[self.owners], t[self.owners]
        out = self.frames @ R.transpose(0, 2, 1)
        out[:, 0] += t
        return out


def build_shapes(obstacles: Sequence[Obstacle]) -> ObstacleShapes:
    """The shapes of all obstacles, in their order."""
    rows = [(k, shape) for k, obstacle in enumerate(obstacles) for shape in obstacle.shapes()]
    parameters = np.zeros((len(rows), PARAMETERS))
    for numbers, (_, shape) in zip(parameters, rows, strict=True):
        numbers[: len(shape.parameters)] = shape.parameters
    return ObstacleShapes(
        contacts=tuple(shape.contact for _, shape in rows),
        owners=np.array([k for k, _ in rows], dtype=np.int32),
        frames=np.array([shape.frame for _, shape in rows], dtype=np.float64).reshape(-1, 4, 3),
        parameters=parameters,
        moving=np.array([obstacles[k].motion is not None for k, _ in rows], dtype=np.bool_),
    )


class Walls(NamedTuple):
    """The distances, normals and nearest places of points at shapes, which are where they end a substep.

    Attributes
    ----------
    gaps : (k,) distance at the beginning [m]; normals : (k, 3) towards the free side
    places : (k, 3) the place of the shape that was nearest then, moved with it [m]
    """

    gaps: NDArray[np.float64]
    normals: NDArray[np.float64]
    places: NDArray[np.float64]


@njit
def contact(parameters, s0, s1):
    """Replaced by the element function of a shape; see `kernel_of`."""
    return np.inf, np.inf, (0.0, 0.0, 0.0)


def _walls_of(x, points, shapes, wanted, parameters, begin, end, gaps, normals, places):
    """Write the walls of points (k,) and shapes (k,) of the kind that is wanted (shapes,).

    x : (N, >= 3) places when the frames `begin` hold; begin, end : (shapes, 4, 3) frames
    """
    for k in range(len(points)):
        o = shapes[k]
        if not wanted[o]:
            continue
        p, f = row(x, points[k]), begin[o]
        d = (p[0] - f[0, 0], p[1] - f[0, 1], p[2] - f[0, 2])
        s = (
            f[1, 0] * d[0] + f[1, 1] * d[1] + f[1, 2] * d[2],
            f[2, 0] * d[0] + f[2, 1] * d[1] + f[2, 2] * d[2],
            f[3, 0] * d[0] + f[3, 1] * d[1] + f[3, 2] * d[2],
        )
        gap, _, n = contact(parameters[o], s, s)
        gaps[k] = gap
        q = (s[0] - gap * n[0], s[1] - gap * n[1], s[2] - gap * n[2])
        f = end[o]
        for j in range(3):
            normals[k, j] = f[1, j] * n[0] + f[2, j] * n[1] + f[3, j] * n[2]
            places[k, j] = f[0, j] + f[1, j] * q[0] + f[2, j] * q[1] + f[3, j] * q[2]


@cache
def kernel_of(function: Callable[..., Any]) -> Callable[..., Any]:
    """`_walls_of` with `contact` replaced, compiled; its name contains a digest, by which Numba's cache tells it."""
    copy = FunctionType(_walls_of.__code__, {**_walls_of.__globals__, "contact": function}, _walls_of.__name__)
    copy.__qualname__ = f"{_walls_of.__qualname__}.{reached_code(copy).hex()[:14]}"
    copy.__module__ = _walls_of.__module__
    return njit(cache=True)(copy)


class RowShapes:
    """The simple shapes of a system.

    Attributes
    ----------
    owners : (k,) number of each among bodies and obstacles; moving : (k,); parameters : (k, PARAMETERS)
    friction, collide : (owners, k)
    kinds : the kernel that measures the walls of each kind of shape, and which shapes are of it (k,)
    """

    def __init__(self, system: System, poses: ObstaclePoses) -> None:
        self._shapes = build_shapes(system.obstacles)
        self._poses = poses
        table, bodies = pair_table(system.scene), len(system.bodies)
        self.owners = bodies + np.asarray(self._shapes.owners)
        self.friction, self.collide = table.friction[:, self.owners], table.collide[:, self.owners]
        self.moving, self.parameters = self._shapes.moving, self._shapes.parameters
        contacts = self._shapes.contacts
        self.kinds = [
            (kernel_of(function), np.array([each is function for each in contacts], dtype=np.bool_))
            for function in dict.fromkeys(contacts)
        ]

    def __len__(self) -> int:
        return len(self.owners)

    def described(self) -> NDArray[np.float64]:
        """(k, 12 + p) the frames at time 0 and the numbers of the shapes."""
        return np.concatenate([self._shapes.frames.reshape(len(self), 12), self._shapes.parameters], axis=1)

    def frames(self, time: float, origin: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, 4, 3) at `time` [s], about an origin [m]."""
        frames = self._shapes.placed(self._poses, time).copy()
        frames[:, 0] -= origin
        return frames

    def walls(
        self,
        x: NDArray[np.float64],
        points: NDArray[np.int32],
        shapes: NDArray[np.int32],
        begin: NDArray[np.float64],
        end: NDArray[np.float64],
    ) -> Walls:
        """Of points and shapes (k,), with the frames at the beginning and at the end of a substep."""
        k = len(points)
        walls = Walls(np.empty(k), np.empty((k, 3)), np.empty((k, 3)))
        if k:
            for kernel, wanted in self.kinds:
                kernel(x, points, shapes, wanted, self.parameters, begin, end, *walls)
        return walls
