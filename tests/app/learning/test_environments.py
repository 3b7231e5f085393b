"""Environments: gymnasium's own checker, and the same as gymnasium's vector of single environments."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import SyncVectorEnv

import supple as sp
from supple.app.learning.environments import BatchEnv, BatchVectorEnv
from supple.app.learning.reaching import Reaching

SHORT = Reaching(solver=sp.XPBD(substeps=4, contact=None), episode_steps=4)


def test_gymnasium_has_no_objection():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # The forces and their reach are bounded, what a soft arm does is not.
        warnings.filterwarnings("ignore", message=".*observation space m.*imum value is -?infinity")
        check_env(BatchEnv(SHORT), skip_render_check=True)


def test_it_is_made_by_its_name():
    env = gymnasium.make("supple.app.learning.environments:Supple/Reaching-v0")
    seen, _ = env.reset(seed=3)
    assert seen.shape == (15,)
    vector = gymnasium.make_vec("Supple/Reaching-v0", num_envs=3, vectorization_mode="vector_entry_point")
    assert isinstance(vector.unwrapped, BatchVectorEnv)
    assert np.array_equal(vector.reset(seed=3)[0][0], seen)
    env.close()
    vector.close()


def test_it_does_what_gymnasiums_vector_of_single_environments_does():
    """With the same seeds, actions and new episodes; some end because the goal is reached."""
    easy = Reaching(solver=SHORT.solver, episode_steps=5, strength=0.05, reach=0.2, tolerance=0.1)
    ours = BatchVectorEnv(easy, 3, threads=2)
    theirs = SyncVectorEnv([lambda: BatchEnv(easy)] * 3)
    assert ours.single_action_space == theirs.single_action_space
    assert ours.observation_space == theirs.observation_space
    assert ours.metadata["autoreset_mode"] == theirs.metadata["autoreset_mode"]
    assert np.array_equal(ours.reset(seed=5)[0], theirs.reset(seed=5)[0])
    random = np.random.default_rng(0)
    ends = np.zeros(2, dtype=int)
    for _ in range(14):
        actions = random.uniform(-1, 1, (3, 6))
        mine, other = ours.step(actions)[:4], theirs.step(actions)[:4]
        for one, two in zip(mine, other, strict=True):
            assert np.array_equal(one, two)
            assert one.dtype == two.dtype
        assert mine[0] in ours.observation_space
        ends += [mine[2].sum(), mine[3].sum()]
    assert (ends > 0).all(), "terminated and truncated"
    assert np.array_equal(ours.reset(seed=[1, None, 2])[0][[0, 2]], theirs.reset(seed=[1, 7, 2])[0][[0, 2]])
    ours.close()
    theirs.close()


def test_an_episode_that_the_solver_cannot_continue_is_terminated_and_starts_again():
    env = BatchVectorEnv(Reaching(solver=sp.XPBD(substeps=1, contact=None), strength=1e300), 2)
    env.reset(seed=1)
    push = np.array([[1.0] * 6, [0.0] * 6])
    seen, _, terminated, truncated, _ = env.step(push)
    assert terminated.tolist() == [True, False]
    assert not truncated.any()
    assert np.isfinite(seen).all()
    _, rewards, terminated, _, _ = env.step(0 * push)
    assert rewards[0] == 0.0
    assert not terminated.any()
    assert env.batch.times == pytest.approx([0.0, 2 * env.task.dt])
    env.close()


def test_the_reward_is_the_distance_in_lengths_of_the_arm():
    seen = np.zeros((2, 15))
    seen[:, 12:] = [[0.3, 0.0, 0.4], [0.0, 0.02, 0.0]]
    rewards, reached = Reaching().rewards(seen, np.array([[1.0] * 6, [0.0] * 6]))
    assert rewards == pytest.approx([-0.51, 0.98])
    assert reached.tolist() == [False, True]
    seen[1, 9] = 1.0  # it is there, and moves
    assert not Reaching().rewards(seen, np.zeros((2, 6)))[1].any()
