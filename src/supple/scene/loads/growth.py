"""Growth: a prescribed stretch of the stress-free shape, as of swelling or heat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.validators import BodyName, Name, Number
from supple.materials.elastic import EdgesAndVolume
from supple.scene.body import PlacedBody
from supple.scene.loads.load import TETS, OnBody, body_of
from supple.scene.loads.over_time import OverTime, OverTimeOf
from supple.scene.loads.tet_region import Directions, TetRegion, directions_of, tets_in

# Of a stretch: volumes and stiffnesses beyond it are not those of a body in the same scene.
STRETCH = OverTimeOf(bounds=Number(least=1e-3, most=1e3))


@dataclass(frozen=True, eq=False)
class Growth(OnBody):
    """Tets whose stress-free shape is stretched: F = F_e F_g, and stresses are those of F_e.

    Several growths of the same tets multiply. The mass stays.

    Parameters
    ----------
    body : name of the soft body.
    stretch : of lengths, from 1e-3 to 1e3 [-]; a number, a `Curve`, or a function of time. For heat,
        1 + alpha (T - T0).
    direction : None for all directions alike; (3,) for one, or (m, 3) for one of each tet, in the body's own
        coordinates; of any length [-].
    tets : None for all tets of the body, an `InBox` that holds all four corners of a tet at the start, or rows of the
        mesh's tets.
    name : appears in messages.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    kind: ClassVar[str] = "growth"

    body: Annotated[str, BodyName(soft=True, why="growth acts in soft bodies")]
    stretch: Annotated[OverTime, STRETCH]
    direction: Annotated[ArrayLike | None, Directions()] = None
    tets: Annotated[TetRegion, TETS] = None
    name: Annotated[str | None, Name()] = None

    def check(self, bodies: Sequence[PlacedBody]) -> None:
        self.growing(body_of(self.body, bodies, self.label))

    def growing(self, body: PlacedBody) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The numbers (m,) of its tets, and their directions at rest (m, 3), or (0, 3) for all directions.

        Raises
        ------
        SceneError : where the body is not elastic, a tet does not exist, or there are other numbers of tets
            and directions.
        """
        if isinstance(body.material, EdgesAndVolume):
            raise SceneError(
                f"{self.label}: EdgesAndVolume has no deformation gradient that could grow; give the body an elastic "
                "material such as StableNeoHookean"
            )
        rows = tets_in(self.tets, body, self.label)
        if self.direction is None:
            return rows, np.zeros((0, 3))
        return rows, directions_of(self.direction, rows, self.label)
