"""Copies of a body of a scene file, in a grid or at given offsets."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from supple.app.scene_file.model import Count, Model, Vector

MAX_COPIES = 10_000


class CopiesModel(Model):
    """Copies of the body, named name01, name02, ...: at given offsets, or in a grid."""

    offsets: list[Vector] | None = Field(
        default=None, min_length=1, max_length=MAX_COPIES, description="from `position` [m]"
    )
    rotations: list[Vector] | None = Field(default=None, description="one per offset, instead of the body's [rad]")
    grid: Annotated[list[Count], Field(min_length=3, max_length=3)] | None = Field(
        default=None, description="instead of `offsets`: how many along x, y and z"
    )
    spacing: Vector | None = Field(default=None, description="between neighbours of the grid [m]")

    @model_validator(mode="after")
    def _one_layout(self) -> CopiesModel:
        if (self.offsets is None) == (self.grid is None):
            raise ValueError("copies need either `offsets` or `grid`; give one of them")
        if (self.grid is None) != (self.spacing is None):
            raise ValueError("`grid` needs `spacing`; give both or neither")
        if self.grid is not None and np.prod([float(n) for n in self.grid]) > MAX_COPIES:
            raise ValueError(f"grid {self.grid} makes more than {MAX_COPIES} copies; make it smaller")
        if self.rotations is not None and (self.offsets is None or len(self.rotations) != len(self.offsets)):
            raise ValueError("`rotations` needs one entry for each of `offsets`")
        return self

    def placements(self) -> Iterator[tuple[NDArray[np.float64], list[float] | None]]:
        """Offset (3,) [m], and rotation where one is given, of each copy."""
        if self.offsets is not None:
            for i, offset in enumerate(self.offsets):
                yield np.array(offset), self.rotations[i] if self.rotations else None
        if self.grid is not None:
            for cell in np.ndindex(*reversed(self.grid)):
                yield np.array(cell[::-1]) * np.array(self.spacing), None
