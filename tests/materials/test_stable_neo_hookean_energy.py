"""Energies from invariants agree with their formulas in principal stretches, also for degenerate and extreme F."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import supple as sp
from supple.numerics.svd3 import rotation_variant_svd

MATERIALS = (sp.StableNeoHookean, sp.NeoHookean, sp.StVenantKirchhoff)
YOUNGS, POISSON = 2e4, 0.4


def from_stretches(material, F):
    """psi by the formula in s, in which nothing cancels near s = 1; and the sum of its terms' sizes."""
    mu, lam = material.lame_parameters()
    s = rotation_variant_svd(F)[1]
    a, b, c = np.moveaxis(s - 1.0, -1, 0)
    volume = a + b + c + (a * b + b * c + c * a) + a * b * c
    shape = 0.5 * (a * a + b * b + c * c) - (a * b + b * c + c * a) - a * b * c
    if isinstance(material, sp.StVenantKirchhoff):
        e = 0.5 * (s - 1.0) * (s + 1.0)
        return mu * (e * e).sum(axis=-1) + 0.5 * lam * e.sum(axis=-1) ** 2
    if isinstance(material, sp.StableNeoHookean):
        return mu * shape + 0.5 * lam * volume**2
    with np.errstate(divide="ignore", invalid="ignore"):
        log_J = np.where(volume > -0.5, np.log1p(volume), np.log(s.prod(axis=-1)))
    return np.where(s[..., 2] > 0.0, mu * (shape + (volume - log_J)) + 0.5 * lam * log_J**2, np.inf)


def rotated(stretches, seed):
    U, _, V = rotation_variant_svd(np.random.default_rng(seed).normal(size=(3, 3)))
    return U * np.asarray(stretches) @ V.T


@pytest.mark.parametrize("kind", MATERIALS)
def test_well_conditioned_states_agree_to_round_off(kind):
    rng = np.random.default_rng(5)
    F = np.eye(3) + rng.uniform(-0.3, 0.3, size=(2000, 3, 3))
    F = F[np.linalg.svd(F)[1][:, 2] > 0.4]
    material = kind(youngs=YOUNGS, poisson=POISSON)
    expected = from_stretches(material, F)
    # Relative to the energy of a strain of one: psi itself is small near its minimum.
    np.testing.assert_allclose(material.energy_density(F), expected, rtol=1e-14, atol=1e-15 * YOUNGS)


@pytest.mark.parametrize("kind", MATERIALS)
@pytest.mark.parametrize("strain", [1e-2, 1e-5, 1e-8, 1e-12])
def test_small_strains_of_a_rotated_body_keep_their_digits(kind, strain):
    material = kind(youngs=YOUNGS, poisson=POISSON)
    F = np.stack([rotated((1 + strain, 1 - 0.3 * strain, 1 - 0.5 * strain), seed) for seed in range(50)])
    expected = from_stretches(material, np.diag([1 + strain, 1 - 0.3 * strain, 1 - 0.5 * strain]))
    # F itself is rounded: by 1e-16 in each stretch.
    np.testing.assert_allclose(material.energy_density(F), expected, rtol=3e-15 / strain + 1e-14)
    assert (material.energy_density(F) >= 0.0).all()


@pytest.mark.parametrize("kind", MATERIALS)
@settings(max_examples=50, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    stretches=st.one_of(
        st.tuples(st.floats(0.3, 2.0), st.floats(0.3, 1.0), st.floats(-1.5, -0.01)),  # inverted
        st.sampled_from([(1.0, 1.0, -1.0), (1.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (2.0, 0.5, 0.0)]),
        st.tuples(st.floats(1.0, 1e6), st.floats(0.5, 1e3), st.floats(1e-3, 1.0)),  # huge
    ),
)
def test_inverted_degenerate_and_huge_states_agree(kind, seed, stretches):
    material = kind(youngs=YOUNGS, poisson=POISSON)
    F = rotated(stretches, seed)
    J = np.prod(stretches)
    size = max(abs(s) for s in stretches)
    if kind is sp.NeoHookean and not 1e-6 * size**3 < J:
        # Rounding may decide on which side of J = 0 a flat state lies: its energy is very large, or infinite.
        assert material.energy_density(F) >= (np.inf if -1e-6 * size**3 > J else 10.0 * YOUNGS)
        return
    mu, lam = material.lame_parameters()
    # det F is known to the round-off of its terms, of size s^3; the energies' other terms are of size s^2 or s^4.
    uncertain = 1e-15 * size**3
    change = (lam * max(abs(J - 1.0), uncertain) + mu) * uncertain
    if kind is sp.NeoHookean:
        change = (mu + lam * max(abs(np.log(J)), 1.0)) * uncertain / J
    if kind is sp.StVenantKirchhoff:
        change = 0.0
    expected = from_stretches(material, F)
    power = 4 if kind is sp.StVenantKirchhoff else 2
    assert material.energy_density(F) == pytest.approx(
        float(expected), rel=1e-13, abs=10.0 * change + 1e-14 * mu * max(size, 1.0) ** power
    )
