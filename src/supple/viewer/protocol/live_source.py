"""What a live page starts from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from supple.scene.scene import Scene
from supple.solver import Solver


@dataclass(frozen=True, eq=False)
class LiveSource:
    """A scene with the solver, the time step and the deformed starts that it comes with.

    Attributes
    ----------
    title : for the page
    dt : [s]
    initial_positions : by body name, (n, 3) [m], of bodies that start deformed
    """

    title: str
    scene: Scene
    solver: Solver
    dt: float
    initial_positions: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
