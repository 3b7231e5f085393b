"""A soft arm learns to reach a point: an environment of gymnasium, and random search for the gains of a controller.

Needs the extra `learning` (gymnasium), whose vector environment runs copies in processes of their own.

Run it:  python examples/06_learn_to_reach.py
"""

from collections.abc import Callable
from functools import partial

import gymnasium
import numpy as np

import supple as sp

LENGTH, WIDTH, DT = 0.3, 0.04, 0.02
STRENGTH, REACH, NEAR = 2.0, 0.4, 0.03  # of each force [N]; of goals, and near enough, in lengths of the arm
GOALS = 4
# The first candidate of a round is the best one so far; the others are near it and far from it.
SCALES = np.array([0.0, 0.3, 0.6, 1.0, 2.0, 3.0, 6.0, 12.0])


class Reach(gymnasium.Env):
    """Forces on the middle and the tip of a hanging arm are the action; its tip shall reach a point and rest there.

    An observation has the place and velocity of both, and the goal, in lengths of the arm.
    """

    action_space = gymnasium.spaces.Box(-1.0, 1.0, (6,))
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (15,))

    def __init__(self, episode_steps: int = 50, substeps: int = 20) -> None:
        self.episode_steps, self.solver = episode_steps, sp.XPBD(substeps=substeps, contact=None)
        mesh = sp.shapes.box((WIDTH, LENGTH, WIDTH), (1, 6, 1))
        y = mesh.vertices[:, 1]
        self.sections = {"middle": np.flatnonzero(abs(y) < 1e-6), "tip": np.flatnonzero(y < y.min() + 1e-6)}
        material = sp.StableNeoHookean(youngs=3e4, poisson=0.4, density=1000, damping=0.05)
        arm = sp.Body("arm", mesh, material, position=(0, -LENGTH / 2, 0))
        forces = [sp.Force("arm", rows, sp.ForceInput(name)) for name, rows in self.sections.items()]
        self.scene = sp.Scene([arm], pins=[sp.Pin("arm", np.flatnonzero(y > y.max() - 1e-6))], forces=forces)
        self.start = arm.place(mesh.vertices)

    def reset(self, *, seed: int | None = None, options: dict | None = None) -> tuple[np.ndarray, dict]:
        super().reset(seed=seed)
        angle, out = self.np_random.uniform(0.0, 2.0 * np.pi), REACH * self.np_random.uniform(0.3, 1.0)
        # Where an arm of constant length that swings sideways would be.
        self.goal = np.array([out * np.cos(angle), -np.sqrt(1.0 - out**2), out * np.sin(angle)])
        self.forces: dict[str, np.ndarray] = {}
        self.run = sp.simulate(self.scene, self.solver, DT, self.episode_steps, control=lambda frame: self.forces)
        return self.observation(self.start, np.zeros_like(self.start)), {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict]:
        action = np.clip(action, -1.0, 1.0)
        self.forces = {"middle": STRENGTH * action[:3], "tip": STRENGTH * action[3:]}
        frame = next(self.run)
        seen = self.observation(frame.positions["arm"], frame.velocities["arm"])
        distance, speed = np.linalg.norm(seen[6:9] - seen[12:]), np.linalg.norm(seen[9:12])
        reached = bool(distance < NEAR and speed < 10.0 * NEAR)
        ended = reached or not frame.report.status.can_go_on
        reward = float(reached - distance - 0.01 * np.mean(action**2))
        return seen, reward, ended, not ended and frame.index == self.episode_steps, {}

    def observation(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        parts = [of[rows].mean(axis=0) / LENGTH for rows in self.sections.values() for of in (x, v)]
        return np.concatenate([*parts, self.goal]).astype(np.float32)


def pulled(seen: np.ndarray, gains: np.ndarray) -> np.ndarray:
    """The middle and the tip are each pulled towards the goal, and damped, by four gains."""
    velocities, tip, goal = (seen[:, 3:6], seen[:, 9:12]), seen[:, 6:9], seen[:, 12:15]
    pulls = [gains[k] * (goal - tip) - gains[2 + k] * velocities[k] for k in range(2)]
    return np.clip(np.concatenate(pulls, axis=1), -1.0, 1.0)


def mean_reward(env: gymnasium.vector.VectorEnv, gains: np.ndarray, steps: int) -> float:
    seen, _ = env.reset(seed=[*range(GOALS)])
    total = 0.0
    for _ in range(steps):
        seen, rewards, *_ = env.step(pulled(seen, gains))
        total += rewards.mean() / steps
    return total


def main(rounds: int = 5, make: Callable[[], Reach] = Reach, vector=gymnasium.vector.AsyncVectorEnv) -> list[float]:
    env = vector([make] * GOALS)
    steps, random = make().episode_steps, np.random.default_rng(0)
    best, rewards = np.zeros(4), []
    for number in range(rounds):
        tried = best + SCALES[:, None] * random.normal(size=(len(SCALES), 4))
        found = np.array([mean_reward(env, gains, steps) for gains in tried])
        best = tried[found.argmax()]
        rewards += [float(found[0])] if number == 0 else []
        rewards.append(float(found.max()))
        print(f"round {number + 1}: the mean reward of a step is {found.max():.3f}, gains {np.round(best, 2)}")
    env.close()
    return rewards


if __name__ == "__main__":
    main(vector=partial(gymnasium.vector.AsyncVectorEnv, context="spawn"))
