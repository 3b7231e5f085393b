"""Verdicts of `Sensitivity.check`: what is at fault where gradient and differences do not agree."""

from dataclasses import replace

import numpy as np
import pytest
from tests.gradients import scenes
from tests.gradients.scenes import implicit

import supple as sp
from supple.gradients.check import check


def tip(frame, factor=1.0):
    """A loss whose derivative is off by a factor."""
    x = frame.positions["bar"]
    by = np.zeros_like(x)
    by[-1, 1] = factor * 2 * x[-1, 1]
    return x[-1, 1] ** 2, {"bar": by}


def sensitivity(scene_of, loss=tip, solver=None, steps=4):
    return sp.Sensitivity(scene_of, loss, solver or implicit(), dt=0.01, steps=steps)


def test_a_wrong_gradient_is_wrong():
    found = sensitivity(scenes.damped, lambda frame: tip(frame, 1.003)).check(np.ones(3))
    assert found.verdict == "wrong"
    assert not found.ok
    assert found.relative == pytest.approx(0.003, rel=1e-3)
    assert "the gradient is wrong" in str(found)
    assert sensitivity(scenes.damped).check(np.ones(3)).ok


def test_a_wrong_gradient_is_wrong_with_a_loose_tolerance_and_contact():
    loose = replace(implicit(), tolerance=1e-3, force_tolerance=1e-4)
    wrong = sensitivity(scenes.frictionless, lambda frame: tip(frame, 0.9), loose, 8)
    assert wrong.check(np.ones(4), step=1e-5).verdict == "wrong"


def test_loose_tolerances_blame_the_differences():
    loose = sp.Implicit(integrator="bdf2", tolerance=0.03, contact=None)
    found = sensitivity(scenes.damped, solver=loose).check(np.ones(3), step=1e-6)
    assert found.verdict == "noisy", str(found)
    assert "with tolerance=0.03; use tolerance=3e-06" in found.reason
    assert found.relative <= 1e-4
    sharper = replace(loose, tolerance=3e-6)
    assert sensitivity(scenes.damped, solver=sharper).check(np.ones(3), step=1e-6).ok


def test_long_steps_of_differences_are_extrapolated():
    found = sensitivity(scenes.damped).check(np.ones(3), step=0.1)
    assert found.ok, str(found)
    assert "small enough" in found.reason


def test_a_kink_of_the_scene():
    found = sensitivity(lambda p: scenes.cantilever([1 + abs(p[0] - 1 - 5e-6), p[1], 1, 1])).check(np.ones(2))
    assert found.verdict == "kink", str(found)


def test_a_run_that_is_divided_otherwise_is_a_jump():
    """Where the number of substeps changes with the angle by which a script turns."""

    solver = replace(implicit(), path_tolerance=0.005)

    def substeps(p):
        frames = sp.simulate(scenes.twisted([1, 1, p]), solver, dt=0.01, steps=2)
        return [frame.report.details.substeps for frame in frames]

    low, high = 0.7, 1.6
    many = substeps(high)
    assert substeps(low) != many
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if substeps(middle) == many else (middle, high)
    loss = sp.Misfit("positions", "bar", np.zeros((20, 3)))
    found = sensitivity(lambda p: scenes.twisted([1, 1, p[0]]), loss, solver, steps=2).check([high], 1)
    assert found.verdict == "kink", str(found)
    assert "substeps in one of the two runs" in found.reason


def test_runs_that_do_not_converge_with_a_sharper_tolerance_are_compared_as_they_are():
    class Square:
        solver = sp.Implicit()

        def value_and_gradient(self, p):
            if self.solver.tolerance is not None:
                raise sp.SolverError("frame 1 did not converge")
            return float(p @ p), 2.1 * p

        def value_and_structure(self, p):
            return float(p @ p), [{"contacts": 1.0}]

    assert check(Square(), np.ones(2), np.eye(2), 1e-4).verdict == "wrong"
