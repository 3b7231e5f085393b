"""Vertices that are fixed, or moved by a script."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from supple.scene.motion import Motion, check_motion
from supple.scene.selection import OnVertices, Selection


@dataclass(frozen=True, eq=False)
class Pin(OnVertices):
    """Fixes vertices of one body at their start, or moves them along `motion` from there.

    Parameters
    ----------
    body : name of the body.
    vertices : indices into the body's mesh, or an `InBox`.
    motion : None, `Keyframes`, or t -> displacement [m], (3,) for all or (k, 3) for each vertex.
    name : appears in messages and in the reaction forces of a report.
    """

    kind: ClassVar[str] = "pin"

    body: str
    vertices: Selection
    motion: Motion = None
    name: str | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        check_motion(self.motion, self.label)
