"""The user's settings for contact in the implicit solver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from supple.errors import SolverError


@dataclass(frozen=True)
class IPCContact:
    """Incremental potential contact. All defaults scale with the scene.

    Parameters
    ----------
    dhat : distance below which surfaces repel each other [m]. None: a thousandth of the smallest body's diagonal, or
        less where surface edges or the gaps at the start are shorter than that.
    stiffness : pressure scale of the barrier [Pa]: surfaces half of `dhat` apart press on each other with several
        times as much. "adaptive": from the bodies' moduli, and raised within a step where surfaces come very close.
    friction_velocity : relative velocity below which friction is static [m/s]: a sticking contact creeps with a part of
        it. None: a thousandth of the smallest body's diagonal per second.
    friction_iterations : how often in a step the normal forces of friction are computed. 1: only at the beginning of
        the step. None: until they change by less than a tenth, at most five times.

    Raises
    ------
    SolverError : where a value is of the wrong kind or out of range.

    Source: Li et al., "Incremental Potential Contact: Intersection- and Inversion-free, Large-Deformation Dynamics"
    (2020), sections 3 to 5.
    """

    dhat: float | None = None
    stiffness: float | str = "adaptive"
    friction_velocity: float | None = None
    friction_iterations: int | None = None

    def __post_init__(self) -> None:
        for key, unit in (("dhat", "m"), ("friction_velocity", "m/s")):
            if getattr(self, key) is not None:
                object.__setattr__(self, key, _positive(getattr(self, key), f"{key}", f"above zero [{unit}], or None"))
        if self.stiffness != "adaptive":
            object.__setattr__(
                self, "stiffness", _positive(self.stiffness, "stiffness", 'above zero [Pa], or "adaptive"')
            )
        count = self.friction_iterations
        whole = isinstance(count, (int, np.integer)) and not isinstance(count, bool)
        if count is not None and not (whole and count >= 1):
            raise SolverError(
                f"IPCContact: friction_iterations is {count!r}; give a whole number of one or more, or None"
            )


def _positive(value: Any, key: str, wanted: str) -> float:
    number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
    if not number or not np.isfinite(value) or value <= 0.0:
        raise SolverError(f"IPCContact: {key} is {value!r}; it must be finite and {wanted}")
    return float(value)
