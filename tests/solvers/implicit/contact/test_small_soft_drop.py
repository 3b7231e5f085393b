"""A small, very soft cube that falls, at many angles: its energy never rises."""

import numpy as np
import pytest

import supple as sp

SIDE = 0.0014


@pytest.mark.parametrize("integrator", ["backward_euler", "bdf2"])
def test_a_soft_cube_of_a_millimetre_gains_no_energy(integrator):
    mesh = sp.shapes.box((SIDE, SIDE, SIDE), (2, 2, 2))
    material = sp.StableNeoHookean(youngs=7.8e3, poisson=0.1)
    for seed in range(4):
        random = np.random.default_rng(seed)
        turn, down = tuple(random.uniform(-3, 3, 3)), -float(random.uniform(0, 0.5))
        cube = sp.Body("cube", mesh, material, position=(0, 1.1 * SIDE, 0), rotation=turn, velocity=(0, down, 0))
        scene = sp.Scene([cube], obstacles=[sp.HalfSpace(friction=0.5)])
        mass = 1000.0 * SIDE**3
        energy = 0.5 * mass * down**2 + mass * 9.81 * 1.1 * SIDE
        for frame in sp.simulate(scene, sp.Implicit(integrator=integrator), 1 / 60, 6):
            assert frame.report.status == "converged"
            height = frame.positions["cube"][:, 1].mean()
            later = frame.report.kinetic_energy + frame.report.elastic_energy
            later += mass * 9.81 * height
            assert later < energy * (1.0 + 1e-6)
            energy = later
