"""A soft arm learns to reach a point: random search finds the gains of a controller.

Needs the extra `learning` (gymnasium).

Run it:  python examples/06_learn_to_reach.py
"""

import numpy as np

from supple.app.learning.environments import BatchVectorEnv
from supple.app.learning.reaching import Reaching

CANDIDATES, GOALS = 8, 4
# The first candidate of a round is the best one so far; the others are near it and far from it.
SCALES = np.array([0.0, 0.3, 0.6, 1.0, 2.0, 3.0, 6.0, 12.0])


def forces(seen: np.ndarray, gains: np.ndarray) -> np.ndarray:
    """The middle and the tip are each pulled towards the goal, and damped; four gains (n, 4)."""
    velocities, tip, goal = (seen[:, 3:6], seen[:, 9:12]), seen[:, 6:9], seen[:, 12:15]
    pulls = [gains[:, k, None] * (goal - tip) - gains[:, 2 + k, None] * velocities[k] for k in range(2)]
    return np.clip(np.concatenate(pulls, axis=1), -1.0, 1.0)


def mean_reward(env: BatchVectorEnv, gains: np.ndarray) -> np.ndarray:
    """The mean reward of a step, for each candidate (c, 4) on the same goals."""
    seen, _ = env.reset(seed=[*range(GOALS)] * CANDIDATES)
    total = np.zeros(env.num_envs)
    for _ in range(env.task.episode_steps):
        seen, rewards, *_ = env.step(forces(seen, np.repeat(gains, GOALS, axis=0)))
        total += rewards
    return total.reshape(CANDIDATES, GOALS).mean(axis=1) / env.task.episode_steps


def main(rounds: int = 5, task: Reaching | None = None) -> list[float]:
    env = BatchVectorEnv(task, CANDIDATES * GOALS)
    random = np.random.default_rng(0)
    best, rewards = np.zeros(4), []
    for number in range(rounds):
        tried = best + SCALES[:, None] * random.normal(size=(CANDIDATES, 4))
        found = mean_reward(env, tried)
        best = tried[found.argmax()]
        rewards += [found[0]] if number == 0 else []
        rewards.append(found.max())
        print(f"round {number + 1}: the mean reward of a step is {found.max():.3f}, gains {np.round(best, 2)}")
    env.close()
    return rewards


if __name__ == "__main__":
    main()
