"""Arrays in a scene file: among its text, or in a file of NumPy."""

from __future__ import annotations

from typing import Annotated, Any, Union

from numpy.typing import NDArray
from pydantic import Discriminator, Field, Tag

from supple.app.scene_file.model import FilePath, Model


class ArrayModel(Model):
    """Numbers in a file of NumPy (.npy)."""

    file: FilePath = Field(description="relative to the scene file")

    def build(self, meshes: Any) -> NDArray[Any]:
        return meshes.array(self.file)


def _shape_of(value: Any) -> str:
    if isinstance(value, dict | ArrayModel):
        return "<file>"
    nested = isinstance(value, list) and bool(value) and isinstance(value[0], list)
    return "<rows>" if nested else "<list>" if isinstance(value, list) else "<one>"


def array_type(one: Any = None, row: Any = None, rows: Any = None) -> Any:
    """The type of an array: one value, a list of numbers, a list of lists, or a file; those that a key may have.

    The value's own shape selects the type, so that an error is that of one of them.
    """
    first = next(kind for kind in (one, row, rows) if kind is not None)
    tagged = {"<one>": one or first, "<list>": row or first, "<rows>": rows or row or first, "<file>": ArrayModel}
    return Annotated[
        Union[tuple(Annotated[kind, Tag(tag)] for tag, kind in tagged.items())],  # noqa: UP007
        Discriminator(_shape_of),
    ]
