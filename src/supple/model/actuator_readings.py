"""The actuators of a scene after a step: pressures, volumes, tensions, lengths and works."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.kinds.suggestion import Named
from supple.model.state import SolverDetails
from supple.model.system import System


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


@dataclass(frozen=True)
class CableReading:
    """A cable at the end of a frame.

    Attributes
    ----------
    tension : of each span, from the first point to the winch [N]; of `XPBD` the mean over the frame
    length : sum of the spans [m]; work : on the bodies over the frame, friction included [J]
    """

    tension: tuple[float, ...]
    length: float
    work: float


def cavity_readings(details: SolverDetails) -> dict[str, CavityReading]:
    """By name, those of a solver's details."""
    pressures = details.cavity_pressure
    readings = {n: CavityReading(pressures[n], details.cavity_volume[n], details.cavity_work[n]) for n in pressures}
    return Named("cavity", readings)


def cable_readings(details: SolverDetails) -> dict[str, CableReading]:
    """By name, those of a solver's details."""
    readings: dict[str, CableReading] = Named("cable", {})
    for name, length in details.cable_length.items():
        tensions = [value for key, value in details.cable_tension.items() if key.rpartition(".")[0] == name]
        readings[name] = CableReading(tuple(tensions), length, details.cable_work[name])
    return readings


def start_of(system: System) -> list[list[NDArray[np.float64]]]:
    """Forces, coordinates and work of all actuators before any step: no force, and no work."""
    x = system.start_states[-1].positions
    parts = [actuator.parts(x) for actuator in system.actuators]
    zero = [np.zeros_like(part) for part in parts]
    return [zero, parts, zero]


def actuator_fields(
    system: System,
    forces: Sequence[NDArray[np.float64]],
    parts: Sequence[NDArray[np.float64]],
    works: Sequence[NDArray[np.float64]],
) -> Mapping[str, Any]:
    """The fields of `SolverDetails` for the generalized forces, the coordinates and the work of all actuators.

    Each is an array (p,) for the parts of the coordinate.
    """
    names = ("cavity_pressure", "cavity_volume", "cavity_work", "cable_tension", "cable_length", "cable_work")
    by_field: dict[str, dict[str, float]] = {name: {} for name in names}
    for actuator, Q, s, work in zip(system.actuators, forces, parts, works, strict=True):
        if actuator.kind == "cavity":
            by_field["cavity_pressure"][actuator.name] = float(Q[0])
            by_field["cavity_volume"][actuator.name] = float(s[0])
        else:
            by_field["cable_tension"] |= {f"{actuator.name}.{k}": max(-float(value), 0.0) for k, value in enumerate(Q)}
            by_field["cable_length"][actuator.name] = float(s.sum())
        by_field[f"{actuator.kind}_work"][actuator.name] = float(work.sum())
    return by_field
