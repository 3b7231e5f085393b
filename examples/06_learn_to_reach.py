"""Soft arms learn to reach points: environments of gymnasium, and random search for the gains of a controller.

All copies are bodies of one scene: 64 take five times as long as one. Needs the extra `learning` (gymnasium).

Run it:  python examples/06_learn_to_reach.py
"""

import gymnasium
import numpy as np
from gymnasium.vector.utils import batch_space

import supple as sp

LENGTH, WIDTH, DT, GOALS = 0.3, 0.04, 0.02, 4
STRENGTH, REACH = 2.0, 0.4  # of each force [N]; of goals, in lengths of the arm
# The first candidate of a round is the best one so far; the others are near it and far from it.
SCALES = np.array([0.0, 0.3, 0.6, 1.0, 2.0, 3.0, 6.0, 12.0])


class Reach(gymnasium.vector.VectorEnv):
    """Forces on the middles and tips of hanging arms are the actions; each tip shall reach its goal.

    An observation has the place and velocity of both, and the goal, in lengths of the arm. Episodes end together.
    """

    single_action_space = gymnasium.spaces.Box(-1.0, 1.0, (6,))
    single_observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (15,))

    def __init__(self, count: int, episode_steps: int = 50, substeps: int = 24) -> None:
        self.metadata = {"autoreset_mode": gymnasium.vector.AutoresetMode.DISABLED}
        self.num_envs, self.episode_steps = count, episode_steps
        self.solver = sp.XPBD(substeps=substeps, contact=None)
        spaces = self.single_action_space, self.single_observation_space
        self.action_space, self.observation_space = (batch_space(space, count) for space in spaces)
        mesh = sp.shapes.box((WIDTH, LENGTH, WIDTH), (1, 6, 1))
        y = mesh.vertices[:, 1]
        self.sections = {"middle": np.flatnonzero(abs(y) < 1e-6), "tip": np.flatnonzero(y < y.min() + 1e-6)}
        material = sp.StableNeoHookean(youngs=3e4, poisson=0.4, density=1000, damping=0.05)
        self.tops = np.array([[(k * LENGTH, 0.0, 0.0)] for k in range(count)])
        arms = [sp.Body(f"arm {k}", mesh, material, position=(k * LENGTH, -LENGTH / 2, 0)) for k in range(count)]
        self.start = np.stack([arm.place(mesh.vertices) for arm in arms])
        pins = [sp.Pin(arm.name, np.flatnonzero(y > y.max() - 1e-6)) for arm in arms]
        sections = [(arm.name, name, rows) for arm in arms for name, rows in self.sections.items()]
        forces = [sp.Force(arm, rows, sp.ForceInput(f"{name} of {arm}")) for arm, name, rows in sections]
        self.scene = sp.Scene(arms, pins=pins, forces=forces)

    def reset(self, *, seed: list[int] | None = None, options: dict | None = None) -> tuple[np.ndarray, dict]:
        self.goals, self.forces = np.stack([random_goal(one) for one in seed or [None] * self.num_envs]), {}
        self.run = sp.simulate(self.scene, self.solver, DT, self.episode_steps, control=lambda frame: self.forces)
        return self.observations(self.start, np.zeros_like(self.start)), {}

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict]:
        actions = np.clip(actions, -1.0, 1.0)
        for k, action in enumerate(STRENGTH * actions):
            self.forces |= {f"middle of arm {k}": action[:3], f"tip of arm {k}": action[3:]}
        frame = next(self.run)
        seen = self.observations(*(np.stack([*of.values()]) for of in (frame.positions, frame.velocities)))
        distances = np.linalg.norm(seen[:, 6:9] - self.goals, axis=1)
        ended = np.full(self.num_envs, not frame.report.status.can_go_on)
        cut = ~ended & (frame.index == self.episode_steps)
        return seen, -distances - 0.01 * np.mean(actions**2, axis=1), ended, cut, {}

    def observations(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        parts = [of[:, rows].mean(axis=1) / LENGTH for rows in self.sections.values() for of in (x - self.tops, v)]
        return np.hstack([*parts, self.goals]).astype(np.float32)


def random_goal(seed: int | None) -> np.ndarray:
    """Where an arm of constant length that swings sideways would be."""
    random = np.random.default_rng(seed)
    angle, out = random.uniform(0.0, 2.0 * np.pi), REACH * random.uniform(0.3, 1.0)
    return np.array([out * np.cos(angle), -np.sqrt(1.0 - out**2), out * np.sin(angle)])


def mean_rewards(env: Reach, tried: np.ndarray) -> np.ndarray:
    """The mean reward of a step with gains (c, 4): of pulls towards goals and of damping, at the middle and the tip."""
    (seen, _), total = env.reset(seed=[*range(GOALS)] * len(tried)), np.zeros(len(tried) * GOALS)
    towards, damping = np.hsplit(np.repeat(tried, GOALS, axis=0)[:, :, None], 2)
    for _ in range(env.episode_steps):
        way, speeds = seen[:, 12:] - seen[:, 6:9], (seen[:, 3:6], seen[:, 9:12])
        pulls = [towards[:, k] * way - damping[:, k] * speeds[k] for k in range(2)]
        seen, rewards, *_ = env.step(np.hstack(pulls))
        total += rewards / env.episode_steps
    return total.reshape(len(tried), GOALS).mean(axis=1)


def main(rounds: int = 5, episode_steps: int = 50, substeps: int = 24) -> list[float]:
    env, random = Reach(len(SCALES) * GOALS, episode_steps, substeps), np.random.default_rng(0)
    best, rewards = np.zeros(4), []
    for number in range(rounds):
        tried = best + SCALES[:, None] * random.normal(size=(len(SCALES), 4))
        found = mean_rewards(env, tried)
        best = tried[found.argmax()]
        rewards += [*([float(found[0])] if number == 0 else []), float(found.max())]
        print(f"round {number + 1}: the mean reward of a step is {found.max():.3f}, gains {np.round(best, 2)}")
    return rewards


if __name__ == "__main__":
    main()
