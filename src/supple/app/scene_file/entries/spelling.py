"""How a scene file writes each form of a value: its keys and their types. Importing this module registers them."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Union

from pydantic import BeforeValidator, Field, WithJsonSchema

from supple.app.scene_file.entries.kinds import entry_of, keys_of, model_of, spelled
from supple.app.scene_file.entries.mesh_sources import MeshFileModel, MeshStore, surface_model
from supple.app.scene_file.model import Count, Extents, Index, Model, Name, NonNegative, Number, Positive, Vector
from supple.kinds import forms
from supple.materials.own.energy_material import FormulaText, NamedNumbers
from supple.mesh.primitives.shape import SHAPES
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.scene.contact_pairs import NameList
from supple.scene.forces import ForceForm
from supple.scene.inputs import MotorInput
from supple.scene.loads.load import Rows
from supple.scene.loads.muscle import ForceLength
from supple.scene.loads.over_time import Curve, OverTimeOf
from supple.scene.loads.points import Point, PointForm, PointList
from supple.scene.loads.tet_region import Directions
from supple.scene.motion import Keyframes, MotionForm
from supple.scene.rigid.mass_properties import Inertia
from supple.scene.selection import InBox, Vertices
from supple.scene.stitches.stitch import PairList, PerPair


class InputModel(Model):
    """A number that a program sets while the simulation runs; motors with the same name follow the same one."""

    input: Name = Field(description="its name, by which it is set")
    value: Number = Field(default=0.0, description="at the start, and until it is set")

    def build(self, meshes: MeshStore) -> MotorInput:
        return MotorInput(self.input, self.value)


class PointModel(Model):
    """A point of a body, or of the world."""

    alternatives = ("vertex", "place", "give the point by either `vertex` or `place`")

    body: Name | None = Field(default=None, description="without it, `place` is fixed in the world")
    vertex: Index | None = Field(default=None, description="a vertex of the body's mesh, from 0")
    place: Vector | None = Field(default=None, description="instead of `vertex`: in the coordinates of the mesh [m]")

    def build(self, meshes: MeshStore) -> Point:
        return self.body, self.place if self.vertex is None else self.vertex


class ForceLengthModel(Model):
    """A force-length curve, linear between stretches and constant outside."""

    stretches: list[Positive] = Field(min_length=1, description="increasing")
    values: list[NonNegative] = Field(min_length=1, description="one per stretch")

    def build(self, meshes: MeshStore) -> tuple[list[float], list[float]]:
        return self.stretches, self.values


_NAME = {"type": "string", "minLength": 1, "maxLength": 100}


def _as_list(value: Any) -> Any:
    """One name as a list of one, so that an error in a list names its entry."""
    if isinstance(value, str):
        return [value]
    if not isinstance(value, list):
        raise ValueError("give a name, or a list of names")
    return value


Names = Annotated[
    list[Name],
    Field(min_length=1, max_length=10_000),
    BeforeValidator(_as_list),
    WithJsonSchema({"anyOf": [_NAME, {"type": "array", "items": _NAME, "minItems": 1, "maxItems": 10_000}]}),
]


def _plain(form: type[forms.Form], written: Any) -> None:
    spelled.register(form, lambda _: written)


_plain(forms.Flag, bool)
_plain(forms.Name, Name)
_plain(forms.Vector, Vector)
_plain(forms.Direction, Vector)
_plain(forms.Extents, Extents)
_plain(forms.Limits, Annotated[list[Number], Field(min_length=2, max_length=2)])
_plain(Directions, Vector)
_plain(ForceForm, Vector)
_plain(ForceLength, ForceLengthModel)
_plain(NameList, Names)
_plain(PointForm, PointModel)
_plain(PointList, Annotated[list[PointModel], Field(min_length=2)])
_plain(PairList, Annotated[list[Annotated[list[Index], Field(min_length=2, max_length=2)]], Field(min_length=1)])
_plain(Inertia, Annotated[list[Vector], Field(min_length=3, max_length=3)])
_plain(FormulaText, Annotated[str, Field(max_length=4000)])
_plain(NamedNumbers, dict[Name, Number])


@spelled.register
def _(form: forms.Number) -> Any:
    return Annotated[float, Field(gt=form.above, ge=form.least, lt=form.below, le=form.most, allow_inf_nan=False)]


@spelled.register
def _(form: forms.Whole) -> Any:
    return Annotated[int, Field(ge=form.least, le=form.most if form.most is not None else 2**31 - 1)]


@spelled.register
def _(form: forms.Choice) -> Any:
    return Literal[form.words]


@spelled.register
def _(form: forms.Counts) -> Any:
    return Annotated[list[Count], Field(min_length=form.count, max_length=form.count)]


@spelled.register
def _(form: forms.ListOf) -> Any:
    kinds = {"numbers": Number, "vectors": Vector}
    kinds["pairs"] = Annotated[list[Positive], Field(min_length=2, max_length=2)]
    lists = tuple(list[kinds[thing]] for thing in form.things)
    return Annotated[Union[lists], Field(min_length=1, max_length=form.most)]  # noqa: UP007


@spelled.register
def _(form: forms.OneOf) -> Any:
    return entry_of(form.classes)


@spelled.register
def _(form: forms.Or) -> Any:
    return spelled(form.form) | Literal[form.word]


@spelled.register
def _(form: OverTimeOf) -> Any:
    constant = Vector if form.shape else spelled(form.bounds)
    return constant | model_of(Curve, False) | InputModel if form.inputs else constant | model_of(Curve, False)


@spelled.register
def _(form: MotionForm) -> Any:
    return model_of(Keyframes, False)


@spelled.register
def _(form: forms.NumberPerTet) -> Any:
    return spelled(form.bounds)


@spelled.register
def _(form: PerPair) -> Any:
    number = spelled(form.bounds)
    return number | Annotated[list[number], Field(min_length=1)]


@keys_of.register
def _(form: forms.Instance, name: str) -> dict[str, tuple[Any, str]]:
    if TetMesh not in form.classes:
        return {name: (surface_model(), "")}
    keys: dict[str, tuple[Any, str]] = {
        "mesh": (MeshFileModel, "of tetrahedra, or a surface to fill with them"),
        "shape": (entry_of(SHAPES.values()), "instead of `mesh`: a ready-made shape"),
    }
    if SurfaceMesh in form.classes:
        text = "instead of `mesh`, of a rigid body: closed surfaces that are its shape together, and may overlap"
        keys["surfaces"] = Annotated[list[surface_model()], Field(min_length=1, max_length=1000)], text
    return keys


_ROWS = Annotated[list[Index], Field(min_length=1)]


@keys_of.register
def _(form: Vertices, name: str) -> dict[str, tuple[Any, str]]:
    return {
        name: (_ROWS, "vertex numbers, from 0"),
        "box": (model_of(InBox, False), "instead of `vertices`: all vertices inside"),
        "set": (Name, "instead of `vertices`: a set of the body's mesh file (.inp or .msh)"),
    }


@keys_of.register
def _(form: Rows, name: str) -> dict[str, tuple[Any, str]]:
    if not form.boxes:
        return {form.things: (_ROWS, "")}
    box = model_of(InBox, False), f"{form.things} with all corners inside; without it, all"
    return {"box": box, form.things: (_ROWS, "instead of `box`: their numbers, from 0")}
