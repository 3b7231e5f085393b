"""The bounds of a scene, which cameras show whole: of its bodies, and of what stands about them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from supple.scene.obstacles.obstacle import Obstacle

# Obstacles that are larger than the bodies and the distance between them by more than this factor are surroundings.
_LARGEST = 2.0


@dataclass(frozen=True, eq=False)
class View:
    """The bounds of a whole scene.

    Attributes
    ----------
    low, high : (3,) bounds of what is to be seen in all frames [m]
    up : (3,) unit vector against gravity; y where none exists
    outline : (k, 3) points whose convex hull contains what is to be seen [m]; the corners of the bounds without this
    """

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    up: NDArray[np.float64]
    outline: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))

    def __post_init__(self) -> None:
        if not len(self.outline):
            object.__setattr__(self, "outline", box_corners(self.low, self.high))

    @property
    def center(self) -> NDArray[np.float64]:
        return 0.5 * (self.low + self.high)

    @property
    def radius(self) -> float:
        """Of the ball about `center` that contains all that is to be seen [m]."""
        return max(0.5 * float(np.linalg.norm(self.high - self.low)), 1e-6)


def view_of_scene(points: NDArray[np.float64], up: NDArray[np.float64], obstacles: Sequence[Obstacle]) -> View:
    """The view of bodies in the hull of points (k, 3) [m], of the floor not far below, and of obstacles about them.

    Obstacles that are much larger do not count. Of a container the lower half counts, which is drawn.
    """
    bodies = View(points.min(axis=0), points.max(axis=0), up, points)
    outline = [bodies.outline]
    for obstacle in obstacles:
        plane = obstacle.plane
        if plane is not None:
            below = float((bodies.center - plane[0]) @ up)
            if float(plane[1] @ up) > 0.99 and 0.0 < below < 4.0 * bodies.radius:
                outline.append((bodies.center - below * up)[None])
            continue
        drawn, _ = obstacle.drawn(bodies.center, bodies.radius)
        heights = drawn @ up
        if obstacle.is_container:
            drawn = drawn[heights <= 0.5 * (heights.min() + heights.max())]
        both = np.concatenate([points, drawn])
        if np.linalg.norm(np.ptp(both, axis=0)) < _LARGEST * 2.0 * bodies.radius:
            outline.append(drawn)
    whole = np.concatenate(outline)
    return View(whole.min(axis=0), whole.max(axis=0), up, whole)


def floor_height(view: View, obstacles: Sequence[Obstacle]) -> float | None:
    """The height along `up` of the highest floor, or of a table under bowls [m]; None where bodies stand on nothing."""
    planes = [obstacle.plane for obstacle in obstacles]
    floors = [float(point @ view.up) for point, normal in filter(None, planes) if float(normal @ view.up) > 0.99]
    if not floors and any(obstacle.is_container for obstacle in obstacles):
        floors = [float((view.outline @ view.up).min())]
    return max(floors, default=None)


# To corners, edges and sides of a cube: the points that are farthest in these directions stand for all.
_DIRECTIONS = np.array([d for d in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(d)])


def farthest(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(26, 3) the points of (k, 3) that are farthest in 26 directions: a hull that is at most a little smaller."""
    return points[(points @ _DIRECTIONS.T).argmax(axis=0)]


def box_corners(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """(8, 3) the corners of a box."""
    return np.stack(np.meshgrid(*np.stack([low, high], axis=1)), axis=-1).reshape(-1, 3)
