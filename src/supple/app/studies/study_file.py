"""Study files: a YAML text that names a scene file, the factors, the design and the measures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, ValidationError

from supple.app.scene_file.entries.kinds import built, entry_of, model_of, schema_type
from supple.app.scene_file.entries.mesh_sources import MeshStore
from supple.app.scene_file.model import FilePath, Model, Name
from supple.app.scene_file.validation_errors import scene_error
from supple.app.scene_file.yaml_files import read_yaml
from supple.app.studies.factors import DESIGNS, MOST_LEVELS, Factor, Grid, Values
from supple.app.studies.measures import Measure, Measures
from supple.app.studies.sources import varied_file
from supple.app.studies.study import Study, units_of_paths
from supple.errors import StudyError
from supple.scene.located import LocatedError


@schema_type.register
def _(validator: Values) -> Any:
    item: Any = Any if validator.item is None else schema_type(validator.item)
    return Annotated[list[item], Field(min_length=1, max_length=MOST_LEVELS)]


if TYPE_CHECKING:
    FactorModel = DesignModel = MeasureModel = Any
else:
    FactorModel, DesignModel, MeasureModel = model_of(Factor, False), entry_of(DESIGNS), model_of(Measure, False)


class StudyFileModel(Model):
    """A study: which values of a scene file vary, how, and what is measured."""

    supple_study: Literal[1] = Field(default=1, description="version of this format")
    scene: FilePath = Field(description="the scene file, relative to this file")
    factors: dict[Name, FactorModel] = Field(
        min_length=1, max_length=100, description="by dotted path into the scene file: bodies.bear.material.youngs"
    )
    design: DesignModel | None = Field(default=None, description="default: a grid")
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
    document = replace(document, data=_explicit(document.data))
    try:
        model = StudyFileModel.model_validate(document.data)
        parts = built([*model.factors.values(), model.design, *model.measures.values()], MeshStore(Path(path).parent))
    except ValidationError as error:
        raise scene_error(document, error) from None
    except LocatedError as error:
        index, *keys = error.keys
        names = [
            *(("factors", key) for key in model.factors),
            ("design",),
            *(("measures", key) for key in model.measures),
        ]
        raise StudyError(str(document.error((*names[int(index)], *keys), str(error)))) from None
    factors = dict(zip(model.factors, parts, strict=False))
    measures = Measures(dict(zip(model.measures, parts[len(factors) + 1 :], strict=True)))
    units = units_of_paths(factors) | measures.units
    return Study(varied_file(Path(path).parent / model.scene), factors, parts[len(factors)] or Grid(), measures, units)


def _explicit(data: Any) -> Any:
    """The data with `[1, 2]` written as `{values: [1, 2]}`: errors then name one schema, not two."""
    if not isinstance(data, dict) or not isinstance(data.get("factors"), dict):
        return data
    factors = {name: {"values": given} if isinstance(given, list) else given for name, given in data["factors"].items()}
    return {**data, "factors": factors}
