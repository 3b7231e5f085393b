"""The base class of stitches that are springs: a stiffness and a rest length."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from supple.kinds.forms import NON_NEGATIVE, POSITIVE
from supple.scene.stitches.elements import Pairs, Springs
from supple.scene.stitches.stitch import PerPair, Stitch


@dataclass(frozen=True, eq=False)
class SpringStitch(Stitch):
    """Springs, k/2 (distance - rest length)^2. Other parameters: see `Stitch`.

    Parameters
    ----------
    stiffness : k [N/m]
    rest_length : [m]; None for the distance at the start

    Each is one number, or one for each pair.
    """

    stiffness: Annotated[float | NDArray[np.float64], PerPair(POSITIVE)] = field(kw_only=True)
    rest_length: Annotated[float | NDArray[np.float64] | None, PerPair(NON_NEGATIVE)] = field(
        default=None, kw_only=True
    )

    def springs(self, pairs: Pairs, ends: NDArray[np.int32], place: NDArray[np.float64]) -> Springs:
        """From the pairs' vertices to the places (k,) along ends (k, 2)."""
        count = len(pairs.vertices)
        lengths = pairs.distances if self.rest_length is None else self.rest_length
        return Springs(
            vertices=np.column_stack([pairs.vertices, ends]).astype(np.int32),
            place=place,
            stiffness=self.per_pair(self.stiffness, count, "stiffness"),
            rest_lengths=self.per_pair(lengths, count, "rest_length"),
            damping=np.full(count, self.damping),
        )
