"""Newmark's method: what it keeps of momentum and energy where forces are stiff, and the forces of its pins."""

import numpy as np
import pytest
from tests.scenes import at_start

import supple as sp

RUBBER = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1000)
CUBE = sp.shapes.box((0.2, 0.2, 0.2), (2, 2, 2))


def stitched_cubes(mu):
    """Two free cubes stitched face to face: their stitches start with far more energy than the motion has."""
    bodies = [
        sp.Body("a", CUBE, RUBBER, position=(0, 0.2, 0), velocity=(0.1, 0, 0), angular_velocity=(0, 2, 1)),
        sp.Body("b", CUBE, RUBBER),
    ]
    stitch = sp.SoftVertexTriangleStitch("a", "b", max_distance=1e-6, mu=mu, lam=mu, min_separate_distance=2e-3)
    return sp.Scene(bodies, stitches=[stitch], gravity=(0, 0, 0))


def energy(report):
    return report.kinetic_energy + report.elastic_energy + report.stitch_energy


@pytest.mark.parametrize(
    ("mu", "rate", "steps"),
    [
        (1e6, 60, 100),
        *(pytest.param(*case, marks=pytest.mark.slow) for case in ((1e6, 60, 300), (1e6, 240, 360), (1e7, 60, 300))),
    ],
)
def test_stiff_stitches_that_start_loaded_make_neither_energy_nor_spin(mu, rate, steps):
    scene = stitched_cubes(mu)
    start = at_start(scene)
    assert start.stitch_energy > 100 * start.kinetic_energy
    for frame in sp.simulate(scene, sp.Implicit(integrator="newmark"), 1 / rate, steps):
        report = frame.report
        assert report.status == "converged"
        assert energy(report) < 1.02 * energy(start)
        for key in ("linear_momentum", "angular_momentum"):
            before = getattr(start, key)
            assert np.linalg.norm(getattr(report, key) - before) < 1e-10 * np.linalg.norm(before)
    assert energy(report) > 0.8 * energy(start), "nothing damps the stitches"


def test_the_reaction_of_a_pin_is_what_changes_the_momentum_of_a_step():
    pin = sp.Pin("cube", sp.InBox((-1, 0.099, -1), (1, 1, 1)))
    scene = sp.Scene([sp.Body("cube", CUBE, RUBBER)], pins=[pin])
    before = np.zeros(3)
    for frame in sp.simulate(scene, sp.Implicit(integrator="newmark", tolerance=1e-7), 1 / 240, 10):
        gained = 240 * (frame.report.linear_momentum - before)
        weight = frame.system.masses.sum() * np.array([0, -9.81, 0])
        (reaction,) = frame.report.details.reaction_forces.values()
        assert np.abs(reaction + weight - gained).max() < 1e-6 * np.abs(weight).max()
        before = frame.report.linear_momentum


def turning(max_substeps, youngs=2e5, spin=(10, 20, 50)):
    """Damped rubber of 4 mm, so stiff that a turn of 50 degrees in a step strains it."""
    law = sp.StableNeoHookean(youngs=youngs, poisson=0.3, damping=0.02)
    soft = sp.Body("soft", sp.shapes.box((0.004, 0.001, 0.001), (8, 2, 2)), law, angular_velocity=spin)
    scene = sp.Scene([soft], gravity=(0, 0, 0))
    solver = sp.Implicit(integrator="newmark", max_substeps=max_substeps)
    return [frame.report for frame in sp.simulate(scene, solver, 1 / 60, 2)]


@pytest.mark.parametrize(("youngs", "spin"), [(2e5, (10, 20, 50)), (1e4, (20, 40, 100))])
def test_a_step_that_makes_energy_is_repeated_shorter(youngs, spin):
    """Of the second one, the forces of damping would give a hundred times the energy of the motion."""
    reports = turning(64, youngs, spin)
    assert {str(report.status) for report in reports} == {"converged"}
    assert reports[-1].details.substeps > 1
    energies = [report.kinetic_energy + report.elastic_energy for report in reports]
    assert max(energies) < 1.1 * energies[0]


def test_energy_from_nowhere_is_named():
    report = next(report for report in turning(1) if report.status != "converged")
    assert report.status == "energy_gained"
    assert "of the energy of body 'soft' has no source; take a shorter step" in report.message
