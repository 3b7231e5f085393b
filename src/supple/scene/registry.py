"""All kinds of obstacles, joints and stitches: what scene files and recordings are read with.

A new kind is one file and one line here."""

from __future__ import annotations

from typing import Any

from supple.scene.joints.axis_joint import HingeJoint, SliderJoint
from supple.scene.joints.joint import Joint
from supple.scene.joints.point_joints import BallJoint, FixedJoint, PlanarJoint, UniversalJoint
from supple.scene.obstacles.box import Box
from supple.scene.obstacles.capsule import Capsule
from supple.scene.obstacles.cylinder import Cylinder
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.obstacles.sphere import Sphere
from supple.scene.obstacles.torus import Torus
from supple.scene.obstacles.triangle_obstacle import TriangleObstacle
from supple.scene.stitches.springs import VertexEdgeStitch, VertexVertexStitch
from supple.scene.stitches.stitch import Stitch
from supple.scene.stitches.vertex_triangle import SoftVertexTriangleStitch

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


JOINTS: tuple[type[Joint], ...] = (
    FixedJoint,
    BallJoint,
    HingeJoint,
    SliderJoint,
    PlanarJoint,
    UniversalJoint,
)


STITCHES: tuple[type[Stitch], ...] = (SoftVertexTriangleStitch, VertexVertexStitch, VertexEdgeStitch)
