"""Selections of a body's vertices: indices into its mesh, or a box in the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.kind import Kind
from supple.kinds.validators import Validator, Vector


@dataclass(frozen=True, eq=False)
class InBox(Kind):
    """Selects the vertices inside an axis-aligned box, in world coordinates at the start.

    Parameters
    ----------
    low, high : (3,) opposite corners [m]; the faces belong to the box.

    Raises
    ------
    SceneError : where a corner is not finite, or `low` is above `high`.
    """

    kind: ClassVar[str] = "in_box"
    title: ClassVar[str] = "InBox"

    low: Annotated[ArrayLike, Vector()]
    high: Annotated[ArrayLike, Vector()]

    def __post_init__(self) -> None:
        super().__post_init__()
        low, high = np.asarray(self.low), np.asarray(self.high)
        if np.any(low > high):
            raise SceneError(f"InBox: low {low.tolist()} is above high {high.tolist()}; swap them")

    def select(self, points: NDArray[np.float64]) -> NDArray[np.int32]:
        """Indices of the points (k, 3) inside."""
        inside = np.all((points >= np.asarray(self.low)) & (points <= np.asarray(self.high)), axis=1)
        return np.flatnonzero(inside).astype(np.int32)


Selection = ArrayLike | InBox


def distinct_numbers(value: Any, what: str, thing: str, things: str, else_: str) -> NDArray[np.int64]:
    """Numbers (k,) of vertices, triangles or tets, counted from 0.

    Parameters
    ----------
    thing, things : what is numbered, in the singular and the plural; else_ : what may be given otherwise, for messages

    Raises
    ------
    SceneError : where none exists, or they are not whole, negative, or not distinct.
    """
    try:
        rows = np.atleast_1d(np.asarray(value))
    except (TypeError, ValueError):
        raise SceneError(f"{what} is {value!r}; give numbers of {things}, {else_}") from None
    if rows.ndim != 1 or rows.size == 0 or not np.issubdtype(rows.dtype, np.integer):
        raise SceneError(f"{what} must be a non-empty list of whole numbers, {else_}")
    if len(np.unique(rows)) != len(rows):
        raise SceneError(f"{what} names a {thing} twice; name each once")
    if rows.min() < 0:
        raise SceneError(f"{what} holds {rows.min()}, which is negative; {things} are counted from 0")
    if rows.max() > np.iinfo(np.int32).max:
        raise SceneError(f"{what} holds {rows.max()}, which is more than any mesh has")
    return rows.astype(np.int64)


@dataclass(frozen=True)
class Vertices(Validator):
    """Numbers of vertices, or an `InBox`, checked as far as possible without their body.

    Attributes
    ----------
    sets : whether a scene file may name a set of the body's mesh file
    """

    sets: bool = True

    def checked(self, value: Any, what: str) -> NDArray[np.int32] | InBox:
        if isinstance(value, InBox):
            return value
        return distinct_numbers(value, what, "vertex", "vertices", "or an InBox").astype(np.int32)


class OnVertices(Kind):
    """The base class of what acts on vertices of one body: the selection, and the name in messages."""

    joint: ClassVar[str] = "of"

    body: str
    vertices: Selection | None
    name: str | None

    @property
    def label(self) -> str:
        """The name of this object in messages."""
        return f"{self.word}{f' {self.name!r}' if self.name else ''} {self.joint} body {self.body!r}"

    def check_kind_of_body(self, rigid: bool) -> None:
        """Raise `SceneError` where this cannot act on a soft, or a rigid, body."""
        if self.vertices is None and not rigid:
            raise SceneError(
                f"{self.label}: give the vertices by either `vertices` or `box`; only rigid bodies need none"
            )

    def select(self, placed: NDArray[np.float64]) -> NDArray[np.int32]:
        """Vertex indices (k,) of the body, given its vertices placed in the world (n, 3).

        Raises
        ------
        SceneError : where an index is out of range, or the box holds no vertex.
        """
        if self.vertices is None:
            return np.arange(len(placed), dtype=np.int32)
        if isinstance(self.vertices, InBox):
            indices = self.vertices.select(placed)
            if len(indices) == 0:
                low, high = placed.min(axis=0).round(6).tolist(), placed.max(axis=0).round(6).tolist()
                raise SceneError(f"{self.label}: its box holds no vertex; the body reaches from {low} to {high}")
            return indices
        indices = np.asarray(self.vertices, dtype=np.int32)
        if indices.max() >= len(placed):
            raise SceneError(f"{self.label}: vertex {indices.max()} does not exist; the body has {len(placed)}")
        return indices
