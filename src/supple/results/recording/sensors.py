"""What a recording keeps of sensors: a series of numbers for each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from supple.results.readings.sensor_readings import numbers_shape
from supple.results.recording.checked_hdf5 import CheckedFile
from supple.results.recording.file import Series
from supple.scene.scene import Scene


@dataclass(frozen=True)
class RecordedSensor:
    """One sensor.

    Attributes
    ----------
    number : in the scene; name : of the sensor
    shape : of its numbers; see `numbers` of the readings
    """

    number: int
    name: str
    shape: tuple[int, ...]

    @property
    def is_grid(self) -> bool:
        """Whether the sensor is a grid of taxels."""
        return len(self.shape) == 3

    @property
    def series(self) -> Series:
        return Series(f"supple/frames/sensors/{self.number}", 1, self.shape)

    def described(self) -> dict[str, Any]:
        """As the header has it."""
        return {"name": self.name, "cells": list(self.shape[:2]) if self.is_grid else None}


def recorded_sensors(scene: Scene) -> tuple[RecordedSensor, ...]:
    """The sensors of a scene."""
    return tuple(RecordedSensor(k, sensor.name, numbers_shape(sensor)) for k, sensor in enumerate(scene.sensors))


def sensors_of_header(file: CheckedFile, header: dict[str, Any]) -> tuple[RecordedSensor, ...]:
    """The sensors of a recording.

    Raises
    ------
    OutputError : where they are not described as they should be.
    """
    try:
        found = []
        for k, given in enumerate(header["sensors"]):
            cells = None if given["cells"] is None else [int(count) for count in given["cells"]]
            if cells is not None and (len(cells) != 2 or min(cells) < 1):
                raise ValueError
            found.append(RecordedSensor(k, str(given["name"]), (7,) if cells is None else (*cells, 3)))
        return tuple(found)
    except (KeyError, TypeError, ValueError):
        raise file.broken("the sensors in its header are not described as they should be") from None
