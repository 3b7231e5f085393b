"""Values for colors of tets that are inverted or flat, and of what is not known; closed forms: test_stress.py."""

import numpy as np
import pytest

import supple as sp
from supple.model.system import build_system
from supple.results.readings.tet_readings import QUANTITIES, tet_values


def cube_system(material, **parts):
    mesh = sp.shapes.box((1, 1, 1), (2, 2, 2))
    return build_system(sp.Scene([sp.Body("cube", mesh, material)], **parts))


RUBBER = sp.StableNeoHookean(youngs=1e5, poisson=0.3)


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
