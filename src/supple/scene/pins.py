"""Vertices that are fixed, or moved by a script."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.scene.motion import Motion, check_motion
from supple.scene.selection import InBox, Selection, checked_selection, selected_vertices
from supple.scene.values import check_name

__all__ = ["InBox", "Pin"]


@dataclass(frozen=True, eq=False)
class Pin:
    """Fixes vertices of one body at their start, or moves them along `motion` from there.

    Parameters
    ----------
    body : name of the body.
    vertices : indices into the body's mesh, or an `InBox`.
    motion : None, `Keyframes`, or t -> displacement [m], (3,) for all or (k, 3) for each vertex.
    name : appears in messages and in the reaction forces of a report.
    """

    body: str
    vertices: Selection
    motion: Motion = None
    name: str | None = None

    def __post_init__(self) -> None:
        check_name(self.body, "pin: body")
        if self.name is not None:
            check_name(self.name, "pin")
        check_motion(self.motion, self.label)
        object.__setattr__(self, "vertices", checked_selection(self.vertices, self.label))

    @property
    def label(self) -> str:
        """The name of this pin in messages."""
        return f"pin {self.name!r} of body {self.body!r}" if self.name else f"pin of body {self.body!r}"

    def select(self, placed: NDArray[np.float64]) -> NDArray[np.int32]:
        """Vertex indices (k,) of the body, given its vertices placed in the world (n, 3).

        Raises
        ------
        SceneError : where an index is out of range, or the box holds no vertex.
        """
        return selected_vertices(self.vertices, placed, self.label)
