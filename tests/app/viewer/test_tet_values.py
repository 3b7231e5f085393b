"""Values for coloring, compared with closed forms, and contact points."""

import numpy as np
import pytest

import supple as sp
from supple.model.diagnostics import measure
from supple.model.state import State
from supple.model.system import build_system
from supple.results.readings.tet_readings import QUANTITIES, tet_values


def cube_system(material, **parts):
    mesh = sp.shapes.box((1, 1, 1), (2, 2, 2))
    return build_system(sp.Scene([sp.Body("cube", mesh, material)], **parts))


RUBBER = sp.StableNeoHookean(youngs=1e5, poisson=0.3)


def test_J_is_the_ratio_of_volumes():
    system = cube_system(RUBBER)
    ratios = tet_values(system.laws, system.rest_positions * [2.0, 1.0, 0.75], "J")
    assert ratios == pytest.approx(np.full(48, 1.5))


def test_von_mises_stress_of_a_small_uniaxial_stretch():
    system = cube_system(RUBBER)
    e, nu = 1e-5, 0.3
    x = system.rest_positions * [1.0 + e, 1.0 - nu * e, 1.0 - nu * e]
    assert tet_values(system.laws, x, "von_mises") == pytest.approx(np.full(48, 1e5 * e), rel=1e-3)
    assert tet_values(system.laws, x, "energy") == pytest.approx(np.full(48, 0.5 * 1e5 * e**2), rel=1e-3)


def test_pressure_has_no_von_mises_stress():
    system = cube_system(RUBBER)
    assert tet_values(system.laws, 0.9 * system.rest_positions, "von_mises") == pytest.approx(np.zeros(48), abs=1e-6)


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("material", [RUBBER, sp.EdgesAndVolume(edge_compliance=1e-3, volume_compliance=1e-6)])
def test_inverted_and_flat_tets_have_values(material, quantity):
    system = cube_system(material)
    for scale in (-1.0, 0.0, 1e-200, 1e200):
        with np.errstate(over="ignore", invalid="ignore"):
            values = tet_values(system.laws, system.rest_positions * [1.0, scale, 1.0], quantity)
        assert values.shape == (48,)
        if quantity != "J" and scale == -1.0:
            assert np.isfinite(values).all()


def test_what_is_not_known_is_not_a_number():
    rigid = cube_system(sp.EdgesAndVolume(volume_compliance=1e-6))
    assert np.isnan(tet_values(rigid.laws, rigid.rest_positions, "von_mises")).all()
    # An energy that is infinite for J <= 0 has no stress there.
    logarithmic = cube_system(sp.NeoHookean(youngs=1e5, poisson=0.3))
    inverted = logarithmic.rest_positions * [1.0, -1.0, 1.0]
    assert np.isnan(tet_values(logarithmic.laws, inverted, "von_mises")).all()


def test_the_energy_of_volumes_is_that_of_the_report():
    system = cube_system(sp.EdgesAndVolume(edge_compliance=0.0, volume_compliance=1e-6))
    x = system.rest_positions * [1.1, 1.0, 1.0]

    total = measure(system, State(0.0, x, np.zeros_like(x))).elastic_energy
    assert tet_values(system.laws, x, "energy") @ system.rest_volumes == pytest.approx(total)
