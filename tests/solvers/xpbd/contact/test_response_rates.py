"""The share of a force of contact that is kept."""

import numpy as np
import pytest

import supple as sp
from supple.model.system import build_system
from supple.solvers.xpbd.response_rates import response_rates


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
