"""Which joints an integrator cannot simulate."""

from __future__ import annotations

from supple.errors import SolverError
from supple.scene.joints.axis_joint import AxisJoint
from supple.scene.joints.motors import VelocityMotor
from supple.scene.scene import Scene
from supple.solvers.implicit.stepping.integrators import Integrator, Static


def refuse_joints(method: Integrator, scene: Scene) -> None:
    """Check that an integrator can simulate the joints of a scene.

    Raises
    ------
    SolverError : where it cannot; the text names a joint.
    """
    for joint in scene.joints:
        if isinstance(method, Static) and isinstance(joint, AxisJoint) and isinstance(joint.motor, VelocityMotor):
            raise SolverError(
                f"{joint.label}: in an equilibrium nothing moves, and its motor has a velocity; give a PositionMotor, "
                "or use another integrator"
            )
