"""The stable Neo-Hookean body against closed forms: a bar in uniaxial tension and compression."""

from functools import cache

import numpy as np
import pytest

import supple as sp
from supple.solvers.xpbd.solver import XPBD

YOUNGS, POISSON = 1e5, 0.4
# stretch: first Piola stress along the bar [Pa], stretch across it; lateral faces free
TABLE = {
    1.001: (99.914386, 0.99960022),
    1.5: (36640.21164, 0.843274043),
    0.5: (-96428.571429, 1.264911064),
    2.0: (61607.142857, 0.741619849),
}
WIDTH = 0.1


def bar(length, divisions):
    mesh = sp.shapes.box((WIDTH, length, WIDTH), divisions)
    return mesh, mesh.vertices - mesh.vertices.min(axis=0)


def last(frames):
    frame = None
    for frame in frames:
        assert frame.report.status == "converged"
    assert frame is not None
    return frame


@pytest.mark.parametrize("stretch", TABLE)
def test_a_stretched_bar_agrees_with_the_closed_form(stretch):
    """A disturbed bar that is held at its ends only comes to rest in the homogeneous state, with the exact force.

    The force is the momentum that the bar gains in a very short step after the release of one end, divided by time.
    """
    stress, across = TABLE[stretch]
    mesh, X = bar(0.2, (2, 4, 2))
    exact = mesh.vertices * (across, stretch, across)
    bottom, top = np.flatnonzero(X[:, 1] < 1e-9), np.flatnonzero(X[:, 1] > 0.2 - 1e-9)
    ends = np.concatenate([bottom, top])
    start = exact + np.random.default_rng(0).uniform(-2e-3, 2e-3, exact.shape)
    start[ends] = exact[ends]

    def scene(held, damping):
        material = sp.StableNeoHookean(youngs=YOUNGS, poisson=POISSON, damping=damping)
        return sp.Scene(bodies=[sp.Body("bar", mesh, material)], pins=[sp.Pin("bar", held)], gravity=(0, 0, 0))

    frames = sp.simulate(scene(ends, 0.002), XPBD(substeps=60), 1 / 60, 31, initial_positions={"bar": start})
    rest = last(frames).positions["bar"]
    shift = np.abs(rest - exact).max()
    assert shift <= min(1e-2 * abs(stretch - 1.0), 1e-3) * 0.2
    dt = 1e-6
    released = last(sp.simulate(scene(bottom, 0.0), XPBD(substeps=1), dt, 1, initial_positions={"bar": rest}))
    pull = -released.report.linear_momentum[1] / dt
    assert pull / WIDTH**2 == pytest.approx(stress, rel=0.01)


@cache
def hanging_weight(substeps, damping=0.05):
    """Stretch along and across the middle of a bar whose heavy end stretches it to 1.5 by gravity."""
    stress, across = TABLE[1.5]
    mesh, X = bar(0.4, (2, 8, 2))
    layer = X[mesh.tets][:, :, 1].max(axis=1) < 0.05 + 1e-9
    density = np.full(len(mesh.tets), 1000.0)
    # The middle also carries half of the bar.
    density[layer] = (stress * WIDTH**2 / 9.81 - 1000.0 * WIDTH**2 * 0.15) / mesh.volumes[layer].sum()
    top = np.flatnonzero(X[:, 1] > 0.4 - 1e-9)
    material = sp.StableNeoHookean(youngs=YOUNGS, poisson=POISSON, density=density, damping=damping)
    start = mesh.vertices * (across, 1.5, across)
    scene = sp.Scene(bodies=[sp.Body("bar", mesh, material)], pins=[sp.Pin("bar", top)])
    x = last(sp.simulate(scene, XPBD(substeps=substeps), 1 / 60, 60, initial_positions={"bar": start})).positions["bar"]
    upper, lower = np.isclose(X[:, 1], 0.25), np.isclose(X[:, 1], 0.15)
    along = (x[upper, 1].mean() - x[lower, 1].mean()) / 0.1
    middle = np.isclose(X[:, 1], 0.2)
    return along, np.ptp(x[middle, 0]) / WIDTH


def test_a_hanging_weight_stretches_the_bar_by_the_closed_form_at_any_number_of_substeps():
    results = np.array([hanging_weight(substeps) for substeps in (20, 40, 80)])
    np.testing.assert_allclose(results, np.tile([1.5, TABLE[1.5][1]], (3, 1)), rtol=0.01)
    assert abs(results[2, 0] - results[1, 0]) < 0.001


def test_damping_does_not_make_a_loaded_bar_sag_more():
    assert hanging_weight(40, damping=0.2)[0] == pytest.approx(hanging_weight(40)[0], rel=2e-3)
