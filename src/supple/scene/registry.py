"""The parts of a scene, and all kinds of each: what scene files and recordings are read with.

A new kind is one file and one line here, or in a program `register`."""

from __future__ import annotations

from typing import Any, NamedTuple

from supple.kinds.kind import Kind
from supple.scene.body import Body, PlacedBody
from supple.scene.contact_pairs import ContactPair
from supple.scene.forces import Force, SoftTarget
from supple.scene.joints.axis_joint import HingeJoint, SliderJoint
from supple.scene.joints.joint import Joint
from supple.scene.joints.point_joints import BallJoint, FixedJoint, PlanarJoint, UniversalJoint
from supple.scene.joints.weld import Weld
from supple.scene.loads.body_force import BodyForce
from supple.scene.loads.cable import Cable
from supple.scene.loads.cavity import Cavity
from supple.scene.loads.growth import Growth
from supple.scene.loads.load import Load
from supple.scene.loads.muscle import Muscle
from supple.scene.loads.spring import Spring
from supple.scene.loads.surface_loads import Pressure, Traction, Wind
from supple.scene.obstacles.box import Box
from supple.scene.obstacles.capsule import Capsule
from supple.scene.obstacles.cylinder import Cylinder
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.obstacles.sphere import Sphere
from supple.scene.obstacles.torus import Torus
from supple.scene.obstacles.triangle_obstacle import TriangleObstacle
from supple.scene.pins import Pin
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rod import Rod
from supple.scene.sensors import AngleSensor, DistanceSensor, ForceSensor, Sensor, Taxels
from supple.scene.shell import Shell
from supple.scene.stitches.springs import VertexEdgeStitch, VertexVertexStitch
from supple.scene.stitches.stitch import Stitch
from supple.scene.stitches.vertex_triangle import SoftVertexTriangleStitch


class Part(NamedTuple):
    """One of the lists that a scene consists of.

    Attributes
    ----------
    bases : the classes of what it may hold; kinds : those of them that scene files name
    """

    bases: tuple[type[Kind], ...]
    kinds: list[type[Any]]


# By the parameter of `Scene`, and the key of scene files.
PARTS: dict[str, Part] = {
    "bodies": Part((PlacedBody,), [Body, RigidBody, Shell, Rod]),
    "obstacles": Part((Obstacle,), [HalfSpace, Box, Sphere, Capsule, Cylinder, Torus, TriangleObstacle]),
    "pins": Part((Pin,), [Pin]),
    "forces": Part((Force,), [Force]),
    "loads": Part(
        (Load, Force, SoftTarget),
        [Traction, Pressure, BodyForce, Spring, Wind, Muscle, Growth, Force, SoftTarget],
    ),
    "cavities": Part((Cavity,), [Cavity]),
    "cables": Part((Cable,), [Cable]),
    "sensors": Part((Sensor,), [ForceSensor, Taxels, AngleSensor, DistanceSensor]),
    "soft_targets": Part((SoftTarget,), [SoftTarget]),
    "contact_pairs": Part((ContactPair,), [ContactPair]),
    "stitches": Part((Stitch,), [SoftVertexTriangleStitch, VertexVertexStitch, VertexEdgeStitch]),
    "joints": Part((Joint,), [FixedJoint, BallJoint, HingeJoint, SliderJoint, PlanarJoint, UniversalJoint]),
    "welds": Part((Weld,), [Weld]),
}


def register(kind: type[Kind]) -> None:
    """Make a kind of obstacle, load, joint, stitch or sensor known to scene files and recordings.

    Raises
    ------
    TypeError : where a scene has no list of such things.
    """
    part = next((part for part in PARTS.values() if issubclass(kind, part.bases)), None)
    if part is None:
        raise TypeError(f"{kind.__name__} is not an obstacle, a load, a joint, a stitch or a sensor")
    if kind not in part.kinds:
        part.kinds.append(kind)
