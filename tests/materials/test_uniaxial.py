"""Uniaxial tension and compression with free lateral faces, against tables; and states with J <= 0."""

import numpy as np
import pytest
from scipy.optimize import brentq

from supple.materials.elastic import ARAP, FixedCorotated, NeoHookean, StableNeoHookean, StVenantKirchhoff


def uniaxial(material, stretch):
    """P11 and the lateral stretch at which the lateral faces are free."""

    def lateral_stress(b):
        return float(material.first_piola(np.diag([stretch, b, b]))[1, 1])

    b = brentq(lateral_stress, 0.5, 2.0, xtol=1e-14, rtol=1e-14)
    return float(material.first_piola(np.diag([stretch, b, b]))[0, 0]), b


@pytest.mark.parametrize("cls", [StableNeoHookean, NeoHookean, FixedCorotated, StVenantKirchhoff])
@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
def test_small_stretch_has_the_given_modulus(cls, poisson):
    P, b = uniaxial(cls(youngs=1e5, poisson=poisson), 1.0 + 1e-6)
    assert pytest.approx(1e5, rel=1e-5) == P / 1e-6
    assert (1.0 - b) / 1e-6 == pytest.approx(poisson, abs=1e-5)


def test_arap_has_the_modulus_two_mu_and_no_lateral_contraction():
    P, b = uniaxial(ARAP(youngs=1e5, poisson=0.25), 1.5)
    assert pytest.approx(2 * 4e4 * 0.5) == P
    assert b == pytest.approx(1.0)


def test_neo_hookean_energy_is_infinite_for_J_not_above_zero():
    material = NeoHookean(youngs=1e5, poisson=0.4)
    F = np.array([np.diag([1.0, 1.0, -1e-9]), np.diag([1.0, 1.0, 0.0]), -np.eye(3), np.eye(3)])
    energy = material.energy_density(F)
    assert np.isposinf(energy[:3]).all()
    assert energy[3] == 0.0
    assert np.isnan(material.first_piola(F[:3])).all(axis=(1, 2)).all()


def test_neo_hookean_near_collapse():
    material = NeoHookean(youngs=1e5, poisson=0.4)
    mu, lam = material.lame_parameters()
    for J in (1e-3, 1e-9, 1e-15):
        expected = mu / 2 * (J * J - 1) - mu * np.log(J) + lam / 2 * np.log(J) ** 2
        assert material.energy_density(np.diag([1.0, 1.0, J])) == pytest.approx(expected, rel=1e-13)


def test_stable_neo_hookean_pushes_a_flat_and_an_inverted_element_back():
    material = StableNeoHookean(youngs=1e5, poisson=0.4)
    for s in (0.0, -0.5, -1.0):
        assert material.first_piola(np.diag([1.0, 1.0, s]))[2, 2] < 0.0
    # A point: every direction is alike, so the stress is zero, but the Hessian projects to something finite.
    assert np.isfinite(material.hessian(np.zeros((3, 3)), project=True)).all()


@pytest.mark.parametrize("cls", [ARAP, FixedCorotated])
def test_kink_where_stretches_cancel_is_finite(cls):
    material = cls(youngs=1e5, poisson=0.4)
    for F in (np.diag([1.0, 1.0, -1.0]), np.zeros((3, 3)), np.diag([1.0, 0.0, 0.0])):
        assert np.isfinite(material.hessian(F)).all()
        projected = material.hessian(F, project=True)
        assert np.linalg.eigvalsh(projected).min() > -1e-9 * 1e5
