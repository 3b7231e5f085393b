"""Forces per mass, as functions of place and time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.checks import float_array
from supple.kinds.validators import BodyName, Name
from supple.scene.loads.load import Load
from supple.scene.loads.over_time import Curve, OverTimeOf, value_at


@dataclass(frozen=True, eq=False)
class BodyForce(Load):
    """A force per mass on all vertices of one body, or of all bodies.

    Parameters
    ----------
    force : [N/kg]; (3,), a `Curve` of vectors, or a function (x, t) of places (k, 3) [m] and time [s] that returns
        (k, 3) or (3,). `Implicit` takes its value at the places where a step begins.
    body : name of the body; None for all bodies.
    name : appears in messages.

    Raises
    ------
    SceneError : where a value is of the wrong kind or not finite.
    """

    kind: ClassVar[str] = "body_force"

    force: Annotated[ArrayLike | Curve | Callable[[NDArray[np.float64], float], ArrayLike], OverTimeOf((3,))]
    body: Annotated[str | None, BodyName()] = None
    name: Annotated[str | None, Name()] = None

    @property
    def is_uniform(self) -> bool:
        """Whether the force is the same at all places."""
        return isinstance(self.force, Curve) or not callable(self.force)

    def at(self, x: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        """The force (k, 3) per mass [N/kg] at places x (k, 3) and `time`.

        Raises
        ------
        SceneError : where the function returns what is not finite or has another shape.
        """
        if isinstance(self.force, Curve) or not callable(self.force):
            return np.broadcast_to(value_at(self.force, time, f"{self.label}: force", (3,)), x.shape)
        value = float_array(self.force(x, time), f"{self.label}: force(x, {time:g})")
        if value.shape not in ((3,), x.shape):
            raise SceneError(f"{self.label}: force(x, {time:g}) has shape {value.shape}; give (3,) or {x.shape}")
        if not np.isfinite(value).all():
            raise SceneError(f"{self.label}: force(x, {time:g}) is not finite")
        return np.broadcast_to(value, x.shape)
