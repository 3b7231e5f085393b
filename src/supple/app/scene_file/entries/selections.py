"""Parts of a scene file that select vertices of one body: pins, forces and soft targets."""

from __future__ import annotations

from pydantic import Field, model_validator

from supple.app.scene_file.entries.motions import KeyframesModel, built_motion
from supple.app.scene_file.model import Index, Model, Name, Positive, Vector
from supple.scene.forces import Force, SoftTarget
from supple.scene.located import at
from supple.scene.pins import Pin
from supple.scene.selection import InBox, Selection


class InBoxModel(Model):
    """The vertices inside an axis-aligned box of world coordinates, at the start."""

    low: Vector = Field(description="corner with the lowest coordinates [m]")
    high: Vector = Field(description="corner with the highest coordinates [m]")


class _SelectionModel(Model):
    alternatives = ("vertices", "box", "set", "give the vertices by either `vertices`, `box` or `set`")

    body: Name = Field(description="name of the body")
    vertices: list[Index] | None = Field(default=None, min_length=1, description="vertex numbers, from 0")
    box: InBoxModel | None = Field(default=None, description="instead of `vertices`: all vertices inside")
    set: Name | None = Field(
        default=None, description="instead of `vertices`: a set of the body's mesh file (.inp or .msh)"
    )
    name: Name | None = Field(default=None, description="used in messages and reports")

    def selection(self) -> Selection:
        if self.box is not None:
            with at("box"):
                return InBox(self.box.low, self.box.high)
        assert self.vertices is not None
        return self.vertices


class PinModel(_SelectionModel):
    """Vertices of a soft body that are held, or moved by keyframes; or a rigid body, without any of the three."""

    alternatives = None

    motion: KeyframesModel | None = Field(default=None, description="from the start; without it the vertices are held")

    @model_validator(mode="after")
    def _one_selection(self) -> PinModel:
        if sum(given is not None for given in (self.vertices, self.box, self.set)) > 1:
            raise ValueError("give the vertices by either `vertices`, `box` or `set`")
        return self

    def build(self) -> Pin:
        whole = self.vertices is None and self.box is None
        return Pin(self.body, None if whole else self.selection(), built_motion(self.motion), name=self.name)


class ForceModel(_SelectionModel):
    """A load on vertices of one body that keeps its direction (implicit solver)."""

    force: Vector = Field(description="total force, divided equally among the vertices [N]")

    def build(self) -> Force:
        return Force(self.body, self.selection(), self.force, name=self.name)


class SoftTargetModel(_SelectionModel):
    """Springs from vertices of one body to their starts, or to points moved by keyframes (implicit solver)."""

    stiffness: Positive = Field(description="of each vertex's spring [N/m]")
    motion: KeyframesModel | None = Field(default=None, description="of the springs' other ends")

    def build(self) -> SoftTarget:
        return SoftTarget(self.body, self.selection(), self.stiffness, built_motion(self.motion), name=self.name)
