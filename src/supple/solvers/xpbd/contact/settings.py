"""User settings for contact of bodies with each other and with themselves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from supple.errors import SolverError


@dataclass(frozen=True)
class XPBDContact:
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

    thickness: float | None = None
    body_collision: bool = True
    self_collision: bool = True

    def __post_init__(self) -> None:
        if self.thickness is not None:
            number = isinstance(self.thickness, (int, float, np.number)) and not isinstance(self.thickness, bool)
            if not number or not np.isfinite(self.thickness) or self.thickness <= 0.0:
                raise SolverError(
                    f"XPBDContact: thickness is {self.thickness!r}; it must be finite and above zero [m], or None"
                )
            object.__setattr__(self, "thickness", float(self.thickness))
        for key in ("body_collision", "self_collision"):
            if not isinstance(getattr(self, key), bool):
                raise SolverError(f"XPBDContact: {key} is {getattr(self, key)!r}; give True or False")
