"""The laws along the coordinate of a joint, or across it: conditions, limits and motors.

Each is an energy psi of one number g whose derivative is a line that is cut off,

    psi'(g) = clip(lambda + k (g - g0), low, high).

A condition g = g0 has no ends, with the multiplier lambda; a limit pushes in one direction only, that of a rate v at
g_n + h v and at g_n - h v; a motor that is to reach a velocity has g0 = g_n + h v, and its largest force as ends, as
dry friction has with v = 0. Their multipliers are updated until the line gives the force that is needed at g0 (the
method of multipliers). Where a motor has a stiffness K and a damping D, the line is that of an implicit step of h,

    K (g - target) + D ((g - g_n) / h - v) = lambda + (K + D / h) (g - g_n),    lambda = K (g_n - target) - D v,

and it stays.

Source: Nocedal, Wright, "Numerical Optimization" (2006), section 17.4.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.model.joints.functions import ANGLE
from supple.model.joints.geometry import JointGeometry
from supple.scene.joints.axis_joint import AxisJoint
from supple.scene.joints.motors import ForceMotor, Motor, PositionMotor, VelocityMotor

TURN = 2.0 * np.pi


class Law(NamedTuple):
    """One law; see the module.

    function : whose value is g; adapts : whether lambda is updated
    """

    function: int
    k: float
    start: float
    low: float = -np.inf
    high: float = np.inf
    multiplier: float = 0.0
    adapts: bool = True
    is_motor: bool = False


@dataclass(frozen=True, eq=False)
class Laws:
    """Many laws, each an entry of arrays (l,)."""

    function: NDArray[np.int64]
    k: NDArray[np.float64]
    start: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    adapts: NDArray[np.bool_]
    is_motor: NDArray[np.bool_]

    @classmethod
    def of(cls, laws: Sequence[Law]) -> tuple[Laws, NDArray[np.float64]]:
        """The laws, and their multipliers (l,)."""
        columns = list(zip(*laws, strict=True)) if laws else [()] * len(Law._fields)
        function, k, start, low, high, multipliers, adapts, is_motor = columns
        made = cls(
            np.array(function, dtype=np.int64),
            *(np.array(column, dtype=np.float64) for column in (k, start, low, high)),
            adapts=np.array(adapts, dtype=np.bool_),
            is_motor=np.array(is_motor, dtype=np.bool_),
        )
        return made, np.array(multipliers, dtype=np.float64)

    def efforts(self, g: NDArray[np.float64], multipliers: NDArray[np.float64]) -> NDArray[np.float64]:
        """(l,) psi' at the values g (l,)."""
        return np.clip(multipliers + self.k * (g - self.start), self.low, self.high)

    def energies(self, g: NDArray[np.float64], multipliers: NDArray[np.float64]) -> NDArray[np.float64]:
        """(l,) psi, up to a constant."""
        line = multipliers + self.k * (g - self.start)
        effort = np.clip(line, self.low, self.high)
        stiff = self.k > 0.0
        k = np.where(stiff, self.k, 1.0)
        return np.where(stiff, effort * (line - 0.5 * effort) / k, multipliers * (g - self.start))

    def stiffness(self, g: NDArray[np.float64], multipliers: NDArray[np.float64]) -> NDArray[np.float64]:
        """(l,) psi''."""
        line = multipliers + self.k * (g - self.start)
        return np.where((line > self.low) & (line < self.high), self.k, 0.0)


def wrapped(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """The angle within half a turn of zero [rad]."""
    return angle - TURN * np.round(angle / TURN)


def followed(
    geometry: JointGeometry, g: NDArray[np.float64], known: Mapping[str, float], slack: float
) -> NDArray[np.float64]:
    """Values (s,) of the functions, with angles over all turns: near those that are known [rad], by name of the joint.

    Others are at a start: of the angles between the limits, up to `slack` [rad], that nearest to the joint's own start.
    """
    out = g.copy()
    for j, joint in enumerate(geometry.joints):
        row = geometry.along[j]
        if row < 0 or geometry.functions[row] != ANGLE:
            continue
        near = known.get(str(joint.name))
        begin = getattr(joint, "start", 0.0) if near is None else near
        out[row] = begin + wrapped(g[row] - begin)
        below, above = geometry.limits[row] + (-slack, slack) - out[row]
        if near is None and not below <= 0.0 <= above:
            turns = np.ceil(below / TURN) if below > 0.0 else np.floor(above / TURN)
            out[row] += TURN * turns if below <= TURN * turns <= above else 0.0
    return out


def laws_of(
    geometry: JointGeometry,
    stiffness: NDArray[np.float64],
    start: NDArray[np.float64],
    times: tuple[float, float],
    *,
    moving: bool,
) -> tuple[Laws, NDArray[np.float64]]:
    """The laws of a step, and their multipliers (l,) at its beginning.

    Parameters
    ----------
    stiffness : (j,) k of conditions, of each joint [N/m]; start : (s,) values at the beginning, see `followed`
    times : begin and end of the step [s]; moving : whether rates count; without them, as in equilibrium, motors do not
        damp
    """
    of_joint = geometry.arguments[0].joint
    k_of = stiffness[of_joint] * (geometry.sizes[of_joint] / geometry.units) ** 2
    laws = [Law(int(row), float(k_of[row]), 0.0) for row in geometry.across]
    for j, joint in enumerate(geometry.joints):
        for row in geometry.limited(j).tolist():
            k, (low, high) = float(k_of[row]), geometry.limits[row].tolist()
            laws += [Law(row, k, low, high=0.0)] if np.isfinite(low) else []
            laws += [Law(row, k, high, low=0.0)] if np.isfinite(high) else []
        if not isinstance(joint, AxisJoint):
            continue
        row = int(geometry.along[j])
        k, here, (low, high) = float(k_of[row]), float(start[row]), geometry.limits[row].tolist()
        if joint.max_velocity is not None and moving:
            reach = (times[1] - times[0]) * joint.max_velocity
            laws.append(Law(row, k, here - reach, high=0.0))
            laws.append(Law(row, k, here + reach, low=0.0))
            low, high = max(low, here - reach), min(high, here + reach)
        if joint.damping > 0.0 and moving:
            laws.append(Law(row, joint.damping / (times[1] - times[0]), here, adapts=False))
        if joint.friction > 0.0 and moving:
            laws.append(Law(row, k, here, -joint.friction, joint.friction))
        if joint.motor is not None:
            laws.append(_motor_law(joint.motor, row, k, here, times, (low, high), moving=moving))
    return Laws.of(laws)


def _motor_law(
    motor: Motor,
    row: int,
    k: float,
    start: float,
    times: tuple[float, float],
    limits: tuple[float, float],
    *,
    moving: bool,
) -> Law:
    h = times[1] - times[0]
    bound = np.inf if motor.max_force is None else float(motor.max_force)
    if isinstance(motor, ForceMotor):
        return Law(row, 0.0, start, multiplier=-motor.at(times[1]), adapts=False, is_motor=True)
    if isinstance(motor, VelocityMotor):
        # A limit of the coordinate or of its rate stops the motor, also one without a largest force.
        stopped = float(np.clip(start + h * motor.at(times[1]), *limits))
        return Law(row, k, stopped, -bound, bound, is_motor=True)
    assert isinstance(motor, PositionMotor)
    target = motor.at(times[1])
    rate = (target - motor.at(times[0])) / h if moving else 0.0
    damping = motor.damping if moving else 0.0
    multiplier = motor.stiffness * (start - target) - damping * rate
    stiffness = motor.stiffness + damping / h
    return Law(row, stiffness, start, -bound, bound, multiplier, adapts=False, is_motor=True)
