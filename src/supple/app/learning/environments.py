"""Environments of gymnasium on a batch: `BatchVectorEnv` for learning, and `BatchEnv` with one copy.

They need the package gymnasium (the extra `learning`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError

try:
    import gymnasium
    from gymnasium.utils import seeding
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ModuleNotFoundError:
    raise SceneError(
        "environments need the package gymnasium, which is not installed; install Supple with the extra `learning`"
    ) from None

from supple.app.learning.batch import Batch
from supple.app.learning.reaching import Reaching
from supple.app.learning.task import Task


class BatchVectorEnv(VectorEnv):
    """n copies of a task, in the vector interface of gymnasium.

    An episode is terminated where the goal is reached, or where the solver cannot go on, and truncated after
    `episode_steps`. The step after its last one starts a new episode and has the reward 0 (`NEXT_STEP`).

    Parameters
    ----------
    task : None: `Reaching()`
    num_envs : number of copies
    threads : see `Batch`
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 - as in the base

    def __init__(self, task: Task | None = None, num_envs: int = 1, threads: int | None = None) -> None:
        self.task = Reaching() if task is None else task
        self.num_envs = num_envs
        self.batch = Batch(self.task.scene(), num_envs, self.task.solver, self.task.dt, threads=threads)
        seen = self.task.observation_size
        self.single_action_space = gymnasium.spaces.Box(-1.0, 1.0, (self.task.action_size,), np.float64)
        self.single_observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (seen,), np.float64)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._randoms = [seeding.np_random(None)[0] for _ in range(num_envs)]
        self._goals = np.stack([self.task.goal(random) for random in self._randoms])
        self._steps = np.zeros(num_envs, dtype=np.int64)
        self._ended = np.zeros(num_envs, dtype=np.bool_)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Start an episode in each copy; `seed` of the first copy, or one for each. It takes no options."""
        seeds = [seed + k for k in range(self.num_envs)] if isinstance(seed, int | np.integer) else seed
        for k, one in enumerate(seeds or ()):
            if one is not None:
                self._randoms[k] = seeding.np_random(one)[0]
        self._begin(np.ones(self.num_envs, dtype=np.bool_))
        return self._observations(), {}

    def step(
        self, actions: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """A step of each copy; of those whose episode has ended, the start of the next one."""
        actions = np.asarray(actions, dtype=np.float64)
        ended = self._ended
        self.batch.step(self.task.inputs(actions), ~ended)
        self._begin(ended)
        self._steps += ~ended
        observations = self._observations()
        rewards, reached = self.task.rewards(observations, actions)
        terminated = (reached | ~self.batch.can_go_on) & ~ended
        truncated = (self._steps >= self.task.episode_steps) & ~terminated & ~ended
        self._ended = terminated | truncated
        return observations, np.where(ended, 0.0, rewards), terminated, truncated, {}

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads."""
        self.batch.close()

    def _begin(self, copies: NDArray[np.bool_]) -> None:
        self.batch.reset(copies)
        for k in np.flatnonzero(copies):
            self._goals[k] = self.task.goal(self._randoms[k])
        self._steps[copies] = 0
        self._ended = np.where(copies, False, self._ended)

    def _observations(self) -> NDArray[np.float64]:
        return self.task.observations(self.batch, self._goals)


class BatchEnv(gymnasium.Env):
    """One copy of a task, in gymnasium's interface of single environments; see `BatchVectorEnv`."""

    metadata = {"render_modes": []}  # noqa: RUF012 - as in the base

    def __init__(self, task: Task | None = None) -> None:
        self._vector = BatchVectorEnv(task, 1)
        self.action_space = self._vector.single_action_space
        self.observation_space = self._vector.single_observation_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Start an episode."""
        super().reset(seed=seed)
        self._vector._randoms[0] = self.np_random
        observations, info = self._vector.reset(options=options)
        return observations[0], info

    def step(self, action: NDArray[np.float64]) -> tuple[NDArray[np.float64], float, bool, bool, dict[str, Any]]:
        """A step. After the end of an episode, `reset` has to be called."""
        seen, rewards, terminated, truncated, info = self._vector.step(np.asarray(action)[None])
        return seen[0], float(rewards[0]), bool(terminated[0]), bool(truncated[0]), info

    def close(self) -> None:
        """End the threads."""
        self._vector.close()


gymnasium.register(
    "Supple/Reaching-v0", entry_point=f"{__name__}:BatchEnv", vector_entry_point=f"{__name__}:BatchVectorEnv"
)
