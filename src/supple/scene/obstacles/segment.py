"""Common part of capsules and cylinders: the segment that is their axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.forms import POSITIVE, Flag, Vector
from supple.scene.obstacles.obstacle import Obstacle, lengths_and_directions
from supple.scene.obstacles.shape import frame_of


@dataclass(frozen=True, eq=False)
class SegmentObstacle(Obstacle):
    """A body of revolution about a segment.

    Parameters
    ----------
    start, end : (3,) the ends of the axis [m]; radius : [m]; inside : True where bodies live inside.
    """

    start: Annotated[ArrayLike, Vector()] = (0.0, -0.5, 0.0)
    end: Annotated[ArrayLike, Vector()] = (0.0, 0.5, 0.0)
    radius: Annotated[float, POSITIVE] = 0.5
    inside: Annotated[bool, Flag()] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if np.linalg.norm(np.asarray(self.end) - np.asarray(self.start)) <= 1e-9 * self.radius:
            raise SceneError(f"{self.label}: start and end are the same point; give an axis, or use a Sphere")

    @property
    def half_length(self) -> float:
        """Of the axis [m]."""
        return 0.5 * float(np.linalg.norm(np.asarray(self.end) - np.asarray(self.start)))

    @property
    def frame(self) -> NDArray[np.float64]:
        """(4, 3) the middle of the axis [m], then three orthonormal axes; the first one leads from start to end."""
        a, b = np.asarray(self.start), np.asarray(self.end)
        return frame_of(0.5 * (a + b), (b - a) / np.linalg.norm(b - a))

    def split(
        self, points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Heights (k,) over the middle of points (k, 3), their distances (k,) from the axis, and directions (k, 3)."""
        middle, axis, aside, _ = self.frame
        heights = (points - middle) @ axis
        return heights, *lengths_and_directions(points - middle - heights[:, None] * axis, aside)

    def placed(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (k, 3), given in `frame`, in the world [m]."""
        return self.frame[0] + points @ self.frame[1:]
