"""Guccione's material: closed forms along and across fibres, finite differences, and its projection."""

import numpy as np
import pytest

import supple as sp

C, BF, BT, BFS, BULK = 2e3, 8.0, 2.0, 4.0, 1e6


def muscle(directions=((1.0, 0.0, 0.0),), **changes):
    given = {"c": C, "bf": BF, "bt": BT, "bfs": BFS, "bulk": BULK} | changes
    return sp.Guccione(directions=directions, **given)


def energy(F, axes):
    """As the paper writes it, in axes f, s, n (3, 3)."""
    E = axes @ (F.T @ F - np.eye(3)) @ axes.T / 2
    Q = BF * E[0, 0] ** 2 + BT * (E[1, 1] ** 2 + E[2, 2] ** 2 + 2 * E[1, 2] ** 2) + 2 * BFS * (E[0, 1:] ** 2).sum()
    return C / 2 * np.expm1(Q) + BULK / 2 * (np.linalg.det(F) - 1) ** 2


def test_the_energy_is_that_of_the_paper_for_any_direction():
    rng = np.random.default_rng(1)
    for _ in range(5):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        F = np.eye(3) + 0.15 * rng.normal(size=(3, 3))
        assert muscle(axes[:1]).energy_density(F) == pytest.approx(energy(F, axes), rel=1e-12)
    assert muscle().energy_density(np.eye(3)) == 0.0
    assert muscle().energy_density(np.diag([1, 1, -1.0])) == np.inf


def test_derivatives_have_slope_two_and_the_projection_is_positive():
    rng = np.random.default_rng(2)
    material = muscle(rng.normal(size=(1, 3)))
    for _ in range(5):
        F, dF = np.eye(3) + 0.1 * rng.normal(size=(3, 3)), rng.normal(size=(3, 3))
        P, H = material.first_piola(F), material.hessian(F)
        np.testing.assert_allclose(H, H.T, rtol=1e-12, atol=1e-9 * np.abs(H).max())
        values, stresses = [], []
        for h in (2e-3, 1e-3):
            plus, minus = F + h * dF, F - h * dF
            slope = (material.energy_density(plus) - material.energy_density(minus)) / (2 * h)
            values.append(abs(slope - (P * dF).sum()))
            change = (material.first_piola(plus) - material.first_piola(minus)).ravel() / (2 * h)
            stresses.append(np.abs(change - H @ dF.ravel()).max())
        assert np.log2(values[0] / values[1]) == pytest.approx(2.0, abs=0.1)
        assert np.log2(stresses[0] / stresses[1]) == pytest.approx(2.0, abs=0.1)
        assert np.linalg.eigvalsh(material.hessian(F, project=True)).min() > -1e-10 * np.abs(H).max()


def test_wrong_directions_are_refused():
    with pytest.raises(sp.SceneError, match="a direction is zero"):
        muscle([[0.0, 0.0, 0.0]])
    with pytest.raises(sp.SceneError, match="directions has 2 rows for 6 tets"):
        sp.Body("muscle", sp.shapes.box((1, 1, 1), (1, 1, 1)), muscle([[1, 0, 0], [0, 1, 0]]))
