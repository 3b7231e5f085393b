"""The input of a live page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from supple.scene.scene import Scene
from supple.solvers.solver import Solver


@dataclass(frozen=True, eq=False)
class LiveSource:
    """A scene with its solver, time step and deformed initial positions.

    Attributes
    ----------
    title : of the page
    dt : [s]
    initial_positions : by body name, (n, 3) [m], of bodies that start deformed
    real_time : whether bodies may get coarser meshes, or the scene another solver, to keep up with real time
    solver_given : whether it stays with its solver
    """

    title: str
    scene: Scene
    solver: Solver
    dt: float
    initial_positions: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    real_time: bool = False
    solver_given: bool = False
