"""The whole of a scene file."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from supple.app.scene_file.entries.actuators.cables import CableModel
from supple.app.scene_file.entries.actuators.cavities import CavityModel
from supple.app.scene_file.entries.bodies import BodyModel
from supple.app.scene_file.entries.contact_pairs import ContactPairModel
from supple.app.scene_file.entries.joints import JointModel, WeldModel
from supple.app.scene_file.entries.loads import LoadModel
from supple.app.scene_file.entries.obstacles import ObstacleModel
from supple.app.scene_file.entries.selections import ForceModel, PinModel, SoftTargetModel
from supple.app.scene_file.entries.sensors import SensorModel
from supple.app.scene_file.entries.solvers import SolverModel, XPBDModel
from supple.app.scene_file.entries.stitches import StitchModel
from supple.app.scene_file.fraction import number_or_fraction
from supple.app.scene_file.model import Model, Vector
from supple.results.readings.fields import FIELDS
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


class SceneFileModel(Model):
    """Bodies, obstacles and pins under gravity, the solver, and the timing of a run. SI units; y is up."""

    supple: Literal[1] = Field(default=1, description="version of this format")
    bodies: list[BodyModel] = Field(min_length=1, max_length=10_000)
    obstacles: list[ObstacleModel] = Field(default=[], max_length=10_000)
    pins: list[PinModel] = Field(default=[], max_length=10_000)
    forces: list[ForceModel] = Field(default=[], max_length=10_000)
    loads: list[LoadModel] = Field(default=[], max_length=10_000)
    cavities: list[CavityModel] = Field(default=[], max_length=10_000)
    cables: list[CableModel] = Field(default=[], max_length=10_000)
    sensors: list[SensorModel] = Field(default=[], max_length=10_000)
    soft_targets: list[SoftTargetModel] = Field(default=[], max_length=10_000)
    contact_pairs: list[ContactPairModel] = Field(default=[], max_length=10_000)
    stitches: list[StitchModel] = Field(default=[], max_length=10_000)
    joints: list[JointModel] = Field(default=[], max_length=10_000)
    welds: list[WeldModel] = Field(default=[], max_length=10_000)
    gravity: Vector = Field(default=[0.0, -9.81, 0.0], description="[m/s^2]")
    solver: SolverModel = Field(default_factory=lambda: XPBDModel(kind="xpbd"))
    dt: Seconds = Field(default=1.0 / 60.0, description="time from frame to frame [s], or a fraction such as 1/60")
    steps: int = Field(default=300, ge=0, le=MAX_STEPS, description="number of frames")
    output: OutputModel = Field(default_factory=OutputModel)


def json_schema() -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of scene files, for editors and other programs."""
    schema = SceneFileModel.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "Supple scene"}
