"""Which integrators hold joints and welds."""

from __future__ import annotations

from supple.errors import SolverError
from supple.implicit.stepping.integrators import Integrator, Newmark, Static
from supple.scene.joints.axis_joint import AxisJoint
from supple.scene.joints.motors import VelocityMotor
from supple.scene.scene import Scene


def refuse_joints(method: Integrator, scene: Scene) -> None:
    """Check that an integrator holds the joints and welds of a scene.

    The midpoint rule makes bodies rigid in the middle of a step. At its end, joints and welds would hold bodies that
    are stretched: the energy of a double pendulum grew by a fifth.

    Raises
    ------
    SolverError : where it does not; the text names a joint or a weld.
    """
    held = [*scene.joints, *scene.welds]
    if held and isinstance(method, Newmark):
        what = "joints" if scene.joints else "welds"
        raise SolverError(
            f"{held[0].label}: the integrator 'newmark' does not support {what}; use 'bdf2', or 'backward_euler'"
        )
    for joint in scene.joints:
        if isinstance(method, Static) and isinstance(joint, AxisJoint) and isinstance(joint.motor, VelocityMotor):
            raise SolverError(
                f"{joint.label}: in an equilibrium nothing moves, and its motor has a velocity; give a PositionMotor, "
                "or use another integrator"
            )
