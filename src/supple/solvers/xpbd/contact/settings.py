"""User settings for contact of bodies with each other and with themselves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from supple.errors import SolverError
from supple.kinds.forms import POSITIVE, Flag
from supple.kinds.kind import Kind


@dataclass(frozen=True)
class XPBDContact(Kind):
    """Contact of surfaces in XPBD. Obstacles always act.

    Parameters
    ----------
    thickness : gap that is kept between surfaces of bodies, and between bodies and triangle obstacles [m]. None: a
        twentieth of the mean edge length of the surfaces of all bodies.
    body_collision : whether bodies collide with each other.
    self_collision : whether a body collides with itself.

    Raises
    ------
    SolverError : where a value is of the wrong kind or out of range.
    """

    kind: ClassVar[str] = "xpbd_contact"
    title: ClassVar[str] = "XPBDContact"
    error = SolverError

    thickness: Annotated[float | None, POSITIVE] = None
    body_collision: Annotated[bool, Flag()] = True
    self_collision: Annotated[bool, Flag()] = True
