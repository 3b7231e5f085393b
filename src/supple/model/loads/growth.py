"""Growth on the tets of a system. Its forces are the elastic ones of the changed stress-free shape."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.active import ActiveTets
from supple.model.loads.applied import ActiveLoad


@dataclass(frozen=True, eq=False)
class GrownTets(ActiveLoad):
    """The tets of one growth.

    Attributes
    ----------
    tets : not grown; vertices : of these tets; stretch : time -> s, above zero
    """

    tets: ActiveTets
    vertices: NDArray[np.int32]
    stretch: Callable[[float], float]

    work = "growth"

    def renumbered(self, new: NDArray[np.int32]) -> GrownTets:
        return replace(self, vertices=new[self.vertices])

    def acts_on(self) -> NDArray[np.int32]:
        return self.vertices

    def active(self, time: float) -> ActiveTets:
        return self.tets.at(self.stretch(time))

    def add_forces(self, x: NDArray[np.float64], time: float, out: NDArray[np.float64]) -> None:
        """None."""
