"""What a recording keeps of sensors: a series of numbers for each."""

from __future__ import annotations

from dataclasses import dataclass

from supple.results.readings.sensor_readings import numbers_shape
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


def recorded_sensors(scene: Scene) -> tuple[RecordedSensor, ...]:
    """The sensors of a scene."""
    return tuple(RecordedSensor(k, sensor.name, numbers_shape(sensor)) for k, sensor in enumerate(scene.sensors))
