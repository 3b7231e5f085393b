"""The energy of a stable Neo-Hookean body from invariants equals that from principal stretches."""

import numpy as np

import supple as sp


def test_total_energy_is_the_sum_of_energy_densities() -> None:
    generator = np.random.default_rng(5)
    F = np.eye(3) + generator.normal(scale=0.6, size=(200, 3, 3))
    volumes = generator.uniform(0.1, 2.0, size=200)
    youngs = generator.uniform(1e3, 1e6, size=200)
    for material in (
        sp.StableNeoHookean(youngs=2e4, poisson=0.45),
        sp.StableNeoHookean(youngs=youngs, poisson=0.3),
    ):
        expected = material.energy_density(F) @ volumes
        np.testing.assert_allclose(material.total_energy(F, np.linalg.det(F), volumes), expected, rtol=1e-12)
