"""Collisions at many times the bodies' size a step, and rest in long steps, converge with the defaults."""

import numpy as np
import pytest

import supple as sp

RUBBER = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0)
CUBE = sp.shapes.box((0.2, 0.2, 0.2), (2, 2, 2))


def head_on(speed: float) -> sp.Scene:
    left = sp.Body("left", CUBE, RUBBER, position=(-0.3, 0, 0), velocity=(speed, 0, 0))
    right = sp.Body("right", CUBE, RUBBER, position=(0.3, 0, 0), velocity=(-speed, 0, 0))
    return sp.Scene([left, right], gravity=(0, 0, 0))


@pytest.mark.parametrize("dt", [0.1, 1.0])
def test_head_on_cubes_converge_and_keep_their_momentum(dt: float):
    frame = next(iter(sp.simulate(head_on(20.0), sp.Implicit(), dt, 1)))
    assert frame.report.status == "converged", frame.report.message
    assert frame.det_F.min() > 0.0
    # A substep of half a cube's size, and those of growing length before and after it.
    assert frame.report.details.substeps <= 24
    masses = frame.system.masses
    assert np.abs(masses @ frame.state.velocities).max() < 1e-6 * masses.sum() * 20.0


def test_a_cube_that_hits_a_floor_at_50_m_per_s_stays_above_it():
    body = sp.Body("cube", CUBE, RUBBER, position=(0, 1, 0), velocity=(3, -50, 0))
    for frame in sp.simulate(sp.Scene([body], [sp.HalfSpace(friction=0.5)]), sp.Implicit(), 0.2, 3):
        assert frame.report.status == "converged", frame.report.message
        assert frame.det_F.min() > 0.0
        assert frame.positions["cube"][:, 1].min() > 0.0


def test_long_steps_of_a_resting_cube_are_not_divided():
    body = sp.Body("cube", CUBE, RUBBER, position=(0, 0.1001, 0))
    for frame in sp.simulate(sp.Scene([body], [sp.HalfSpace()]), sp.Implicit(), 2.0, 3):
        assert frame.report.status == "converged"
        assert frame.report.details.substeps == 1
    weight = frame.system.masses.sum() * 9.81
    assert frame.report.details.contact_forces["cube"][1] == pytest.approx(weight, rel=1e-3)
