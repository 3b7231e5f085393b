"""From the cavities and cables of a scene to actuators of a system."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.kinds.kind import Kind
from supple.model.loads.actuators.actuator import Actuator
from supple.model.loads.actuators.cables import CableLength
from supple.model.loads.actuators.enclosed_volume import EnclosedVolume
from supple.model.loads.actuators.laws import ElasticCable, GivenForce, GivenGas, GivenValue, Law
from supple.scene.body import PlacedBody
from supple.scene.loads.cable import Cable
from supple.scene.loads.cavity import AMOUNT, GAS_CONSTANT, Cavity
from supple.scene.loads.over_time import Curve, OverTime, script_of


def actuators_of(
    cavities: Sequence[Cavity],
    cables: Sequence[Cable],
    bodies: Sequence[PlacedBody],
    begins: dict[str, int],
    x: NDArray[np.float64],
) -> tuple[Actuator, ...]:
    """The cavities, then the cables of a scene; parameters as of `cavity_actuator`."""
    filled = [cavity_actuator(cavity, bodies, begins, x) for cavity in cavities]
    return (*filled, *(cable_actuator(cable, bodies, begins, x) for cable in cables))


def cavity_actuator(
    cavity: Cavity, bodies: Sequence[PlacedBody], begins: dict[str, int], x: NDArray[np.float64]
) -> Actuator:
    """A cavity of a scene.

    Parameters
    ----------
    begins : by body name, the number of its first vertex; x : (n, 3) where the simulation begins [m]

    Raises
    ------
    SceneError : where the cavity has no volume at the start.
    """
    coordinate = EnclosedVolume.of(cavity.surface(bodies) + begins[cavity.body])
    start = coordinate.value(x[coordinate.vertices])
    if start <= 0.0:
        raise SceneError(f"{cavity.label}: its volume at the start is {start:.3g} m^3; it must be above zero")
    return Actuator("cavity", str(cavity.name), coordinate, start, _law(cavity, start))


def cable_actuator(
    cable: Cable, bodies: Sequence[PlacedBody], begins: dict[str, int], x: NDArray[np.float64]
) -> Actuator:
    """A cable of a scene; parameters as of `cavity_actuator`."""
    corners = cable.corners(bodies)
    named = [(begins[name] + own, k, weights) for k, (name, own, weights, _) in enumerate(corners) if name is not None]
    vertices, column = np.unique(np.concatenate([own for own, _, _ in named]), return_inverse=True)
    weights = np.zeros((len(corners), len(vertices)))
    for (_, k, shares), columns in zip(named, column.reshape(len(named), -1), strict=True):
        np.add.at(weights[k], columns, shares)
    used = weights.any(axis=0)
    offsets = np.array([offset for _, _, _, offset in corners])
    coordinate = CableLength(vertices[used].astype(np.int32), np.ascontiguousarray(weights[:, used]), offsets)
    start = coordinate.value(x[coordinate.vertices])
    return Actuator("cable", cable.name, coordinate, start, _cable_law(cable, start), cable.friction)


def _cable_law(cable: Cable, start: float) -> Law:
    if cable.tension is not None:
        tension = script_of(cable, "tension")
        return GivenForce(lambda time: -float(tension(time)), start)
    assert cable.stiffness is not None
    if cable.length is not None:
        return ElasticCable(cable.stiffness, _number(cable, "length"))
    wound = Wound(_number(cable, "winch_speed"), cable.winch_speed)
    return ElasticCable(cable.stiffness, lambda time: max(start - wound(time), 0.0))


class Wound:
    """The length that a winch has wound up since time 0 [m], as a function of time: the integral of its speed.

    Exact for numbers and curves; of functions by Gauss's rule with three points in each of `PANEL` [s].
    """

    PANEL = 0.01
    _PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(3)

    def __init__(self, speed: Callable[[float], float], given: OverTime | None) -> None:
        self._speed = speed
        # A piecewise linear function has corners, up to which the rule is exact.
        self._corners = np.asarray(given.times) if isinstance(given, Curve) else np.zeros(0)
        self._whole = [0.0]  # until the end of each panel that was needed so far

    def __call__(self, time: float) -> float:
        panels = int(time / self.PANEL)
        for k in range(len(self._whole) - 1, panels):
            self._whole.append(self._whole[k] + self._integral(k * self.PANEL, (k + 1) * self.PANEL))
        return self._whole[panels] + self._integral(panels * self.PANEL, time)

    def _integral(self, begin: float, end: float) -> float:
        inside = self._corners[(self._corners > begin) & (self._corners < end)]
        total = 0.0
        for low, high in pairwise([begin, *inside, end]):
            half = 0.5 * (high - low)
            speeds = [self._speed(low + half * (1.0 + place)) for place in self._PLACES]
            total += half * float(self._WEIGHTS @ speeds)
        return total


def _law(cavity: Cavity, start: float) -> Law:
    if cavity.pressure is not None:
        return GivenForce(_number(cavity, "pressure"), start)
    if cavity.volume is not None:
        return GivenValue(_number(cavity, "volume"))
    gas = cavity.gas
    assert gas is not None
    if gas.amount is None:
        return GivenGas(lambda time: gas.ambient * start, start, gas.gamma, gas.ambient)
    what = f"{cavity.label}: gas: amount"
    amount, temperature = gas.amount, gas.temperature

    def energy(time: float) -> float:
        return float(AMOUNT.at(amount, time, what)) * GAS_CONSTANT * temperature

    return GivenGas(energy, start, gas.gamma, gas.ambient)


def _number(thing: Kind, key: str) -> Callable[[float], float]:
    script = script_of(thing, key)
    return lambda time: float(script(time))
