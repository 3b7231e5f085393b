"""All kinds of obstacles: what recordings and scene files are read with."""

from __future__ import annotations

from typing import Any

from supple.scene.obstacles.box import Box
from supple.scene.obstacles.capsule import Capsule
from supple.scene.obstacles.cylinder import Cylinder
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.obstacles.sphere import Sphere
from supple.scene.obstacles.torus import Torus
from supple.scene.obstacles.triangle_obstacle import TriangleObstacle

KINDS: dict[str, type[Obstacle]] = {}


def register(kind: type[Obstacle]) -> None:
    """Make a kind of obstacle known by the name of its class.

    Scene files know the kinds that are registered before `supple.app.scene_file` is first imported.
    """
    KINDS[kind.__name__] = kind


def restored_obstacle(kind: str, values: dict[str, Any]) -> Obstacle:
    """The obstacle of a recording.

    Raises
    ------
    KeyError, TypeError, SceneError : where the kind is unknown, or the values are not those of the kind.
    """
    return KINDS[kind](**values)


for _kind in (HalfSpace, Box, Sphere, Capsule, Cylinder, Torus, TriangleObstacle):
    register(_kind)
