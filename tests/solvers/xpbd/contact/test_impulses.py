"""Impulses on four vertices, and the share of a force that is kept."""

import numpy as np
import pytest

import supple as sp
from supple.model.system import build_system
from supple.solvers.xpbd.contact.impulses import apply_impulse, relative, shift_both
from supple.solvers.xpbd.contact.movers import Movers
from supple.solvers.xpbd.contact.response_rates import kept_share, response_rates

VERTICES = np.array([[3, 0, 4, 1]], dtype=np.int32)
WEIGHTS = {
    "point and triangle": np.array([[1.0, -0.2, -0.5, -0.3]]),
    "edges": np.array([[0.3, 0.7, -0.9, -0.1]]),
}


@pytest.fixture
def motion():
    """Positions at both ends of a substep, and inverse masses, of five vertices."""
    generator = np.random.default_rng(5)
    before = generator.normal(size=(5, 3))
    return before + 0.01 * generator.normal(size=(5, 3)), before, generator.uniform(0.5, 20.0, 5)


def free(w):
    """What moves points that are vertices."""
    none = np.zeros((0, 3))
    body = np.full(len(w), -1, dtype=np.int32)
    return Movers(w, body, np.zeros((len(w), 3)), np.zeros(0), np.zeros((0, 3, 3)), np.zeros(0), np.zeros((0, 9)), none)


def shift(x, before, movers, *contact):
    shift_both(x, before, before.copy(), movers, *contact)


def momenta(x, before, w):
    moved = (x - before) / w[:, None]
    return np.concatenate([moved.sum(axis=0), np.cross(before, moved).sum(axis=0)])


@pytest.mark.parametrize("kind", WEIGHTS)
@pytest.mark.parametrize("change", [apply_impulse, shift])
def test_impulses_and_shifts_keep_both_momenta(motion, kind, change):
    x, before, w = motion
    start, wanted, untouched = x.copy(), momenta(x, before, w), x[2].copy()
    change(x, before, free(w), VERTICES, WEIGHTS[kind], 0, (0.03, -0.02, 0.05))
    assert np.abs(momenta(x, before, w) - wanted).max() < 1e-13
    assert np.abs(x - start).max() > 1e-2
    assert (x[2] == untouched).all()


def test_an_impulse_along_the_contact_needs_no_couple(motion):
    x, before, w = motion
    weights = WEIGHTS["point and triangle"]
    r = np.array(relative(before, free(w), VERTICES, weights, 0))
    start = x.copy()
    apply_impulse(x, before, free(w), VERTICES, weights, 0, tuple(0.1 * r))
    expected = start.copy()
    expected[VERTICES[0]] += w[VERTICES[0], None] * weights[0][:, None] * 0.1 * r
    assert x == pytest.approx(expected, abs=1e-14)


def test_a_pinned_vertex_stays_and_takes_up_the_moment(motion):
    x, before, w = motion
    w[4] = 0.0
    held, expected = x[4].copy(), x.copy()
    d = np.array([0.03, -0.02, 0.05])
    weights = WEIGHTS["edges"]
    apply_impulse(x, before, free(w), VERTICES, weights, 0, tuple(d))
    expected[VERTICES[0]] += (w[VERTICES[0]] * weights[0])[:, None] * d
    assert (x[4] == held).all()
    assert x == pytest.approx(expected, abs=1e-15)


def test_rates_are_those_of_a_vertex_between_fixed_neighbours():
    """One tet: k of a vertex is (lam + 2 mu) V |b|^2, with 1 / |b| its height above the opposite face."""
    mesh = sp.TetMesh([[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.3]], [[0, 1, 2, 3]])
    soft = sp.StableNeoHookean(youngs=1e5, poisson=0.25, density=1000)
    rates = response_rates(build_system(sp.Scene([sp.Body("tet", mesh, soft)])))
    parameters = soft.per_tet(1)
    modulus = parameters.lam[0] + 2.0 * parameters.mu[0]
    assert rates[1:] == pytest.approx(modulus / (1000 / 4) / np.array([0.1, 0.2, 0.3]) ** 2)
    rigid = sp.EdgesAndVolume(edge_compliance=0.0, volume_compliance=0.0)
    assert np.isinf(response_rates(build_system(sp.Scene([sp.Body("tet", mesh, rigid)])))).all()
    assert (kept_share(0.0), kept_share(1.0), kept_share(np.inf)) == (1.0, 0.5, 0.0)
