"""Primal-dual steps of friction: their matrices between the majorizer and the Hessian, and their duals."""

import numpy as np
import pytest

from supple.contact.barrier.friction_energy import (
    Slips,
    add_friction_gradient,
    friction_hessian,
    friction_ratio,
    renew_duals,
)
from supple.contact.features.pair_geometry import EDGE_EDGE, VERTEX_EDGE, VERTEX_TRIANGLE, VERTEX_VERTEX, point_count

REACH = 1e-3
COUNT = 40


def contacts(seed: int, slip: float) -> tuple[np.ndarray, Slips, np.ndarray]:
    """Points, contacts of all kinds with slips of about `slip` times the reach, and these slips (k, 3)."""
    rng = np.random.default_rng(seed)
    kinds = rng.choice([VERTEX_VERTEX, VERTEX_EDGE, VERTEX_TRIANGLE, EDGE_EDGE], COUNT).astype(np.int8)
    x = rng.normal(size=(4 * COUNT, 3))
    points = np.arange(4 * COUNT, dtype=np.int32).reshape(-1, 4)
    c = rng.uniform(0.2, 1.0, (COUNT, 4))
    for k, kind in enumerate(kinds):
        count, first = point_count(kind), 2 if kind == EDGE_EDGE else 1
        c[k, count:] = 0.0
        c[k, :first] /= c[k, :first].sum()
        c[k, first:count] /= -c[k, first:count].sum()
    normals = rng.normal(size=(COUNT, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    slips = slip * REACH * rng.normal(size=(COUNT, 3))
    slips -= np.einsum("ki,ki->k", slips, normals)[:, None] * normals
    offsets = np.einsum("ki,kij->kj", c, x[points]) - slips + REACH * rng.normal(size=(COUNT, 1)) * normals
    return x, Slips(kinds, points, c, normals, offsets, rng.uniform(0.1, 2.0, COUNT)), slips


def matrices(x: np.ndarray, slips: Slips, duals: np.ndarray) -> np.ndarray:
    """(k, 12, 12) of the contacts, which have no point in common."""
    out = np.zeros((COUNT, 4, 3, 4, 3))
    found = friction_hessian(x, slips, REACH, duals)
    for i, j, block in zip(found.rows, found.columns, found.blocks, strict=True):
        out[i // 4, i % 4, :, j % 4] = block
        out[i // 4, j % 4, :, i % 4] = block.T
    return out.reshape(COUNT, 12, 12)


def gradient(x: np.ndarray, slips: Slips) -> np.ndarray:
    out = np.zeros_like(x)
    add_friction_gradient(x, slips, REACH, out)
    return out


def duals_in_planes(seed: int, slips: Slips, length: float) -> np.ndarray:
    w = np.random.default_rng(seed).normal(size=(COUNT, 3))
    w -= np.einsum("ki,ki->k", w, slips.normals)[:, None] * slips.normals
    return length * w / np.linalg.norm(w, axis=1)[:, None]


@pytest.mark.parametrize("slip", [0.3, 3.0, 1e4])
def test_duals_of_the_force_itself_give_the_hessian(slip: float):
    x, slips, u = contacts(1, slip)
    duals = duals_in_planes(2, slips, 0.5)
    renew_duals(x, np.zeros_like(x), slips, REACH, duals)
    y = np.linalg.norm(u, axis=1)
    ratios = np.array([friction_ratio(value, REACH) for value in y])
    assert duals == pytest.approx(ratios[:, None] * u, abs=1e-7)
    exact = matrices(x, slips, duals)
    d = np.random.default_rng(3).normal(size=x.shape)
    t = 1e-6 * slip * REACH
    differences = (gradient(x + t * d, slips) - gradient(x - t * d, slips)).reshape(COUNT, 12) / (2 * t)
    predicted = np.einsum("kij,kj->ki", exact, d.reshape(COUNT, 12))
    assert differences == pytest.approx(predicted, abs=2e-4 * np.abs(predicted).max())


@pytest.mark.parametrize("slip", [1e-6, 0.3, 3.0, 1e4])
@pytest.mark.parametrize("length", [0.0, 0.5, 1.0])
def test_matrices_are_positive_semi_definite_for_duals_up_to_one(slip: float, length: float):
    x, slips, _ = contacts(4, slip)
    values = np.linalg.eigvalsh(matrices(x, slips, duals_in_planes(5, slips, length)))
    assert (values.min(axis=1) > -1e-12 * values.max(axis=1)).all()


@pytest.mark.parametrize("slip", [0.3, 3.0, 1e4])
def test_new_duals_are_the_forces_that_the_matrix_predicts_and_not_longer_than_one(slip: float):
    x, slips, _ = contacts(6, slip)
    duals = duals_in_planes(7, slips, 0.4)
    # Short enough that no dual is cut: a part of the way to where nothing slips.
    way = 0.7 * np.random.default_rng(8).normal(size=x.shape) * slip * REACH
    force = gradient(x, slips).reshape(COUNT, 12)
    predicted = force + np.einsum("kij,kj->ki", matrices(x, slips, duals), way.reshape(COUNT, 12))
    renewed = duals.copy()
    renew_duals(x, way, slips, REACH, renewed)
    expected = (slips.forces[:, None, None] * slips.coefficients[:, :, None] * renewed[:, None, :]).reshape(COUNT, 12)
    lengths = np.linalg.norm(renewed, axis=1)
    whole = lengths < 1.0 - 1e-12
    assert whole.any()
    assert (lengths < 1.0 + 1e-12).all()
    assert predicted[whole] == pytest.approx(expected[whole], abs=1e-7 * np.abs(predicted).max())
    # The others point where the prediction points.
    cut = ~whole
    across = np.cross(predicted.reshape(COUNT, 4, 3)[cut, 0], renewed[cut])
    assert np.abs(across).max(initial=0.0) < 1e-7 * np.abs(predicted).max()
