"""The shapes of all obstacles of a scene as rows of arrays; for those of triangles, see `contact_surfaces`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.obstacles import ObstaclePoses
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
    for row, (_, shape) in zip(parameters, rows, strict=True):
        row[: len(shape.parameters)] = shape.parameters
    return ObstacleShapes(
        contacts=tuple(shape.contact for _, shape in rows),
        owners=np.array([k for k, _ in rows], dtype=np.int32),
        frames=np.array([shape.frame for _, shape in rows], dtype=np.float64).reshape(-1, 4, 3),
        parameters=parameters,
        moving=np.array([obstacles[k].motion is not None for k, _ in rows], dtype=np.bool_),
    )
