"""After a blow, no step makes energy of the velocities before it."""

import numpy as np
import pytest
from tests.scenes import converged

import supple as sp
from supple.solvers.implicit.stepping import substep


def drop(rigid, dt, steps=40):
    """A cube of 10 cm that meets the floor at 1.6 m/s: what each step makes, and the largest kinetic energy [J]."""
    place = {"position": (0, 0.1, 0), "velocity": (0.1, -1.26, 0)}
    mesh = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2))
    soft = sp.StableNeoHookean(youngs=1e6, poisson=0.3, density=1000.0)
    body = sp.RigidBody("cube", mesh, density=1000.0, **place) if rigid else sp.Body("cube", mesh, soft, **place)
    scene = sp.Scene([body], obstacles=[sp.HalfSpace(friction=0.3)])
    frames = converged(sp.simulate(scene, sp.Implicit(integrator="bdf2"), dt, steps))
    made = [frame.report.details.work["numerical"] for frame in frames]
    return np.array(made), max(frame.report.kinetic_energy for frame in frames)


@pytest.mark.parametrize("rigid", [True, False], ids=["rigid", "soft"])
@pytest.mark.parametrize("dt", [1 / 60, 1 / 240])
def test_no_energy_returns_after_a_blow(rigid, dt):
    made, largest = drop(rigid, dt)
    total = np.concatenate([[0.0], np.cumsum(made)])
    rise = (total - np.minimum.accumulate(total)).max()
    assert rise < 0.01 * largest
    assert total[-1] < -0.5 * largest  # the blow took it


def test_a_smooth_motion_repeats_no_step(monkeypatch):
    """A beam that swings, from its largest deflection: all steps but the first have their history."""
    judged = []

    def noted(*args):
        judged.append(makes_energy(*args))
        return judged[-1]

    makes_energy = substep.makes_energy
    monkeypatch.setattr(substep, "makes_energy", noted)
    material = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1000.0)
    body = sp.Body("beam", sp.shapes.box((0.4, 0.1, 0.1), (4, 1, 1)), material)
    scene = sp.Scene([body], pins=[sp.Pin("beam", sp.InBox((-1, -1, -1), (-0.199, 1, 1)))])
    list(sp.simulate(scene, sp.Implicit(integrator="bdf2"), 0.01, 60))
    assert judged == [False] * 59
