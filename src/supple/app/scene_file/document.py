"""The whole of a scene file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema, create_model

from supple.app.scene_file.entries import spelling as spelling  # registers how values are written
from supple.app.scene_file.entries.bodies import BodyModel
from supple.app.scene_file.entries.families import SOLVERS, model_of_kind
from supple.app.scene_file.entries.kinds import KindModel, entry_of
from supple.app.scene_file.model import Model, Name, Number, Vector, number_or_fraction
from supple.kinds.kind import Kind
from supple.model.loads.build import LOADS
from supple.results.readings.fields import FIELDS
from supple.scene.contact_pairs import ContactPair
from supple.scene.forces import Force, SoftTarget
from supple.scene.joints.weld import Weld
from supple.scene.loads.cable import Cable
from supple.scene.loads.cavity import Cavity
from supple.scene.pins import Pin
from supple.scene.registry import JOINTS, STITCHES
from supple.scene.registry import KINDS as OBSTACLES
from supple.scene.sensors import SENSORS
from supple.simulate import DT_RANGE

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


# The lists of a scene file and the kinds of their entries; the scene has a parameter of each name.
KINDS_OF_LISTS: dict[str, Sequence[type[Kind]]] = {
    "obstacles": tuple(OBSTACLES.values()),
    "pins": (Pin,),
    "forces": (Force,),
    "loads": (*LOADS, Force, SoftTarget),
    "cavities": (Cavity,),
    "cables": (Cable,),
    "sensors": SENSORS,
    "soft_targets": (SoftTarget,),
    "contact_pairs": (ContactPair,),
    "stitches": STITCHES,
    "joints": JOINTS,
    "welds": (Weld,),
}


class _SceneFileModel(Model):
    """Bodies, obstacles and pins under gravity, the solver, and the timing of a run. SI units; y is up."""

    supple: Literal[1] = Field(default=1, description="version of this format")
    bodies: list[BodyModel] = Field(min_length=1, max_length=10_000)
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


if TYPE_CHECKING:
    SceneFileModel = _SceneFileModel
else:
    _LISTS = {
        key: (list[entry_of(kinds)], Field(default=[], max_length=10_000)) for key, kinds in KINDS_OF_LISTS.items()
    }
    _SOLVER = entry_of(SOLVERS), Field(default_factory=lambda: model_of_kind("auto"))
    SceneFileModel = create_model(
        "SceneFileModel",
        __base__=_SceneFileModel,
        __doc__=_SceneFileModel.__doc__,
        __module__=__name__,
        solver=_SOLVER,
        **_LISTS,
    )


def json_schema() -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of scene files, for editors and other programs."""
    schema = SceneFileModel.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "Supple scene"}
