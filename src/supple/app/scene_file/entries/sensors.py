"""Sensors of a scene file, by `kind`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from supple.app.scene_file.entries.loads import OnSurfaceModel
from supple.app.scene_file.model import Count, Name, Vector
from supple.scene.sensors import ForceSensor, Sensor, Taxels


class ForceSensorModel(OnSurfaceModel):
    """The force of all contacts on a part of a surface."""

    kind: Literal["force"]
    name: Name = Field(description="under which frames and tables have it")

    def build(self) -> Sensor:
        return ForceSensor(self.name, self.body, self.region())


class TaxelsModel(OnSurfaceModel):
    """A grid of cells that feel normal and shear force."""

    kind: Literal["taxels"]
    name: Name = Field(description="under which frames and tables have it")
    corner: Vector = Field(description="of the grid, in the coordinates of the mesh [m]")
    first: Vector = Field(description="a side of the grid [m]")
    second: Vector = Field(description="the other side [m]")
    cells: Annotated[list[Count], Field(min_length=2, max_length=2)] = Field(description="numbers along both sides")

    def build(self) -> Sensor:
        cells = (self.cells[0], self.cells[1])
        return Taxels(self.name, self.body, self.corner, self.first, self.second, cells, self.region())


SensorModel = Annotated[ForceSensorModel | TaxelsModel, Field(discriminator="kind")]
