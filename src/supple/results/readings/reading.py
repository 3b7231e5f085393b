"""What sensors give: the numbers that recordings keep, and the columns of tables that follow from them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from supple.scene.sensors import Sensor, Taxels

_AXES = "xyz"
Columns = dict[str, NDArray[np.float64]]


class Reading(ABC):
    """What one sensor feels in one frame.

    Attributes
    ----------
    quantity : what `value` is, with its unit in brackets
    shape : of `numbers`; of a grid, that depends on the sensor, see `shape_of`
    """

    quantity: ClassVar[str]
    shape: ClassVar[tuple[int, ...]] = ()

    @classmethod
    def shape_of(cls, sensor: Sensor) -> tuple[int, ...]:
        """The shape of `numbers` of a sensor."""
        return cls.shape

    @property
    def unit(self) -> str:
        """The unit of `value`."""
        return self.quantity.rpartition("[")[2].rstrip("]")

    @property
    @abstractmethod
    def value(self) -> float:
        """The one number that stands for it on the live page and in plots."""

    @abstractmethod
    def numbers(self) -> NDArray[np.float64]:
        """All of it, as recordings keep it."""

    @classmethod
    @abstractmethod
    def of_numbers(cls, numbers: NDArray[np.float64]) -> Self:
        """The reading with these `numbers`."""

    @classmethod
    @abstractmethod
    def columns(cls, numbers: NDArray[np.float64]) -> Columns:
        """The columns of a table by the end of their names; numbers : (frames, ...)."""


def vector_columns(name: str, values: NDArray[np.float64]) -> Columns:
    """Three columns of vectors (frames, 3)."""
    return {f"{name}.{axis}" if name else axis: column for axis, column in zip(_AXES, values.T, strict=True)}


@dataclass(frozen=True, eq=False)
class ForceReading(Reading):
    """What a `ForceSensor` feels.

    Attributes
    ----------
    force : (3,) of all contacts, friction included [N]
    normal : how hard they push along the inward normals of the triangles [N]
    center : (3,) the mean place of this push [m]; NaN where nothing touches
    """

    quantity: ClassVar[str] = "normal force on sensors [N]"
    shape: ClassVar[tuple[int, ...]] = (7,)

    force: NDArray[np.float64]
    normal: float
    center: NDArray[np.float64]

    @property
    def value(self) -> float:
        return self.normal

    def numbers(self) -> NDArray[np.float64]:
        return np.concatenate([self.force, [self.normal], self.center])

    @classmethod
    def of_numbers(cls, numbers: NDArray[np.float64]) -> ForceReading:
        return ForceReading(numbers[:3], float(numbers[3]), numbers[4:])

    @classmethod
    def columns(cls, numbers: NDArray[np.float64]) -> Columns:
        center = vector_columns("center", numbers[:, 4:])
        return vector_columns("", numbers[:, :3]) | {"normal": numbers[:, 3]} | center


@dataclass(frozen=True, eq=False)
class TaxelReading(Reading):
    """What `Taxels` feel.

    Attributes
    ----------
    normal : (rows, columns) how hard each cell is pushed along the inward normal of the surface [N]
    shear : (rows, columns, 2) the force along the surface, in the current direction of the grid's first side and across
        it, towards the second side [N]
    """

    quantity: ClassVar[str] = ForceReading.quantity

    normal: NDArray[np.float64]
    shear: NDArray[np.float64]

    @classmethod
    def shape_of(cls, sensor: Sensor) -> tuple[int, ...]:
        assert isinstance(sensor, Taxels)
        return (*sensor.cells, 3)

    @property
    def value(self) -> float:
        return float(self.normal.sum())

    def numbers(self) -> NDArray[np.float64]:
        return np.concatenate([self.normal[:, :, None], self.shear], axis=2)

    @classmethod
    def of_numbers(cls, numbers: NDArray[np.float64]) -> TaxelReading:
        return TaxelReading(numbers[:, :, 0], numbers[:, :, 1:])

    @classmethod
    def columns(cls, numbers: NDArray[np.float64]) -> Columns:
        normal = numbers[..., 0]
        return {"normal": normal.sum(axis=(1, 2)), "max": normal.max(axis=(1, 2))}


@dataclass(frozen=True, eq=False)
class AngleReading(Reading):
    """What an `AngleSensor` feels: `angle`, since the body was placed [rad]."""

    quantity: ClassVar[str] = "angle [rad]"
    shape: ClassVar[tuple[int, ...]] = (1,)

    angle: float

    @property
    def value(self) -> float:
        return self.angle

    def numbers(self) -> NDArray[np.float64]:
        return np.array([self.angle])

    @classmethod
    def of_numbers(cls, numbers: NDArray[np.float64]) -> Self:
        return cls(float(numbers[0]))

    @classmethod
    def columns(cls, numbers: NDArray[np.float64]) -> Columns:
        return {"angle": numbers[:, 0]}


@dataclass(frozen=True, eq=False)
class DistanceReading(Reading):
    """What a `DistanceSensor` feels: `distance` [m]."""

    quantity: ClassVar[str] = "distance [m]"
    shape: ClassVar[tuple[int, ...]] = (1,)

    distance: float

    @property
    def value(self) -> float:
        return self.distance

    def numbers(self) -> NDArray[np.float64]:
        return np.array([self.distance])

    @classmethod
    def of_numbers(cls, numbers: NDArray[np.float64]) -> Self:
        return cls(float(numbers[0]))

    @classmethod
    def columns(cls, numbers: NDArray[np.float64]) -> Columns:
        return {"distance": numbers[:, 0]}


@dataclass(frozen=True, eq=False)
class DrivenReading(Reading):
    """What moves, or holds, bodies: an obstacle or a pin. Every one has it under its name, without a sensor.

    Attributes
    ----------
    displacement : (3,) since the start, of an obstacle of its center, of a pin the mean of its vertices [m]
    angle : by which it has turned, from 0 to pi [rad]
    force : (3,) on bodies, of an obstacle that of contact, friction included [N]; NaN where it is not known
    """

    quantity: ClassVar[str] = "force of obstacles and pins [N]"
    shape: ClassVar[tuple[int, ...]] = (7,)

    displacement: NDArray[np.float64]
    angle: float
    force: NDArray[np.float64]

    @property
    def value(self) -> float:
        return float(np.linalg.norm(self.force))

    def numbers(self) -> NDArray[np.float64]:
        return np.concatenate([self.displacement, [self.angle], self.force])

    @classmethod
    def of_numbers(cls, numbers: NDArray[np.float64]) -> DrivenReading:
        return DrivenReading(numbers[:3], float(numbers[3]), numbers[4:])

    @classmethod
    def columns(cls, numbers: NDArray[np.float64]) -> Columns:
        """`displacement` and `force` are along the direction in which it is displaced farthest.

        Of what does not move, `force` is the size. `work` is on bodies since the first frame [J], by the mean force of
        each two frames; NaN from where it turns on.
        """
        moved, angle, force = numbers[:, :3], numbers[:, 3], numbers[:, 4:]
        size = np.linalg.norm(moved, axis=1)
        if not (size.any() or angle.any()):
            return {"force": np.linalg.norm(force, axis=1)} | vector_columns("force", force)
        farthest = int(np.nanargmax(size))
        direction = moved[farthest] / (size[farthest] or 1.0)
        means = 0.5 * (force[1:] + force[:-1])
        steps = np.einsum("ki,ki->k", means, np.diff(moved, axis=0))
        work = np.concatenate([[0.0], np.cumsum(np.where(angle[1:] > 0.0, np.nan, steps))])
        found = {"displacement": moved @ direction, "force": force @ direction, "work": work}
        found |= {"angle": angle} if angle.any() else {}
        return found | vector_columns("displacement", moved) | vector_columns("force", force)


# By the kind of the sensor.
READINGS: dict[str, type[Reading]] = {
    "force": ForceReading,
    "taxels": TaxelReading,
    "angle": AngleReading,
    "distance": DistanceReading,
    "driven": DrivenReading,
}
