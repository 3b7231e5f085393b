"""Batches: the bits of single simulations, snapshots, actions and observations."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import supple as sp
from supple.errors import SceneError, SolverError

DT = 1 / 60
MESH = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2))
SOFT = sp.StableNeoHookean(youngs=1e4, poisson=0.3, density=1000)
FLOOR = sp.HalfSpace(friction=0.4, name="floor")
SOLVERS = (sp.XPBD(substeps=8), sp.Implicit())
NAMES = ("xpbd", "implicit")


def cubes(youngs=2e4, speed=0.5):
    """Two soft cubes that slide, one on the other, on a floor; an input pulls at the upper one."""
    soft = sp.StableNeoHookean(youngs=youngs, poisson=0.3, density=1000, damping=0.01)
    low = sp.Body("low", MESH, soft, position=(0, 0.0505, 0), velocity=(speed, 0, 0), friction=0.3)
    high = sp.Body("high", MESH, soft, position=(0.02, 0.152, 0), friction=0.3)
    pull = sp.Force("high", np.arange(len(MESH.vertices)), sp.ForceInput("pull"))
    return sp.Scene([low, high], [FLOOR], forces=[pull])


PARAMETERS = {"youngs": [1e4, 2e4, 3e4], "speed": [0.0, 0.5, 1.0]}
ACTIONS = [{"pull": np.array([[k, 0.0, i] for i in range(3)], dtype=float)} for k in range(6)]


def single(k, solver, steps):
    """The states of copy k, simulated alone."""
    scene = cubes(*(values[k] for values in PARAMETERS.values()))
    run = sp.simulate(scene, solver, DT, steps, control=lambda frame: {"pull": ACTIONS[frame.index]["pull"][k]})
    return [frame for frame in run]


def same_state(one, two):
    return (
        one.time == two.time
        and np.array_equal(one.positions, two.positions)
        and np.array_equal(one.velocities, two.velocities)
        and all(np.array_equal(one.inputs[name], two.inputs[name]) for name in one.inputs | two.inputs)
    )


@pytest.mark.parametrize("solver", SOLVERS, ids=NAMES)
def test_a_batch_has_the_bits_of_single_simulations_for_any_number_of_threads(solver):
    expected = [single(k, solver, len(ACTIONS)) for k in range(3)]
    for threads in (1, 3):
        with sp.Batch(cubes, 3, solver, DT, parameters=PARAMETERS, threads=threads) as batch:
            for index, actions in enumerate(ACTIONS):
                batch.step(actions)
                for k in range(3):
                    frame = batch.frame(k)
                    assert same_state(frame.state, expected[k][index].state)
                    assert frame.report.status == expected[k][index].report.status
                    assert frame.report.elastic_energy == expected[k][index].report.elastic_energy
                    assert frame.report.details.contacts == expected[k][index].report.details.contacts
    assert expected[1][-1].report.details.contacts > 0, "they touch"


@pytest.mark.parametrize("solver", SOLVERS, ids=NAMES)
def test_a_snapshot_in_mid_contact_is_exact_whatever_happens_in_between(solver):
    with sp.Batch(cubes, 2, solver, DT, parameters={"youngs": [1e4, 2e4]}) as batch:
        for _ in range(4):
            batch.step({"pull": (0, -1, 0)})
        there = batch.snapshot()
        assert all(batch.frame(k).report.details.contacts for k in range(2))

        def rest():
            for k in range(4):
                batch.step({"pull": (k, 0, 0)})
            return [batch.frame(k).state for k in range(2)]

        first = rest()
        batch.restore(there)
        for _ in range(3):
            batch.step({"pull": (-20, 5, 3)})  # elsewhere, with the same times
        batch.restore(there, [True, False])
        batch.restore(there, [1])
        again = rest()
    assert all(same_state(one, two) for one, two in zip(first, again, strict=True))


def test_an_obstacle_moves_as_its_input_says_also_at_a_time_that_was_there_before():
    """Poses are cached by time; after a restored snapshot the same time comes with another value."""
    soft = sp.StableNeoHookean(youngs=2e4, poisson=0.3, density=1000)
    cube = sp.Body("cube", MESH, soft, position=(0, 0.0505, 0))
    scene = sp.Scene([cube], [sp.HalfSpace(motion=sp.MotionInput("lift"), name="floor")])
    with sp.Batch(scene, 1, sp.XPBD(substeps=8), DT) as batch:
        batch.step()
        there = batch.snapshot()
        heights = []
        for lift in (0.0, 0.01, 0.0):
            batch.restore(there)
            batch.step({"lift": (0, lift, 0)})
            heights.append(batch.positions["cube"][0, :, 1].min())
    assert heights[0] == heights[2]
    assert heights[1] == pytest.approx(heights[0] + 0.01, abs=2e-3)


def test_copies_are_independent_and_can_be_reset_one_by_one():
    batch = sp.Batch(cubes(), 3, sp.XPBD(substeps=4), DT, threads=2)
    start = batch.positions["low"]
    assert start.shape == (3, len(MESH.vertices), 3)
    batch.step({"pull": [(9, 0, 0), (0, 0, 0), (0, 0, 0)]})
    assert np.array_equal(batch.positions["high"][1], batch.positions["high"][2])
    assert batch.velocities["high"][0, :, 0].mean() > batch.velocities["high"][1, :, 0].mean() + 0.1
    assert batch.inputs["pull"].tolist() == [[9, 0, 0], [0, 0, 0], [0, 0, 0]]
    batch.reset([2])
    assert np.array_equal(batch.positions["low"][2], start[2])
    assert batch.times.tolist() == [DT, DT, 0.0]
    energies = batch.observe(lambda frame: [frame.report.kinetic_energy, frame.index])
    assert energies.shape == (3, 2)
    assert energies[:, 1].tolist() == [1, 1, 0]
    batch.close()
    batch.step(copies=[True, True, False])
    batch.step(copies=[2])
    assert batch.times.tolist() == [2 * DT, 2 * DT, DT]
    batch.close()


def test_a_copy_that_cannot_go_on_stays_and_the_others_go_on():
    batch = sp.Batch(cubes(), 2, sp.XPBD(substeps=20), DT, threads=1)
    batch.step({"pull": [(1e300, 0, 0), (0, 0, 0)]})
    assert batch.statuses == (sp.Status.NOT_FINITE, sp.Status.CONVERGED)
    assert batch.can_go_on.tolist() == [False, True]
    assert "position is lost" in batch.frame(0).report.message
    batch.step({"pull": (0, 0, 0)})
    assert batch.times.tolist() == [0.0, 2 * DT]
    assert np.isfinite(batch.positions["high"]).all()
    batch.reset([0])
    batch.step()
    assert batch.can_go_on.all()


def go_on_in_a_fork():
    """A batch in a process that forks: its child goes on from a snapshot with the same bits."""
    batch = sp.Batch(cubes(), 2, sp.XPBD(substeps=2), DT, threads=2)
    batch.step()
    there = batch.snapshot()
    batch.step()
    expected = batch.frame(1).state
    child = os.fork()
    if child == 0:
        batch.restore(there)
        batch.step()
        os._exit(0 if same_state(batch.frame(1).state, expected) else 1)
    assert os.waitpid(child, 0)[1] == 0
    batch.close()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_a_batch_goes_on_in_a_forked_process():
    # Elsewhere, since some machines take a minute to copy the process of many tests.
    code = "import test_batch; test_batch.go_on_in_a_fork()"
    done = subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parent, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_nothing_moves_where_an_action_is_wrong_and_errors_are_one_line():
    batch = sp.Batch(cubes(), 2, sp.XPBD(substeps=2), DT)
    for actions, expected in (
        ({"push": (0, 0, 0)}, "input 'push' does not exist; there are: pull"),
        ({"pull": np.zeros((3, 3))}, r"input 'pull' is set to an array of shape \(3, 3\)"),
        ({"pull": [(0, 0, 0), (0, np.inf, 0)]}, "input 'pull' is not finite"),
        (1, "actions are 1; give a mapping"),
    ):
        with pytest.raises(SceneError, match=expected):
            batch.step(actions)
    assert batch.times.tolist() == [0.0, 0.0]
    with pytest.raises(SceneError, match="copy 2 does not exist; there are 2"):
        batch.reset([2])
    with pytest.raises(SceneError, match=r"copies are 0\.5; give numbers"):
        batch.reset(0.5)
    with pytest.raises(SceneError, match="the snapshot is 1; give what"):
        batch.restore(1)
    one = sp.Batch(lambda: sp.Scene([sp.Body("a", MESH, SOFT)]), 1, sp.XPBD())
    with pytest.raises(SceneError, match="the snapshot does not describe copy 0"):
        batch.restore(one.snapshot())
    with pytest.raises(SceneError, match="n is 0; give a whole number above zero"):
        sp.Batch(cubes(), 0)
    with pytest.raises(SolverError, match="Batch: dt is -1; it must be finite and above zero"):
        sp.Batch(cubes(), 1, dt=-1)
    with pytest.raises(SolverError, match="the solver is 3"):
        sp.Batch(cubes(), 1, 3)
    with pytest.raises(SceneError, match=r"parameter 'youngs' is \[1\]; give 2 values, one for each copy"):
        sp.Batch(cubes, 2, parameters={"youngs": [1]})
    with pytest.raises(SceneError, match="parameters are for a function"):
        sp.Batch(cubes(), 2, parameters={"youngs": [1, 2]})
    with pytest.raises(SceneError, match="the function returned a int; it must return a Scene"):
        sp.Batch(lambda: 1, 2)

    def named(name):
        return sp.Scene([sp.Body(name, MESH, SOFT)])

    with pytest.raises(SceneError, match="copy 1 has other bodies"):
        sp.Batch(named, 2, parameters={"name": ["a", "b"]})
