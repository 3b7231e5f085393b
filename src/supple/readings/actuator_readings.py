"""What a step did to the actuators of a scene, and with which forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.loads.actuators.actuator import Actuator
from supple.state import SolverDetails
from supple.system import System

Floats = Sequence[float] | NDArray[np.float64]


@dataclass(frozen=True)
class CavityReading:
    """A cavity at the end of a frame.

    Attributes
    ----------
    pressure : less that outside [Pa]; of `XPBD` the mean over the frame
    volume : [m^3]; work : on the body over the frame [J]
    """

    pressure: float
    volume: float
    work: float


def cavity_readings(details: SolverDetails) -> dict[str, CavityReading]:
    """By name, those of a solver's details."""
    names = details.cavity_pressure
    return {name: CavityReading(names[name], details.cavity_volume[name], details.cavity_work[name]) for name in names}


def start_of(system: System) -> tuple[list[float], list[float], list[float]]:
    """Forces, coordinates and work of all actuators before any step: no force, and no work."""
    zero = [0.0] * len(system.actuators)
    x = system.start_states[-1].positions
    return zero, [each.value(x) for each in system.actuators], zero


def actuator_fields(actuators: Sequence[Actuator], forces: Floats, values: Floats, works: Floats) -> Mapping[str, Any]:
    """The fields of `SolverDetails` for generalized forces, coordinates and work of all actuators."""
    found: dict[str, dict[str, float]] = {"cavity_pressure": {}, "cavity_volume": {}, "cavity_work": {}}
    for each, force, value, work in zip(actuators, forces, values, works, strict=True):
        found["cavity_pressure"][each.name] = float(force)
        found["cavity_volume"][each.name] = float(value)
        found["cavity_work"][each.name] = float(work)
    return found
