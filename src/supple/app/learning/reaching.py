"""A task: a soft arm hangs from the ceiling, and its tip has to reach a point and stay there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from supple.app.learning.batch import Batch
from supple.app.learning.task import Task
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.mesh.tetmesh import TetMesh
from supple.scene.body import Body
from supple.scene.forces import Force
from supple.scene.inputs import ForceInput
from supple.scene.pins import Pin
from supple.scene.scene import Scene

LENGTH, WIDTH = 0.3, 0.04
_RINGS = ("middle", "tip")


@dataclass(frozen=True)
class Reaching(Task):
    """Forces on two cross-sections of the arm, its middle and its tip, are the action; the goal is a point.

    An observation has the places and velocities of both sections, in lengths of the arm and in lengths per second
    (12), and the place of the goal (3). The reward of a step is minus the distance from tip to goal, in lengths of the
    arm, minus a hundredth of the mean square of the action; and 1 where the tip has reached the goal and is slow.

    Parameters
    ----------
    strength : largest component of each force [N]
    reach : farthest goal from the tip at rest, sideways and upwards, in lengths of the arm
    tolerance : distance within which the goal is reached, in lengths of the arm
    """

    strength: float = 2.0
    reach: float = 0.4
    tolerance: float = 0.03

    @property
    def action_size(self) -> int:
        return 3 * len(_RINGS)

    @property
    def observation_size(self) -> int:
        return 6 * len(_RINGS) + 3

    @cached_property
    def _mesh(self) -> TetMesh:
        return shapes.box((WIDTH, LENGTH, WIDTH), (1, 6, 1))

    @cached_property
    def _sections(self) -> dict[str, NDArray[np.intp]]:
        """The vertices of both sections."""
        heights = self._mesh.vertices[:, 1]
        places = {"middle": 0.0, "tip": heights.min()}
        return {name: np.flatnonzero(np.abs(heights - places[name]) < 1e-6) for name in _RINGS}

    def scene(self) -> Scene:
        """The arm hangs below the origin."""
        material = StableNeoHookean(youngs=3e4, poisson=0.4, density=1000, damping=0.05)
        arm = Body("arm", self._mesh, material, position=(0, -LENGTH / 2, 0))
        top = np.flatnonzero(self._mesh.vertices[:, 1] > LENGTH / 2 - 1e-6)
        forces = [Force("arm", vertices, ForceInput(name)) for name, vertices in self._sections.items()]
        return Scene([arm], pins=[Pin("arm", top)], forces=forces)

    def goal(self, random: np.random.Generator) -> NDArray[np.float64]:
        angle, out = random.uniform(0.0, 2.0 * np.pi), self.reach * random.uniform(0.3, 1.0)
        # Where an arm of constant length that swings sideways would be.
        return np.array([out * np.cos(angle), -np.sqrt(1.0 - out**2), out * np.sin(angle)])

    def inputs(self, actions: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        forces = self.strength * np.clip(actions, -1.0, 1.0)
        return {name: forces[:, 3 * k : 3 * k + 3] for k, name in enumerate(_RINGS)}

    def observations(self, batch: Batch, goals: NDArray[np.float64]) -> NDArray[np.float64]:
        x, v = batch.positions["arm"], batch.velocities["arm"]
        parts = [values[:, rows].mean(axis=1) / LENGTH for rows in self._sections.values() for values in (x, v)]
        return np.concatenate([*parts, goals], axis=1)

    def rewards(
        self, observations: NDArray[np.float64], actions: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        tip, velocity, goal = observations[:, 6:9], observations[:, 9:12], observations[:, 12:]
        distances = np.linalg.norm(tip - goal, axis=1)
        reached = (distances < self.tolerance) & (np.linalg.norm(velocity, axis=1) < 10.0 * self.tolerance)
        return reached - distances - 0.01 * np.mean(np.clip(actions, -1.0, 1.0) ** 2, axis=1), reached
