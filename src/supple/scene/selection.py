"""Selections of a body's vertices: indices into its mesh, or a box in the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.scene.values import check_name, finite_vector


@dataclass(frozen=True, eq=False)
class InBox:
    """Selects the vertices inside an axis-aligned box, in world coordinates at the start.

    Parameters
    ----------
    low, high : (3,) opposite corners [m]; the faces belong to the box.

    Raises
    ------
    SceneError : where a corner is not finite, or `low` is above `high`.
    """

    low: ArrayLike
    high: ArrayLike

    def __post_init__(self) -> None:
        low, high = finite_vector(self.low, "InBox: low"), finite_vector(self.high, "InBox: high")
        if np.any(low > high):
            raise SceneError(f"InBox: low {low.tolist()} is above high {high.tolist()}; swap them")
        object.__setattr__(self, "low", low)
        object.__setattr__(self, "high", high)

    def select(self, points: NDArray[np.float64]) -> NDArray[np.int32]:
        """Indices of the points (k, 3) inside."""
        inside = np.all((points >= np.asarray(self.low)) & (points <= np.asarray(self.high)), axis=1)
        return np.flatnonzero(inside).astype(np.int32)


Selection = ArrayLike | InBox


class OnVertices:
    """The base class of what acts on vertices of one body: the selection, and the name in messages."""

    kind: ClassVar[str]
    joint: ClassVar[str] = "of"
    takes_all: ClassVar[bool] = False  # whether vertices=None selects all of a rigid body

    body: str
    vertices: Selection | None
    name: str | None

    def __post_init__(self) -> None:
        check_name(self.body, f"{self.kind}: body")
        if self.name is not None:
            check_name(self.name, self.kind)
        object.__setattr__(self, "vertices", self._checked_selection())

    @property
    def label(self) -> str:
        """The name of this object in messages."""
        return f"{self.kind}{f' {self.name!r}' if self.name else ''} {self.joint} body {self.body!r}"

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

    def _checked_selection(self) -> NDArray[np.int32] | InBox | None:
        """The selection, checked as far as possible without its body."""
        if isinstance(self.vertices, InBox) or (self.vertices is None and self.takes_all):
            return self.vertices
        try:
            indices = np.atleast_1d(np.asarray(self.vertices))
        except (TypeError, ValueError):
            raise SceneError(f"{self.label}: vertices is {self.vertices!r}; give indices or an InBox") from None
        if indices.ndim != 1 or indices.size == 0 or not np.issubdtype(indices.dtype, np.integer):
            raise SceneError(f"{self.label}: vertices must be a non-empty list of whole numbers, or an InBox")
        if len(np.unique(indices)) != len(indices):
            raise SceneError(f"{self.label}: vertices names a vertex twice; name each once")
        if indices.min() < 0:
            raise SceneError(f"{self.label}: vertices holds {indices.min()}, which is negative; indices begin at 0")
        if indices.max() > np.iinfo(np.int32).max:
            raise SceneError(f"{self.label}: vertices holds {indices.max()}, which is more than any mesh has")
        return indices.astype(np.int32)
