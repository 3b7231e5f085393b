"""Momentum, spin and energy without a cause; measures that differ from the recorded states."""

import numpy as np
import pytest
from tests.recordings import system_in

import supple as sp

from .conftest import V, X, failures


def consistently(file, n, frame, velocities):
    """Replace the velocities of a frame, and what was measured on them."""
    m, x = system_in(file).masses, file[X][frame * n : (frame + 1) * n]
    file[V][frame * n : (frame + 1) * n] = velocities
    P, center = m @ velocities, m @ x / m.sum()
    file["supple/frames/kinetic_energy"][frame] = 0.5 * m @ (velocities**2).sum(axis=1)
    file["supple/frames/linear_momentum"][frame] = P
    file["supple/frames/angular_momentum"][frame] = m @ np.cross(x - center, velocities - P / m.sum())


def test_momentum_without_a_force(free, corrupted):
    def push(file, n):
        consistently(file, n, 6, file[V][6 * n : 7 * n] + np.array([1e-4, 0, 0]))

    assert failures(corrupted(free, push)) == {"momentum": 6, "balance": 6}


def test_spin_without_a_torque(free, corrupted):
    def turn(file, n):
        x, v = file[X][6 * n : 7 * n], file[V][6 * n : 7 * n]
        m = system_in(file).masses
        consistently(file, n, 6, v + np.cross([0, 1e-3, 0], x - m @ x / m.sum()))

    assert failures(corrupted(free, turn)) == {"spin": 6, "balance": 6}


def test_energy_without_work(free, corrupted):
    def stir(file, n):
        rng = np.random.default_rng(2)
        consistently(file, n, 4, file[V][4 * n : 5 * n] + rng.normal(scale=2.0, size=(n, 3)))

    assert failures(corrupted(free, stir), only=["energy", "records"]) == {"energy": 4}
    assert failures(corrupted(free, stir), only=["energy"], max_energy_gain=1e3) == {}


def test_works_that_do_not_add_up(free, corrupted):
    def change(file, n):
        file["supple/frames/details/work"][3] += 1e-6

    def leave_open(file, n):
        works = file["supple/frames/details/work"]
        works[3] -= [0.0] * (works.shape[1] - 1) + [1e3]
        file["supple/frames/details/energy_residual"][3] += 1e3

    assert failures(corrupted(free, change)) == {"balance": 3}
    assert failures(corrupted(free, leave_open)) == {"balance": 3}
    assert failures(corrupted(free, leave_open), max_energy_gain=1e3) == {}


def test_a_velocity_that_was_not_measured(free, corrupted):
    def change(file, n):
        file[V][5 * n + 3, 0] += 1e-6

    assert failures(corrupted(free, change), only=["records"]) == {"records": 5}


@pytest.mark.parametrize("name", ["kinetic_energy", "elastic_energy", "potential_energy", "min_det_F"])
def test_a_measure_that_was_changed(free, corrupted, name):
    def change(file, n):
        file[f"supple/frames/{name}"][2] *= 1.0 + 1e-5

    assert failures(corrupted(free, change)) == {"records": 2}


def test_volume(free, corrupted):
    def squeeze(file, n):
        file[X][4 * n : 5 * n] = file[X][4 * n : 5 * n] * [1.0, 0.4, 1.0]

    assert failures(free, max_volume_change=1e-3) == {"volume": 0}
    assert sp.check_recording(free)["volume"].worst == pytest.approx(0.1, rel=1e-6)
    assert failures(corrupted(free, squeeze), only=["volume"]) == {"volume": 4}
    assert failures(corrupted(free, squeeze), only=["volume"], max_volume_change=0.7) == {}
