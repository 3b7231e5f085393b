"""Muscles: active stress along fibres inside of a body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.scene.body import PlacedBody
from supple.scene.loads.load import OnBody, body_of
from supple.scene.loads.over_time import Curve, OverTime, checked_magnitude
from supple.scene.loads.tet_region import TetRegion, checked_directions, checked_tets, directions_of, tets_in
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.values import float_array, positive


@dataclass(frozen=True, eq=False)
class Muscle(OnBody):
    """Fibres in tets that pull along their direction: the first Piola stress a(t) S f(s) (F d / s) d^T.

    d is the direction at rest, s = |F d| the stretch of the fibre, S the strength, a the activation, and f the
    force-length curve. The muscle of a straight bar that is held at both ends pulls with a S f(1) times its area at
    rest.

    Parameters
    ----------
    body : name of the soft body.
    strength : S, the largest stress per area at rest [Pa].
    direction : (3,) of all fibres, or (m, 3) of each tet of the muscle, in the body's own coordinates; of any length
        [-].
    activation : a, from 0 to 1; a number, a `Curve`, or a function of time [s].
    tets : None for all tets of the body, an `InBox` that holds all four corners of a tet at the start, or rows of the
        mesh's tets.
    force_length : f [-] at stretches, as (stretches, values): increasing numbers above zero, and numbers of zero or
        more. Linear in between, constant outside. None: 1 at all stretches.
    name : appears in messages.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    kind: ClassVar[str] = "muscle"

    body: str
    strength: float
    direction: ArrayLike
    activation: OverTime = 1.0
    tets: TetRegion = None
    force_length: tuple[ArrayLike, ArrayLike] | None = None
    name: str | None = None

    def __post_init__(self) -> None:
        self._check_names()
        object.__setattr__(self, "strength", positive(self.strength, f"{self.label}: strength"))
        object.__setattr__(self, "direction", checked_directions(self.direction, self.label))
        what = f"{self.label}: activation"
        object.__setattr__(self, "activation", checked_magnitude(self.activation, what))
        known = self.activation.values if isinstance(self.activation, Curve) else self.activation
        if not callable(known):
            check_activation(float(np.max(np.asarray(known))), what)
        object.__setattr__(self, "tets", checked_tets(self.tets, self.label))
        if self.force_length is not None:
            object.__setattr__(self, "force_length", self._checked_curve())

    def check(self, bodies: Sequence[PlacedBody]) -> None:
        self.fibres(body_of(self.body, bodies, self.label))

    def fibres(self, body: PlacedBody) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The numbers (m,) of its tets, and the directions (m, 3) of their fibres at rest.

        Raises
        ------
        SceneError : where the body is rigid, a tet does not exist, or there are other numbers of tets and directions.
        """
        if isinstance(body, RigidBody):
            raise SceneError(f"{self.label}: the body is rigid; a muscle acts in soft bodies")
        rows = tets_in(self.tets, body, self.label)
        return rows, directions_of(self.direction, rows, self.label)

    def _checked_curve(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        what = f"{self.label}: force_length"
        try:
            stretches, values = (float_array(part, what) for part in self.force_length or ())
        except (TypeError, ValueError):
            raise SceneError(f"{what} is {self.force_length!r}; give (stretches, values)") from None
        if stretches.ndim != 1 or len(stretches) == 0 or stretches.shape != values.shape:
            raise SceneError(f"{what}: shapes are {stretches.shape} and {values.shape}; give as many of both")
        if not (np.isfinite(stretches).all() and stretches[0] > 0.0 and (np.diff(stretches) > 0.0).all()):
            raise SceneError(f"{what}: stretches must be finite, above zero and increasing")
        if not (np.isfinite(values).all() and (values >= 0.0).all()):
            raise SceneError(f"{what}: values must be finite and zero or more")
        return stretches, values


def check_activation(value: float, what: str) -> None:
    """Raise `SceneError` for more than 1."""
    if value > 1.0:
        raise SceneError(f"{what} is {value:g}; it must be from 0 to 1")
