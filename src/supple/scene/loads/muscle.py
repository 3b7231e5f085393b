"""Muscles: active stress along fibres inside of a body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.checks import float_array
from supple.kinds.validators import POSITIVE, BodyName, Name, Number, Validator
from supple.scene.body import PlacedBody
from supple.scene.loads.load import TETS, OnBody, body_of
from supple.scene.loads.over_time import OverTime, OverTimeOf
from supple.scene.loads.tet_region import Directions, TetRegion, directions_of, tets_in

ACTIVATION = OverTimeOf(bounds=Number(least=0.0, most=1.0))


@dataclass(frozen=True)
class ForceLength(Validator):
    """(stretches, values): increasing numbers above zero, and numbers of zero or more."""

    def checked(self, value: Any, what: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        try:
            stretches, values = (float_array(part, what) for part in value)
        except (TypeError, ValueError):
            raise SceneError(f"{what} is {value!r}; give (stretches, values)") from None
        if stretches.ndim != 1 or len(stretches) == 0 or stretches.shape != values.shape:
            raise SceneError(f"{what}: shapes are {stretches.shape} and {values.shape}; give as many of both")
        if not (np.isfinite(stretches).all() and stretches[0] > 0.0 and (np.diff(stretches) > 0.0).all()):
            raise SceneError(f"{what}: stretches must be finite, above zero and increasing")
        if not (np.isfinite(values).all() and (values >= 0.0).all()):
            raise SceneError(f"{what}: values must be finite and zero or more")
        return stretches, values


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
    activation : a, from 0 to 1; a number, a `Curve`, or a function of time.
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

    body: Annotated[str, BodyName(soft=True, why="a muscle acts in soft bodies")]
    strength: Annotated[float, POSITIVE]
    direction: Annotated[ArrayLike, Directions()]
    activation: Annotated[OverTime, ACTIVATION] = 1.0
    tets: Annotated[TetRegion, TETS] = None
    force_length: Annotated[tuple[ArrayLike, ArrayLike] | None, ForceLength()] = None
    name: Annotated[str | None, Name()] = None

    def check(self, bodies: Sequence[PlacedBody]) -> None:
        self.fibres(body_of(self.body, bodies, self.label))

    def fibres(self, body: PlacedBody) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The numbers (m,) of its tets, and the directions (m, 3) of their fibres at rest.

        Raises
        ------
        SceneError : where a tet does not exist, or there are other numbers of tets and directions.
        """
        rows = tets_in(self.tets, body, self.label)
        return rows, directions_of(self.direction, rows, self.label)
