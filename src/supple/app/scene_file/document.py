"""The whole of a scene file."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema, create_model

from supple.app.scene_file.entries import schema_types as schema_types  # registers how values are written
from supple.app.scene_file.entries.body import BodyEntry, body_model
from supple.app.scene_file.entries.kinds import KindModel, entry_of, model_of
from supple.app.scene_file.entries.mesh_sources import surface_model
from supple.app.scene_file.model import Model, Name, Number, Vector, number_or_fraction
from supple.materials.registry import MATERIALS
from supple.mesh.primitives.shape import SHAPES, SURFACES
from supple.results.readings.fields import FIELDS
from supple.scene.joints.motors import MOTORS
from supple.scene.registry import PARTS
from supple.simulate import DT_RANGE
from supple.solvers.auto import Auto
from supple.solvers.registry import SOLVERS

MAX_STEPS = 10_000_000


def _seconds(value: Any) -> Any:
    """A time [s], or a fraction such as `1/60`."""
    if isinstance(value, str) and "/" in value:
        try:
            return number_or_fraction(value)
        except ValueError:
            return value
    return value


Seconds = Annotated[
    float,
    Field(ge=DT_RANGE[0], le=1e6, allow_inf_nan=False),
    BeforeValidator(_seconds),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "minimum": DT_RANGE[0], "maximum": 1e6},
                {"type": "string", "pattern": r"^\s*[0-9.eE+-]+\s*/\s*[0-9.eE+-]+\s*$"},
            ]
        }
    ),
]


FieldName = Literal[tuple(FIELDS)]  # pyright: ignore[reportInvalidTypeForm]


class OutputModel(Model):
    """Files that `supple run` writes in addition to the recording."""

    page: bool = Field(default=True, description="index.html, which plays the recording in a browser")
    compress: bool = Field(default=False, description="store the recording compressed: smaller, and slower to write")
    fields: list[FieldName] = Field(  # pyright: ignore[reportInvalidTypeForm]
        default=[], description="recorded in addition, for ParaView: see the documentation"
    )
    plot: bool = Field(default=True, description="plot.png: energies, momentum, volume ratio and smallest J over time")


class SceneFileModel(Model):
    """Bodies, obstacles and pins under gravity, the solver, and the timing of a run. SI units; y is up."""

    supple: Literal[1] = Field(default=1, description="version of this format")
    bodies: list[BodyEntry]
    gravity: Vector = Field(default=[0.0, -9.81, 0.0], description="[m/s^2]")
    joint_positions: dict[Name, Number] = Field(
        default={},
        max_length=10_000,
        description="of hinges and sliders at the start, by name [rad] or [m]: bodies are placed so",
    )
    solver: KindModel
    dt: Seconds = Field(default=1.0 / 60.0, description="time from frame to frame [s], or a fraction such as 1/60")
    steps: int = Field(default=300, ge=0, le=MAX_STEPS, description="number of frames")
    output: OutputModel = Field(default_factory=OutputModel)

    def entries(self, key: str) -> list[KindModel]:
        """Those of one of the lists."""
        return getattr(self, key)


def scene_file_model() -> type[SceneFileModel]:
    """`SceneFileModel` with the keys of all kinds that are known now."""
    lists = (*(part.kinds for part in PARTS.values()), MATERIALS, SOLVERS, MOTORS)
    return _of_kinds(tuple(map(tuple, (*lists, SHAPES.values(), SURFACES.values()))))


@lru_cache(maxsize=1)
def _of_kinds(known: tuple[tuple[Any, ...], ...]) -> type[SceneFileModel]:
    for cached in (model_of, surface_model, body_model):
        cached.cache_clear()  # kinds contain others: a material that relaxes has one of the known materials
    keys: dict[str, Any] = {
        key: (list[entry_of(part.kinds)], Field(default=[], max_length=10_000))
        for key, part in PARTS.items()
        if key != "bodies"
    }
    keys["bodies"] = list[body_model()], Field(min_length=1, max_length=10_000)
    keys["solver"] = (
        entry_of(SOLVERS),
        Field(default_factory=lambda: model_of(Auto, True).model_validate({"kind": "auto"})),
    )
    return create_model("SceneFileModel", __base__=SceneFileModel, __doc__=SceneFileModel.__doc__, **keys)


def json_schema() -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of scene files, for editors and other programs."""
    schema = scene_file_model().model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "Supple scene"}
