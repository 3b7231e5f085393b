"""Inputs of a scene file: motors that name the same one follow the same object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from supple.errors import SceneError
from supple.scene.inputs import MotorInput
from supple.scene.joints.axis_joint import AxisJoint
from supple.scene.joints.joint import Joint
from supple.scene.located import at


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
