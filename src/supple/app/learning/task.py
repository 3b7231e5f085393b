"""What an environment asks of a soft body: the scene, what actions and observations mean, and the reward."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from supple.app.learning.batch import Batch
from supple.scene.scene import Scene
from supple.solvers.solver import Solver
from supple.solvers.xpbd.solver import XPBD


@dataclass(frozen=True)
class Task(ABC):
    """A task on n copies of one scene. Arrays have a row for each copy.

    Parameters
    ----------
    solver, dt : of the simulation; dt in [s]
    episode_steps : number of steps after which an episode is truncated
    """

    solver: Solver = field(default_factory=lambda: XPBD(substeps=10, contact=None))
    dt: float = 0.02
    episode_steps: int = 50

    @property
    @abstractmethod
    def action_size(self) -> int:
        """Number of components of an action, each between -1 and 1."""

    @property
    @abstractmethod
    def observation_size(self) -> int:
        """Number of components of an observation."""

    @abstractmethod
    def scene(self) -> Scene:
        """The scene at the start of an episode, with inputs."""

    @abstractmethod
    def goal(self, random: np.random.Generator) -> NDArray[np.float64]:
        """A random goal of one episode, (g,)."""

    @abstractmethod
    def inputs(self, actions: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Values (n, ...) of the scene's inputs, by name, for actions (n, action_size)."""

    @abstractmethod
    def observations(self, batch: Batch, goals: NDArray[np.float64]) -> NDArray[np.float64]:
        """What is seen, (n, observation_size), with the goals (n, g)."""

    @abstractmethod
    def rewards(
        self, observations: NDArray[np.float64], actions: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Rewards (n,) of a step, and whether the goal is reached (n,), which ends the episode."""
