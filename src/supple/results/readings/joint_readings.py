"""What joints do, from the details of a step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.model.state import SolverDetails


@dataclass(frozen=True, eq=False)
class JointReading:
    """A joint at the end of a step; of `XPBD`, forces are means over the step.

    Attributes
    ----------
    force : (3,) on its first body, that of its limits and its motor included [N]
    torque : (3,) about the joint's point, likewise [N m]
    coordinate : angle of a hinge [rad], travel of a slider [m], swing of a ball with a limit [rad]; otherwise None
    motor_force : effort of its motor, torque [N m] or force [N]; None without a motor
    violation : how far it is from holding, as a share of the diameter of gyration of its smaller body [-]
    """

    force: NDArray[np.float64]
    torque: NDArray[np.float64]
    coordinate: float | None
    motor_force: float | None
    violation: float


def joint_readings(details: SolverDetails) -> Mapping[str, JointReading]:
    """By name of the joint; empty where the solver has none."""
    return {
        name: JointReading(
            force,
            details.joint_torques[name],
            details.joint_coordinates.get(name),
            details.motor_forces.get(name),
            details.joint_violations[name],
        )
        for name, force in details.joint_forces.items()
    }
