"""Joints and motors of a scene file, by `kind`, and welds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from supple.app.scene_file.entries.loads import CurveModel, over_time
from supple.app.scene_file.entries.selections import InBoxModel
from supple.app.scene_file.model import Index, Model, Name, NonNegative, Number, Positive, Vector
from supple.errors import SceneError
from supple.scene.inputs import MotorInput
from supple.scene.joints.axis_joint import AxisJoint, HingeJoint, SliderJoint
from supple.scene.joints.ball_joint import BallJoint
from supple.scene.joints.fixed_joint import FixedJoint
from supple.scene.joints.joint import Joint
from supple.scene.joints.motors import ForceMotor, Motor, PositionMotor, VelocityMotor
from supple.scene.joints.weld import Weld
from supple.scene.located import at
from supple.scene.selection import InBox


class InputModel(Model):
    """A number that a program sets while the simulation runs; motors with the same name follow the same one."""

    input: Name = Field(description="its name, by which it is set")
    value: Number = Field(default=0.0, description="at the start, and until it is set")


class PositionMotorModel(Model):
    """Pulls the coordinate to a target: stiffness (target - q) + damping (rate of the target - rate of q)."""

    kind: Literal["position"]
    target: Number | CurveModel | InputModel = Field(description="[rad] or [m], a curve, or an input")
    stiffness: NonNegative = Field(description="[N m/rad] or [N/m]")
    damping: NonNegative = Field(default=0.0, description="[N m s/rad] or [N s/m]")
    max_force: Positive | None = Field(default=None, description="largest torque [N m] or force [N]")

    def build(self) -> Motor:
        return PositionMotor(_script(self.target, "target"), self.stiffness, self.damping, self.max_force)


class VelocityMotorModel(Model):
    """Gives the coordinate a rate, with at most the largest force."""

    kind: Literal["velocity"]
    target: Number | CurveModel | InputModel = Field(description="[rad/s] or [m/s], a curve, or an input")
    max_force: Positive | None = Field(default=None, description="largest torque [N m] or force [N]")

    def build(self) -> Motor:
        return VelocityMotor(_script(self.target, "target"), self.max_force)


class ForceMotorModel(Model):
    """A given torque or force."""

    kind: Literal["force"]
    force: Number | CurveModel | InputModel = Field(description="[N m] or [N], a curve, or an input")
    max_force: Positive | None = Field(default=None, description="where it is cut off [N m] or [N]")

    def build(self) -> Motor:
        return ForceMotor(_script(self.force, "force"), self.max_force)


MotorModel = Annotated[PositionMotorModel | VelocityMotorModel | ForceMotorModel, Field(discriminator="kind")]


def _script(value: Any, key: str) -> Any:
    return MotorInput(value.input, value.value) if isinstance(value, InputModel) else over_time(value, key)


def with_shared_inputs(joints: Sequence[Joint]) -> list[Joint]:
    """The joints with one input for each name.

    Raises
    ------
    SceneError : where one begins at two values.
    """
    inputs: dict[str, MotorInput] = {}
    found = []
    for i, joint in enumerate(joints):
        motor = joint.motor if isinstance(joint, AxisJoint) else None
        if isinstance(joint, AxisJoint) and motor is not None and isinstance(motor.script, MotorInput):
            one = inputs.setdefault(motor.script.name, motor.script)
            if one.value != motor.script.value:
                with at("joints", i, "motor"):
                    raise SceneError(
                        f"input {one.name!r} begins at {float(motor.script.value):g} here and at {float(one.value):g} "
                        "in a joint above; give both one value, or each a name"
                    )
            joint = replace(joint, motor=motor.scripted(one))
        found.append(joint)
    return found


class _JointModel(Model):
    first: Name = Field(description="name of a rigid body")
    second: Name | None = Field(default=None, description="another rigid body, or an obstacle; without it, the world")
    collide: bool = Field(default=False, description="whether the two touch each other")
    name: Name | None = Field(default=None, description="in reports; default: kind and number")


class FixedJointModel(_JointModel):
    """No motion against each other."""

    kind: Literal["fixed"]
    point: Vector | None = Field(default=None, description="that torques are about; default: the first's center [m]")

    def build(self) -> Joint:
        return FixedJoint(**self.model_dump(exclude={"kind"}))


class BallJointModel(_JointModel):
    """A common point."""

    kind: Literal["ball"]
    point: Vector = Field(description="in the world at the start [m]")
    axis: Vector | None = Field(default=None, description="of the cone of `max_swing`, in the world at the start")
    max_swing: Positive | None = Field(default=None, description="largest angle of the first's axis to it [rad]")
    twist_limits: Annotated[list[Number], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="[smallest, largest] turn about the axis [rad]; at the start it is zero"
    )

    def build(self) -> Joint:
        return BallJoint(**self.model_dump(exclude={"kind"}))


class _AxisJointModel(_JointModel):
    axis: Vector = Field(description="direction in the world at the start")
    limits: Annotated[list[Number], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="[smallest, largest] angle [rad] or travel [m]; at the start it is zero"
    )
    motor: MotorModel | None = None
    damping: NonNegative = Field(default=0.0, description="effort for each unit of its rate [N m s/rad] or [N s/m]")
    friction: NonNegative = Field(default=0.0, description="largest effort of dry friction [N m] or [N]")
    max_effort: Positive | None = Field(default=None, description="largest effort of its motor [N m] or [N]")
    max_velocity: Positive | None = Field(default=None, description="largest rate [rad/s] or [m/s]")

    def values(self) -> dict[str, Any]:
        """The arguments of the joint."""
        given = self.model_dump(exclude={"kind", "motor"})
        with at("motor"):
            return {**given, "motor": None if self.motor is None else self.motor.build()}


class HingeJointModel(_AxisJointModel):
    """A turn about an axis."""

    kind: Literal["hinge"]
    point: Vector = Field(description="on the axis, in the world at the start [m]")

    def build(self) -> Joint:
        return HingeJoint(**self.values())


class SliderJointModel(_AxisJointModel):
    """A shift along an axis, without a turn."""

    kind: Literal["slider"]
    point: Vector | None = Field(default=None, description="that torques are about; default: the first's center [m]")

    def build(self) -> Joint:
        return SliderJoint(**self.values())


JointModel = Annotated[
    FixedJointModel | BallJointModel | HingeJointModel | SliderJointModel, Field(discriminator="kind")
]


class WeldModel(Model):
    """Vertices of a soft body that are points of a rigid one. Give `vertices`, `box` or `max_distance`."""

    body: Name = Field(description="name of the soft body")
    rigid: Name = Field(description="name of the rigid body")
    vertices: list[Index] | None = Field(default=None, min_length=1, description="vertex numbers, from 0")
    box: InBoxModel | None = Field(default=None, description="instead of `vertices`: all vertices inside")
    max_distance: Positive | None = Field(
        default=None, description="instead of `vertices`: all that are no farther from the rigid body's surface [m]"
    )
    name: Name | None = Field(default=None, description="in reports; default: kind and number")

    @model_validator(mode="after")
    def _one_selection(self) -> WeldModel:
        if sum(value is not None for value in (self.vertices, self.box, self.max_distance)) != 1:
            raise ValueError("give the vertices by one of `vertices`, `box` and `max_distance`")
        return self

    def build(self) -> Weld:
        chosen: Any = self.vertices
        if self.box is not None:
            with at("box"):
                chosen = InBox(self.box.low, self.box.high)
        return Weld(self.body, self.rigid, chosen, self.max_distance, self.name)
