"""Collisions at many times the bodies' size a step, and rest in long steps, converge with the defaults."""

import pytest

import supple as sp

RUBBER = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0)
CUBE = sp.shapes.box((0.2, 0.2, 0.2), (2, 2, 2))


def test_long_steps_of_a_resting_cube_are_not_divided():
    body = sp.Body("cube", CUBE, RUBBER, position=(0, 0.1001, 0))
    for frame in sp.simulate(sp.Scene([body], [sp.HalfSpace()]), sp.Implicit(), 2.0, 3):
        assert frame.report.status == "converged"
        assert frame.report.details.substeps == 1
    weight = frame.system.masses.sum() * 9.81
    assert frame.report.details.contact_forces["cube"][1] == pytest.approx(weight, rel=1e-3)
