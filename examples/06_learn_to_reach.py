"""Soft arms learn to reach a point: an environment of gymnasium, and random search for the gains of a controller.

All copies of the environment are bodies of one scene, which is simulated at once: 64 of them take five times as long
as one. Needs the extra `learning` (gymnasium).

Run it:  python examples/06_learn_to_reach.py
"""

from typing import ClassVar

import gymnasium
import numpy as np
from gymnasium.vector.utils import batch_space

import supple as sp

LENGTH, WIDTH, DT = 0.3, 0.04, 0.02
STRENGTH, REACH, NEAR = 2.0, 0.4, 0.03  # of each force [N]; of goals, and near enough, in lengths of the arm
GOALS = 4
# The first candidate of a round is the best one so far; the others are near it and far from it.
SCALES = np.array([0.0, 0.3, 0.6, 1.0, 2.0, 3.0, 6.0, 12.0])
ACTIONS = gymnasium.spaces.Box(-1.0, 1.0, (6,))
OBSERVATIONS = gymnasium.spaces.Box(-np.inf, np.inf, (15,))


class Arms:
    """Hanging arms with forces on their middles and tips, of which each tip shall reach a goal and rest there.

    An observation has the place and velocity of both, and the goal, in lengths of the arm.
    """

    def __init__(self, count: int, steps: int, substeps: int) -> None:
        self.count, self.steps, self.solver = count, steps, sp.XPBD(substeps=substeps, contact=None)
        mesh = sp.shapes.box((WIDTH, LENGTH, WIDTH), (1, 6, 1))
        y = mesh.vertices[:, 1]
        self.sections = {"middle": np.flatnonzero(abs(y) < 1e-6), "tip": np.flatnonzero(y < y.min() + 1e-6)}
        material = sp.StableNeoHookean(youngs=3e4, poisson=0.4, density=1000, damping=0.05)
        self.arms = [sp.Body(f"arm {k}", mesh, material, position=(k * LENGTH, -LENGTH / 2, 0)) for k in range(count)]
        top = np.flatnonzero(y > y.max() - 1e-6)
        self.scene = sp.Scene(
            self.arms,
            pins=[sp.Pin(arm.name, top) for arm in self.arms],
            forces=[
                sp.Force(arm.name, rows, sp.ForceInput(f"{name} of {arm.name}"))
                for arm in self.arms
                for name, rows in self.sections.items()
            ],
        )

    def begin(self, goals: np.ndarray) -> np.ndarray:
        """Hang at rest; goals (n, 3) in lengths of the arm. Returns the observations (n, 15)."""
        self.goals, self.forces = goals, {}
        self.run = sp.simulate(self.scene, self.solver, DT, self.steps, control=lambda frame: self.forces)
        placed = np.stack([arm.place(arm.mesh.vertices) for arm in self.arms])
        return self.observed(placed, np.zeros_like(placed))

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
        """Take actions (n, 6); returns observations (n, 15), rewards (n,), which tips have reached, and if all ends."""
        actions = np.clip(actions, -1.0, 1.0)
        for arm, action in zip(self.arms, STRENGTH * actions, strict=True):
            self.forces |= {f"middle of {arm.name}": action[:3], f"tip of {arm.name}": action[3:]}
        frame = next(self.run)
        x, v = (np.stack([of[arm.name] for arm in self.arms]) for of in (frame.positions, frame.velocities))
        seen = self.observed(x, v)
        distances = np.linalg.norm(seen[:, 6:9] - self.goals, axis=1)
        reached = (distances < NEAR) & (np.linalg.norm(seen[:, 9:12], axis=1) < 10.0 * NEAR)
        rewards = reached - distances - 0.01 * np.mean(actions**2, axis=1)
        return seen, rewards, reached, not frame.report.status.can_go_on

    def observed(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        places = x - np.array([(k * LENGTH, 0.0, 0.0) for k in range(self.count)])[:, None]
        parts = [of[:, rows].mean(axis=1) / LENGTH for rows in self.sections.values() for of in (places, v)]
        return np.hstack([*parts, self.goals]).astype(np.float32)


def random_goal(random: np.random.Generator) -> np.ndarray:
    """Where an arm of constant length that swings sideways would be."""
    angle, out = random.uniform(0.0, 2.0 * np.pi), REACH * random.uniform(0.3, 1.0)
    return np.array([out * np.cos(angle), -np.sqrt(1.0 - out**2), out * np.sin(angle)])


class Reach(gymnasium.Env):
    """One arm."""

    action_space, observation_space = ACTIONS, OBSERVATIONS

    def __init__(self, episode_steps: int = 50, substeps: int = 24) -> None:
        self.arms = Arms(1, episode_steps, substeps)

    def reset(self, *, seed: int | None = None, options: dict | None = None) -> tuple[np.ndarray, dict]:
        super().reset(seed=seed)
        self.left = self.arms.steps
        return self.arms.begin(random_goal(self.np_random)[None])[0], {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict]:
        seen, rewards, reached, lost = self.arms.step(action[None])
        self.left -= 1
        ended = bool(reached[0]) or lost
        return seen[0], float(rewards[0]), ended, not ended and self.left == 0, {}


class ReachTogether(gymnasium.vector.VectorEnv):
    """Copies of `Reach` in one scene, whose episodes begin and end together."""

    metadata: ClassVar[dict] = {"autoreset_mode": gymnasium.vector.AutoresetMode.DISABLED}
    single_action_space, single_observation_space = ACTIONS, OBSERVATIONS

    def __init__(self, count: int, episode_steps: int = 50, substeps: int = 24) -> None:
        self.num_envs, self.arms = count, Arms(count, episode_steps, substeps)
        self.action_space, self.observation_space = batch_space(ACTIONS, count), batch_space(OBSERVATIONS, count)

    def reset(self, *, seed: int | list[int] | None = None, options: dict | None = None) -> tuple[np.ndarray, dict]:
        self.left = self.arms.steps
        seeds = [seed + k for k in range(self.num_envs)] if isinstance(seed, int) else seed or [None] * self.num_envs
        return self.arms.begin(np.stack([random_goal(np.random.default_rng(one)) for one in seeds])), {}

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict]:
        seen, rewards, _, lost = self.arms.step(actions)
        self.left -= 1
        ended, cut = np.full(self.num_envs, lost), np.full(self.num_envs, not lost and self.left == 0)
        return seen, rewards, ended, cut, {}


def pulled(seen: np.ndarray, gains: np.ndarray) -> np.ndarray:
    """The middle and the tip are each pulled towards the goal, and damped, by four gains each (n, 4)."""
    velocities, tip, goal = (seen[:, 3:6], seen[:, 9:12]), seen[:, 6:9], seen[:, 12:15]
    pulls = [gains[:, k, None] * (goal - tip) - gains[:, 2 + k, None] * velocities[k] for k in range(2)]
    return np.clip(np.hstack(pulls), -1.0, 1.0)


def mean_rewards(env: ReachTogether, tried: np.ndarray) -> np.ndarray:
    """The mean reward of a step with each of the gains (c, 4): every candidate has an arm for each goal."""
    gains = np.repeat(tried, GOALS, axis=0)
    seen, _ = env.reset(seed=[*range(GOALS)] * len(tried))
    total = np.zeros(len(gains))
    for _ in range(env.arms.steps):
        seen, rewards, *_ = env.step(pulled(seen, gains))
        total += rewards / env.arms.steps
    return total.reshape(len(tried), GOALS).mean(axis=1)


def main(rounds: int = 5, episode_steps: int = 50, substeps: int = 24) -> list[float]:
    env, random = ReachTogether(len(SCALES) * GOALS, episode_steps, substeps), np.random.default_rng(0)
    best, rewards = np.zeros(4), []
    for number in range(rounds):
        tried = best + SCALES[:, None] * random.normal(size=(len(SCALES), 4))
        found = mean_rewards(env, tried)
        best = tried[found.argmax()]
        rewards += [float(found[0])] if number == 0 else []
        rewards.append(float(found.max()))
        print(f"round {number + 1}: the mean reward of a step is {found.max():.3f}, gains {np.round(best, 2)}")
    return rewards


if __name__ == "__main__":
    main()
