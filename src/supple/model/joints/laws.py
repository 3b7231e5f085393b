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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.model.joints.functions import ANGLE
from supple.model.joints.geometry import JointGeometry
from supple.runtime.kernel_cache import njit
from supple.scene.joints.axis_joint import AxisJoint
from supple.scene.joints.motors import ForceMotor, Motor, PositionMotor, VelocityMotor

Floats = NDArray[np.float64]

TURN = 2.0 * np.pi


class Law(NamedTuple):
    """One law; see the module.

    Its g0 is the value g_n where a step begins and a `step` more, not below `least` or above `most`, and not farther
    from g_n than `reach`. Its lambda is `given`, and a `slope` times g_n.

    function : whose value is g; adapts : whether lambda is updated
    """

    function: int
    k: float
    low: float = -np.inf
    high: float = np.inf
    adapts: bool = True
    is_motor: bool = False
    slope: float = 0.0
    least: float = -np.inf
    most: float = np.inf
    reach: float = np.inf
    step: float | Floats = 0.0
    given: float | Floats = 0.0


def condition(function: int, k: float, value: float = 0.0, low: float = -np.inf, high: float = np.inf) -> Law:
    """The law g = value, with a force between ends."""
    return Law(function, k, low, high, least=value, most=value)


# One law in an array: its g0 and its lambda in the current step stand at the end.
LAW = np.dtype(
    [
        ("function", np.int64),
        *((name, np.float64) for name in ("k", "low", "high")),
        *((name, np.bool_) for name in ("adapts", "is_motor")),
        *((name, np.float64) for name in ("slope", "least", "most", "reach", "start", "multiplier")),
    ],
    align=True,
)


class Laws(NamedTuple):
    """Many laws in s steps.

    Attributes
    ----------
    table : (l,) of `LAW`, or of more than that; step, given : (s, l) as of `Law`
    """

    table: NDArray[np.void]
    step: Floats
    given: Floats

    @classmethod
    def of(cls, laws: Sequence[Law], steps: int = 1, kind: np.dtype = LAW) -> Laws:
        """The laws in so many steps, in an array of this kind."""
        table, rates = np.zeros(len(laws), dtype=kind), np.zeros((2, steps, len(laws)))
        for k, law in enumerate(laws):
            for name, value in zip(law._fields[:-2], law, strict=False):
                table[name][k] = value
            rates[0, :, k], rates[1, :, k] = law.step, law.given
        return cls(table, *rates)

    def efforts(self, g: Floats, multipliers: Floats) -> Floats:
        """(l,) psi' at the values g (l,)."""
        return np.clip(self._lines(g, multipliers), self.table["low"], self.table["high"])

    def energies(self, g: Floats, multipliers: Floats) -> Floats:
        """(l,) psi, up to a constant."""
        line, effort = self._lines(g, multipliers), self.efforts(g, multipliers)
        stiff = self.table["k"] > 0.0
        k = np.where(stiff, self.table["k"], 1.0)
        return np.where(stiff, effort * (line - 0.5 * effort) / k, multipliers * (g - self.table["start"]))

    def stiffness(self, g: Floats, multipliers: Floats) -> Floats:
        """(l,) psi''."""
        line = self._lines(g, multipliers)
        return np.where((line > self.table["low"]) & (line < self.table["high"]), self.table["k"], 0.0)

    def _lines(self, g: Floats, multipliers: Floats) -> Floats:
        return multipliers + self.table["k"] * (g - self.table["start"])


@njit
def begin_law(law, step, given, here):
    """Set g0 and lambda of a law in a step that begins with the value `here`."""
    start = min(max(here + step, law.least), law.most)
    law.start = min(max(start, here - law.reach), here + law.reach)
    law.multiplier = given + law.slope * here


@njit(cache=True)
def begin_step(table, step, given, g):
    """The same of many laws (l,), with values g (s,) of the functions."""
    for k in range(len(table)):
        begin_law(table[k], step[k], given[k], g[table[k].function])


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


def laws_of(geometry: JointGeometry, stiffness: Floats, times: Floats, *, moving: bool) -> list[Law]:
    """The laws of steps of one length.

    Parameters
    ----------
    stiffness : (j,) k of conditions, of each joint [N/m]
    times : (s + 1,) begins of the steps, and the end of the last [s]; moving : whether rates count; without them, as in
        equilibrium, motors do not damp
    """
    of_joint, h = geometry.arguments.joint, times[1] - times[0]
    k_of = stiffness[of_joint] * (geometry.sizes[of_joint] / geometry.units) ** 2
    laws = [condition(int(row), float(k_of[row])) for row in geometry.across]
    for j, joint in enumerate(geometry.joints):
        for row in geometry.limited(j).tolist():
            k, (low, high) = float(k_of[row]), geometry.limits[row].tolist()
            laws += [condition(row, k, low, high=0.0)] if np.isfinite(low) else []
            laws += [condition(row, k, high, low=0.0)] if np.isfinite(high) else []
        if not isinstance(joint, AxisJoint):
            continue
        row, reach = int(geometry.along[j]), np.inf
        k, (low, high) = float(k_of[row]), geometry.limits[row].tolist()
        if joint.max_velocity is not None and moving:
            reach = h * joint.max_velocity
            laws += [Law(row, k, high=0.0, step=-reach), Law(row, k, low=0.0, step=reach)]
        if joint.damping > 0.0 and moving:
            laws.append(Law(row, joint.damping / h, adapts=False))
        if joint.friction > 0.0 and moving:
            laws.append(Law(row, k, -joint.friction, joint.friction))
        if joint.motor is not None:
            # A limit of the coordinate or of its rate stops a velocity motor, also one without a largest force.
            stops = (low, high, reach)
            laws.append(_motor_law(joint.motor, row, k, times, stops, moving=moving))
    return laws


def _motor_law(
    motor: Motor, row: int, k: float, times: Floats, stops: tuple[float, float, float], *, moving: bool
) -> Law:
    h = times[1] - times[0]
    bound = np.inf if motor.max_force is None else float(motor.max_force)
    targets = np.array([motor.at(float(time)) for time in times[1:]])
    if isinstance(motor, ForceMotor):
        return Law(row, 0.0, given=-targets, adapts=False, is_motor=True)
    if isinstance(motor, VelocityMotor):
        return Law(row, k, -bound, bound, True, True, 0.0, *stops, step=h * targets)
    assert isinstance(motor, PositionMotor)
    damping, given = 0.0, -motor.stiffness * targets
    if moving:
        damping = motor.damping
        given -= damping * np.diff(targets, prepend=motor.at(float(times[0]))) / h
    stiffness = motor.stiffness + damping / h
    return Law(row, stiffness, -bound, bound, adapts=False, is_motor=True, slope=motor.stiffness, given=given)
