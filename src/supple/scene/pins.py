"""Vertices and bodies that are fixed, or moved by a script."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from supple.errors import SceneError
from supple.scene.motion import Motion, check_motion
from supple.scene.selection import OnVertices, Selection


@dataclass(frozen=True, eq=False)
class Pin(OnVertices):
    """Fixes vertices of one body at their start, or moves them along `motion` from there.

    A rigid body is held as a whole: `Pin("palm", motion=...)`.

    Parameters
    ----------
    body : name of the body.
    vertices : indices into the body's mesh, or an `InBox`; None: the whole body, the only choice for a rigid one.
    motion : None, `Keyframes`, or t -> displacement [m], (3,) for all or (k, 3) for each vertex of a soft body.
    name : appears in messages and in the reaction forces of a report.
    """

    kind: ClassVar[str] = "pin"
    takes_all: ClassVar[bool] = True

    body: str
    vertices: Selection | None = None
    motion: Motion = None
    name: str | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        check_motion(self.motion, self.label)

    def check_rigid(self) -> None:
        """Raise `SceneError` where only some of the vertices are selected."""
        if self.vertices is not None:
            raise SceneError(f"{self.label}: a rigid body is held as a whole; leave out `vertices`")
