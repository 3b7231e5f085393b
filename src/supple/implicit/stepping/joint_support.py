"""Which integrators hold joints."""

from __future__ import annotations

from collections.abc import Sequence

from supple.errors import SolverError
from supple.implicit.stepping.integrators import Integrator, Newmark, Static
from supple.scene.joints.axis_joint import AxisJoint
from supple.scene.joints.joint import Joint
from supple.scene.joints.motors import VelocityMotor


def refuse_joints(method: Integrator, joints: Sequence[Joint]) -> None:
    """Check that an integrator holds the joints.

    The midpoint rule makes bodies rigid in the middle of a step. At its end, joints would hold bodies that are
    stretched: the energy of a double pendulum grew by a fifth.

    Raises
    ------
    SolverError : where it does not; the text names a joint.
    """
    if isinstance(method, Newmark):
        raise SolverError(
            f"{joints[0].label}: the integrator 'newmark' does not support joints; use 'bdf2', or 'backward_euler'"
        )
    for joint in joints:
        if isinstance(method, Static) and isinstance(joint, AxisJoint) and isinstance(joint.motor, VelocityMotor):
            raise SolverError(
                f"{joint.label}: in an equilibrium nothing moves, and its motor has a velocity; give a PositionMotor, "
                "or use another integrator"
            )
