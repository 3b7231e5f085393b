"""Study files: a YAML text that names a scene file, the factors, the design and the measures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from supple.app.scene_file.model import FilePath, Model, Name, Number
from supple.app.scene_file.validation_errors import scene_error
from supple.app.scene_file.yaml_files import YamlDocument, read_yaml
from supple.app.studies import designs
from supple.app.studies.factors import MOST_LEVELS, Factor, Levels, LogUniform, Uniform
from supple.app.studies.measures import BodyMeasure, Measures, SeriesMeasure
from supple.app.studies.sources import FileSource
from supple.app.studies.study import Study
from supple.errors import StudyError

Samples = Annotated[int, Field(ge=1, le=designs.MOST_CASES, description="number of cases")]
Seed = Annotated[int, Field(ge=0, lt=2**63, description="of the random numbers")]
Time = Annotated[Literal["first", "last", "min", "mean", "max", "range", "sum"], Field(description="over the frames")]
Over = Annotated[Literal["min", "mean", "max", "range"], Field(description="over the vertices")]
Axis = Literal["x", "y", "z", "length"]


class FactorModel(Model):
    """The values of one quantity: a list, or a range."""

    paths: list[Name] | None = Field(
        default=None, min_length=1, max_length=1000, description="what it sets; default: the factor's name is the path"
    )
    values: list[Any] | None = Field(default=None, min_length=1, max_length=MOST_LEVELS)
    uniform: Annotated[list[Number], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="instead of `values`: a range of numbers"
    )
    loguniform: Annotated[list[Number], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="instead of `values`: a range of numbers, evenly in their logarithms"
    )
    count: int | None = Field(default=None, ge=1, le=MOST_LEVELS, description="levels of a range in a grid")

    def build(self) -> Factor:
        given = [key for key in ("values", "uniform", "loguniform") if getattr(self, key) is not None]
        if len(given) != 1:
            raise StudyError("a factor needs one of `values`, `uniform` and `loguniform`")
        if self.values is not None:
            return Levels(tuple(self.values))
        if self.uniform is not None:
            return Uniform(self.uniform[0], self.uniform[1], self.count)
        assert self.loguniform is not None
        return LogUniform(self.loguniform[0], self.loguniform[1], self.count)


class GridModel(Model):
    """Every combination of all values."""

    kind: Literal["grid"]

    def build(self) -> designs.Design:
        return designs.Grid()


class PairedModel(Model):
    """The first values of all factors, then the second ones, and so on."""

    kind: Literal["paired"]

    def build(self) -> designs.Design:
        return designs.Paired()


class OneAtATimeModel(Model):
    """The middle values, then each factor alone at its low and at its high value."""

    kind: Literal["one_at_a_time"]

    def build(self) -> designs.Design:
        return designs.OneAtATime()


class LatinHypercubeModel(Model):
    """Random points, one in each stratum of every factor."""

    kind: Literal["latin_hypercube"]
    samples: Samples
    seed: Seed = 0

    def build(self) -> designs.Design:
        return designs.LatinHypercube(self.samples, self.seed)


class SobolModel(Model):
    """The scrambled sequence of Sobol'."""

    kind: Literal["sobol"]
    samples: Samples
    seed: Seed = 0

    def build(self) -> designs.Design:
        return designs.Sobol(self.samples, self.seed)


DesignModel = Annotated[
    GridModel | PairedModel | OneAtATimeModel | LatinHypercubeModel | SobolModel, Field(discriminator="kind")
]


class _SeriesModel(Model):
    time: Time = "last"

    def build(self) -> SeriesMeasure:
        return SeriesMeasure(**self.model_dump())


class NumberMeasureModel(_SeriesModel):
    """A number that every frame reports."""

    quantity: Literal[
        "kinetic_energy",
        "elastic_energy",
        "potential_energy",
        "stitch_energy",
        "min_det_F",
        "min_distance",
        "largest_stitch_stretch",
        "wall_seconds",
    ]


class VectorMeasureModel(_SeriesModel):
    """A vector that every frame reports."""

    quantity: Literal["linear_momentum", "angular_momentum"]
    axis: Axis = "length"


class BodyMeasureModel(Model):
    """A vector of the vertices of a body."""

    quantity: Literal["position", "displacement", "velocity"]
    body: Name
    axis: Axis = "length"
    vertices: list[Annotated[int, Field(ge=0)]] | None = Field(default=None, min_length=1, description="default: all")
    over: Over = "mean"
    time: Time = "last"

    def build(self) -> BodyMeasure:
        vertices = None if self.vertices is None else tuple(self.vertices)
        return BodyMeasure(**self.model_dump(exclude={"vertices"}), vertices=vertices)


MeasureModel = Annotated[NumberMeasureModel | VectorMeasureModel | BodyMeasureModel, Field(discriminator="quantity")]


class StudyFileModel(Model):
    """A study: which values of a scene file vary, how, and what is measured."""

    supple_study: Literal[1] = Field(default=1, description="version of this format")
    scene: FilePath = Field(description="the scene file, relative to this file")
    factors: dict[Name, FactorModel] = Field(
        min_length=1, max_length=100, description="by dotted path into the scene file: bodies.bear.material.youngs"
    )
    design: DesignModel = Field(default_factory=lambda: GridModel(kind="grid"))
    measures: dict[Name, MeasureModel] = Field(min_length=1, max_length=1000)


def study_schema() -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of study files, for editors and other programs."""
    schema = StudyFileModel.model_json_schema()
    factors = schema["properties"]["factors"]
    levels = {"type": "array", "minItems": 1, "maxItems": MOST_LEVELS, "description": "values"}
    factors["additionalProperties"] = {"anyOf": [levels, factors["additionalProperties"]]}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "Supple study"}


def load_study(path: str | Path) -> Study:
    """Read a study file (YAML), and the scene file that it names.

    Parameters
    ----------
    path : of the study file.

    Raises
    ------
    SceneError, StudyError : where one of them cannot be read, or is not valid; one line that begins with the file.
    """
    document = read_yaml(path)
    try:
        model = StudyFileModel.model_validate(_explicit(document.data))
    except ValidationError as error:
        raise scene_error(replace(document, data=_explicit(document.data)), error) from None
    factors = {name: _located(document, described.build, "factors", name) for name, described in model.factors.items()}
    paths = {name: tuple(described.paths or [name]) for name, described in model.factors.items()}
    design = _located(document, model.design.build, "design")
    measures = Measures({name: measure.build() for name, measure in model.measures.items()})
    source = FileSource(Path(path).parent / model.scene)
    return Study(source, factors, paths, design, measures, measures.units)


def _located(document: YamlDocument, build: Callable[[], Any], *keys: str) -> Any:
    """What `build` makes; its errors begin with file, line and keys."""
    try:
        return build()
    except StudyError as error:
        raise StudyError(str(document.error(keys, str(error)))) from None


def _explicit(data: Any) -> Any:
    """The data with `[1, 2]` written as `{values: [1, 2]}`: errors then name one form, not two."""
    if not isinstance(data, dict) or not isinstance(data.get("factors"), dict):
        return data
    factors = {name: {"values": given} if isinstance(given, list) else given for name, given in data["factors"].items()}
    return {**data, "factors": factors}
