"""From the cavities of a scene to actuators of a system."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.loads.actuators.actuator import Actuator
from supple.loads.actuators.enclosed_volume import EnclosedVolume
from supple.loads.actuators.laws import GivenForce, GivenGas, GivenValue, Law
from supple.scene.actuators.cavity import Cavity
from supple.scene.actuators.gas import GAS_CONSTANT, Gas
from supple.scene.body import PlacedBody
from supple.scene.loads.over_time import OverTime, magnitude_at, value_at


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


def _law(cavity: Cavity, start: float) -> Law:
    if cavity.pressure is not None:
        return GivenForce(partial(_number, cavity.pressure, f"{cavity.label}: pressure"), start)
    if cavity.volume is not None:
        return GivenValue(partial(magnitude_at, cavity.volume, what=f"{cavity.label}: volume", zero=False))
    gas = cavity.gas
    assert gas is not None
    energy = partial(_gas_energy, gas, start, f"{cavity.label}: gas: amount")
    return GivenGas(energy, start, gas.gamma, gas.ambient)


def _number(given: OverTime, what: str, time: float) -> float:
    return float(value_at(given, time, what, ()))


def _gas_energy(gas: Gas, start: float, what: str, time: float) -> float:
    """n R T [J] at `time` [s]."""
    if gas.amount is None:
        return gas.ambient * start
    return magnitude_at(gas.amount, time, what, zero=False) * GAS_CONSTANT * gas.temperature
