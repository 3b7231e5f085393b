"""Pins of a scene file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from supple.scene.pins import InBox, Pin
from supple.scene_file.located import at
from supple.scene_file.model import Model, Name, Vector
from supple.scene_file.motions import KeyframesModel

VertexIndex = Annotated[int, Field(ge=0, lt=2**31)]


class InBoxModel(Model):
    """The vertices inside an axis-aligned box of world coordinates, at the start."""

    low: Vector = Field(description="corner with the lowest coordinates [m]")
    high: Vector = Field(description="corner with the highest coordinates [m]")


class PinModel(Model):
    """Vertices of one body that are held, or moved by keyframes. Give `vertices` or `box`."""

    body: Name = Field(description="name of the body")
    vertices: list[VertexIndex] | None = Field(default=None, min_length=1, description="vertex numbers, from 0")
    box: InBoxModel | None = Field(default=None, description="instead of `vertices`: all that are inside")
    motion: KeyframesModel | None = Field(
        default=None, description="from where the vertices are at the start; held without it"
    )
    name: Name | None = Field(default=None, description="stands in messages and reaction forces")

    @model_validator(mode="after")
    def _one_selection(self) -> PinModel:
        if (self.vertices is None) == (self.box is None):
            raise ValueError("a pin needs either `vertices` or `box`; give one of them")
        return self

    def build(self) -> Pin:
        with at("motion"):
            motion = self.motion.build() if self.motion else None
        if self.box is not None:
            with at("box"):
                return Pin(self.body, InBox(self.box.low, self.box.high), motion, name=self.name)
        assert self.vertices is not None
        return Pin(self.body, self.vertices, motion, name=self.name)
