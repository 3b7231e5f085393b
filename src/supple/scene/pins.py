"""Vertices and bodies that are fixed, or moved by a script."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from supple.errors import SceneError
from supple.kinds.validators import BodyName, Name
from supple.scene.motion import Motion, MotionValidator
from supple.scene.selection import OnVertices, Selection, Vertices


@dataclass(frozen=True, eq=False)
class Pin(OnVertices):
    """Fixes vertices of one body at their start, or moves them along `motion` from there.

    A rigid body is held as a whole: `Pin("palm", motion=...)`.

    Parameters
    ----------
    body : name of the body.
    vertices : indices into the body's mesh, or an `InBox`; None for a rigid body.
    motion : None, `Keyframes`, or t -> displacement [m], (3,) for all or (k, 3) for each vertex of a soft body.
    name : appears in messages and in the reaction forces of a report.

    Raises
    ------
    SceneError : where a value is of the wrong kind, not finite or out of range; the text names the body.
    """

    kind: ClassVar[str] = "pin"

    body: Annotated[str, BodyName()]
    vertices: Annotated[Selection | None, Vertices()] = None
    motion: Annotated[Motion, MotionValidator()] = None
    name: Annotated[str | None, Name()] = None

    def check_kind_of_body(self, rigid: bool) -> None:
        """Raise `SceneError` unless this selects vertices of a soft body, or all of a rigid one."""
        super().check_kind_of_body(rigid)
        if rigid and self.vertices is not None:
            raise SceneError(f"{self.label}: a rigid body is held as a whole; leave out `vertices`")
