"""Contact between bodies conserves linear and angular momentum, with friction, rotation and overlaps."""

import numpy as np
import pytest

import supple as sp
from supple.model.system import build_system, initial_state
from supple.solvers.xpbd.solver import XPBD

SOFT = sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=1000)
HEAVY = sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=8000)


def momenta(system, state):
    m = system.masses[:, None]
    return (m * state.velocities).sum(axis=0), np.cross(state.positions, m * state.velocities).sum(axis=0)


def spinning(name, position, velocity, spin, material, shape):
    if shape == "ball":
        mesh = sp.shapes.sphere(radius=0.1, edge_length=0.06)
    else:
        mesh = sp.shapes.box((0.15, 0.12, 0.1), (2, 2, 2))
    return sp.Body(name, mesh, material, position=position, velocity=velocity, angular_velocity=spin, friction=0.6)


@pytest.mark.parametrize("shape", ["ball", "box"])
@pytest.mark.parametrize("other", [SOFT, HEAVY], ids=["equal", "heavy"])
def test_two_spinning_bodies_that_collide_keep_both_momenta(shape, other):
    bodies = [
        spinning("a", (-0.13, 0.04, 0.01), (2.0, 0, 0.3), (3, 9, -14), SOFT, shape),
        spinning("b", (0.13, 0, 0), (-1.0, 0.2, 0), (-6, 2, -11), other, shape),
    ]
    scene = sp.Scene(bodies, gravity=(0, 0, 0))
    system, state = build_system(scene), initial_state(scene)
    linear, angular = momenta(system, state)
    m = system.masses
    scale = np.sum(m * np.linalg.norm(state.velocities, axis=1))
    arms = np.sum(m * np.linalg.norm(state.velocities, axis=1) * np.linalg.norm(state.positions, axis=1))
    energy, touched = 0.5 * m @ (state.velocities**2).sum(axis=1), 0
    for frame in sp.simulate(scene, XPBD(substeps=20), 1 / 60, 24):
        touched += frame.report.details.contacts
        assert frame.report.kinetic_energy + frame.report.elastic_energy <= energy * (1 + 1e-9)
        now = momenta(system, frame.state)
        assert np.abs(now[0] - linear).max() < 1e-12 * scale
        assert np.abs(now[1] - angular).max() < 1e-10 * arms
    assert touched > 0
