"""How a scene file writes what validators check: keys and their types. Importing this module registers them."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from supple.app.scene_file.entries.arrays import array_type
from supple.app.scene_file.entries.kinds import entry_of, keys_of, model_of, schema_type
from supple.app.scene_file.entries.mesh_sources import MeshFileModel, MeshStore, surface_model
from supple.app.scene_file.model import (
    Count,
    Extents,
    Index,
    Model,
    Name,
    NonNegative,
    Number,
    Positive,
    Vector,
)
from supple.kinds import validators
from supple.materials.own.energy_material import FormulaText, NamedNumbers
from supple.mesh.primitives.shape import SHAPES
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.scene.contact_pairs import NameList
from supple.scene.forces import AlongAxes, ForceValidator
from supple.scene.inputs import MotorInput
from supple.scene.loads.load import Rows
from supple.scene.loads.muscle import ForceLength
from supple.scene.loads.over_time import Curve, OverTimeOf
from supple.scene.loads.points import Point, PointList, PointValidator
from supple.scene.loads.tet_region import Directions
from supple.scene.motion import Keyframes, MotionValidator
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


def _plain(validator: type[validators.Validator], written: Any) -> None:
    schema_type.register(validator, lambda _: written)


_plain(validators.Boolean, bool)
_plain(validators.Name, Name)
_plain(validators.Vector, Vector)
_plain(validators.Direction, Vector)
_plain(validators.Extents, Extents)
_plain(validators.Limits, Annotated[list[float], Field(min_length=2, max_length=2)])
_plain(Directions, array_type(row=Vector, rows=list[Vector]))
_plain(ForceValidator, array_type(row=Vector, rows=list[Vector]))
_plain(AlongAxes, Positive | Annotated[list[NonNegative], Field(min_length=3, max_length=3)])
_plain(ForceLength, ForceLengthModel)
_plain(NameList, Names)
_plain(PointValidator, PointModel)
_plain(PointList, Annotated[list[PointModel], Field(min_length=2)])
_PAIR = Annotated[list[Index], Field(min_length=2, max_length=2)]
_plain(PairList, array_type(rows=Annotated[list[_PAIR], Field(min_length=1)]))
_plain(Inertia, Annotated[list[Vector], Field(min_length=3, max_length=3)])
_plain(FormulaText, Annotated[str, Field(max_length=4000)])
_plain(NamedNumbers, dict[Name, array_type(Number, list[Number])])


@schema_type.register
def _(number: validators.Number) -> Any:
    return Annotated[
        float, Field(gt=number.above, ge=number.least, lt=number.below, le=number.most, allow_inf_nan=False)
    ]


@schema_type.register
def _(validator: validators.Integer) -> Any:
    return Annotated[int, Field(ge=validator.least, le=validator.most if validator.most is not None else 2**31 - 1)]


@schema_type.register
def _(validator: validators.Choice) -> Any:
    return Literal[validator.words]


@schema_type.register
def _(validator: validators.Counts) -> Any:
    return Annotated[list[Count], Field(min_length=validator.count, max_length=validator.count)]


@schema_type.register
def _(validator: validators.ListOf) -> Any:
    kinds = {"numbers": Number, "vectors": Vector}
    kinds["pairs"] = Annotated[list[Positive], Field(min_length=2, max_length=2)]
    kinds["rows"] = Annotated[list[Index], Field(min_length=2, max_length=2)]
    lists = {
        "row" if thing == "numbers" else "rows": Annotated[
            list[kinds[thing]], Field(min_length=1, max_length=validator.most)
        ]
        for thing in validator.things
    }
    return array_type(**lists)


@schema_type.register
def _(validator: validators.OneOf) -> Any:
    return entry_of(validator.classes)


@schema_type.register
def _(validator: validators.Union) -> Any:
    return schema_type(validator.validator) | Literal[validator.word]


@schema_type.register
def _(validator: OverTimeOf) -> Any:
    constant = Vector if validator.shape else schema_type(validator.bounds)
    return constant | model_of(Curve, False) | InputModel if validator.inputs else constant | model_of(Curve, False)


@schema_type.register
def _(validator: MotionValidator) -> Any:
    return model_of(Keyframes, False)


@schema_type.register
def _(validator: validators.NumberPerTet) -> Any:
    number = schema_type(validator.bounds)
    return array_type(number, list[number])


@schema_type.register
def _(validator: PerPair) -> Any:
    number = schema_type(validator.bounds)
    return array_type(number, Annotated[list[number], Field(min_length=1)])


@keys_of.register
def _(validator: validators.Instance, name: str) -> dict[str, tuple[Any, str]]:
    if TetMesh not in validator.classes:
        return {name: (surface_model(), "")}
    keys: dict[str, tuple[Any, str]] = {
        "mesh": (MeshFileModel, "of tetrahedra, or a surface to fill with them"),
        "shape": (entry_of(SHAPES.values()), "instead of `mesh`: a ready-made shape"),
    }
    if SurfaceMesh in validator.classes:
        text = "instead of `mesh`, of a rigid body: closed surfaces that are its shape together, and may overlap"
        keys["surfaces"] = Annotated[list[surface_model()], Field(min_length=1, max_length=1000)], text
    return keys


_ROWS = array_type(row=Annotated[list[Index], Field(min_length=1)])


@keys_of.register
def _(validator: Vertices, name: str) -> dict[str, tuple[Any, str]]:
    return {
        name: (_ROWS, "vertex numbers, from 0"),
        "box": (model_of(InBox, False), "instead of `vertices`: all vertices inside"),
        "set": (Name, "instead of `vertices`: a set of the body's mesh file (.inp or .msh)"),
    }


@keys_of.register
def _(validator: Rows, name: str) -> dict[str, tuple[Any, str]]:
    if not validator.boxes:
        return {validator.things: (_ROWS, "")}
    box = model_of(InBox, False), f"{validator.things} with all corners inside; without it, all"
    return {"box": box, validator.things: (_ROWS, "instead of `box`: their numbers, from 0")}
