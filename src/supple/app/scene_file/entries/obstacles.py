"""Obstacles of a scene file, by `kind`: a model for each registered kind, made of the parameters that it declares."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union

from pydantic import Field, create_model

from supple.app.scene_file.entries.mesh_sources import MeshStore, SurfaceModel
from supple.app.scene_file.entries.motions import KeyframesModel, built_motion
from supple.app.scene_file.model import Extents, Model, Name, NonNegative, Positive, Vector
from supple.scene.located import at
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.obstacles.registry import KINDS

_TYPES: dict[str, Any] = {
    "vector": Vector,
    "direction": Vector,
    "extents": Extents,
    "positive": Positive,
    "flag": bool,
    "surface": SurfaceModel,
}
_CLASSES = {one.file_kind: one for one in KINDS.values()}


class _ObstacleModel(Model):
    kind: str
    name: Name | None = Field(default=None, description="appears in messages and exports")
    friction: NonNegative = Field(default=0.0, description="Coulomb coefficient against every body")
    motion: KeyframesModel | None = Field(default=None, description="scripted motion; static without it")

    def build(self, meshes: MeshStore) -> Obstacle:
        values = {key: getattr(self, key) for key in _CLASSES[self.kind].parameters()}
        for key, value in values.items():
            if isinstance(value, SurfaceModel):
                with at(key):
                    values[key] = meshes.surface(value)
        return _CLASSES[self.kind](name=self.name, friction=self.friction, motion=built_motion(self.motion), **values)


def _model_of(obstacle: type[Obstacle]) -> type[_ObstacleModel]:
    keys: dict[str, Any] = {"kind": (Literal[obstacle.file_kind], ...)}  # pyright: ignore[reportInvalidTypeForm]
    defaults = {field.name: field.default for field in fields(obstacle)}
    for key, declared in obstacle.parameters().items():
        default = defaults[key]
        default = ... if default is None else list(default) if isinstance(default, tuple) else default
        keys[key] = (_TYPES[declared.kind], Field(default=default, description=declared.description))
    doc = (obstacle.__doc__ or "").partition("\n")[0]
    return create_model(f"{obstacle.__name__}Model", __base__=_ObstacleModel, __doc__=doc, __module__=__name__, **keys)


if TYPE_CHECKING:
    ObstacleModel = _ObstacleModel
else:
    _MODELS = tuple(_model_of(one) for one in KINDS.values())
    ObstacleModel = Annotated[Union[_MODELS], Field(discriminator="kind")]  # noqa: UP007
