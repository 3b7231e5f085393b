"""Energy, gradient and Hessian of single pairs: against the IPC Toolkit and against differences."""

import ipctk
import numpy as np
import pytest

from supple.contact.barrier.barrier_energy import (
    add_barrier_gradient,
    barrier_energy,
    barrier_forces,
    barrier_hessian,
    barrier_slopes,
    barrier_value,
)
from supple.contact.features.contacts import Contacts
from supple.contact.features.pair_geometry import EDGE_EDGE, VERTEX_EDGE, VERTEX_TRIANGLE, VERTEX_VERTEX

COUNT = 2500  # pairs of each kind
STIFFNESS = 3.0
KINDS = {
    "vertex-vertex": VERTEX_VERTEX,
    "vertex-edge": VERTEX_EDGE,
    "vertex-triangle": VERTEX_TRIANGLE,
    "edge-edge": EDGE_EDGE,
}
LIBRARY = {
    VERTEX_VERTEX: ipctk.VertexVertexNormalCollision(0, 1),
    VERTEX_EDGE: ipctk.EdgeVertexNormalCollision(0, 0),
    VERTEX_TRIANGLE: ipctk.FaceVertexNormalCollision(0, 0),
    EDGE_EDGE: ipctk.EdgeEdgeNormalCollision(0, 1, 0.0),
}


def unit(rng, shape):
    v = rng.normal(size=(*shape, 3))
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def pairs_of(kind, count, seed):
    """Pairs whose closest points are known: distances from 1e-9 to 1e3 m, slivers, almost parallel edges, ends.

    Returns positions (count, 4, 3), coefficients (count, 4), distances (count,).
    """
    rng = np.random.default_rng(seed)
    d = 10.0 ** rng.uniform(-9, 3, count)
    size = d * 10.0 ** rng.uniform(-0.5, 3, count)
    n = unit(rng, (count,))
    q = np.cross(n, unit(rng, (count,)))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    p = np.cross(n, q)
    x = np.zeros((count, 4, 3))
    c = np.zeros((count, 4))
    t, thin = rng.uniform(0, 1, count), 10.0 ** rng.uniform(-2, 0, count)
    if kind == VERTEX_VERTEX:
        c[:, :2] = 1.0, -1.0
    elif kind == VERTEX_EDGE:
        x[:, 1], x[:, 2] = -t[:, None] * q, (1 - t)[:, None] * q
        c[:, 0], c[:, 1], c[:, 2] = 1.0, t - 1, -t
    elif kind == VERTEX_TRIANGLE:
        u = rng.dirichlet([0.5, 0.5, 0.5], count)
        corners = (
            q[:, None] * rng.normal(size=(count, 3, 1))
            + (thin[:, None] * rng.normal(size=(count, 3)))[:, :, None] * p[:, None]
        )
        x[:, 1:] = corners - np.einsum("ki,kij->kj", u, corners)[:, None]
        c[:, 0], c[:, 1:] = 1.0, -u
    else:
        s = rng.uniform(0, 1, count)
        other = np.cos(thin)[:, None] * q + np.sin(thin)[:, None] * p
        x[:, 0], x[:, 1] = -s[:, None] * q, (1 - s)[:, None] * q
        x[:, 2], x[:, 3] = -t[:, None] * other, (1 - t)[:, None] * other
        c[:, 0], c[:, 1], c[:, 2], c[:, 3] = 1 - s, s, t - 1, -t
    x *= size[:, None, None]
    sides = 2 if kind == EDGE_EDGE else 1
    x[:, :sides] += (d[:, None] * n)[:, None]
    return x, c, d


def as_contacts(kind, x, c, offset=0.0):
    count = len(x)
    points = np.arange(4 * count, dtype=np.int32).reshape(count, 4)
    points[:, min(kind + 2, 4) :] = -1
    vectors = np.einsum("ki,kij->kj", c, x)
    distances = np.linalg.norm(vectors, axis=1)
    kinds = np.full(count, kind, dtype=np.int8)
    return Contacts(kinds, points, c, vectors, distances, np.ones(count), distances - offset)


def single(contacts, k):
    return Contacts(*(array[k : k + 1] for array in contacts))


def dense(couplings, count):
    """(count, 12, 12) of couplings that each stay within four points."""
    out = np.zeros((count, 12, 12))
    for row, column, block in zip(couplings.rows, couplings.columns, couplings.blocks, strict=True):
        k, i, j = row // 4, row % 4, column % 4
        out[k, 3 * i : 3 * i + 3, 3 * j : 3 * j + 3] += block
        if i != j:
            out[k, 3 * j : 3 * j + 3, 3 * i : 3 * i + 3] += block.T
    return out


def evaluated(kind, x, c, dhat, project):
    """Energies, gradients (k, 4, 3) and Hessians (k, 12, 12) of pairs with one dhat each."""
    contacts = as_contacts(kind, x, c)
    flat = x.reshape(-1, 3)
    energies, gradients, hessians = np.zeros(len(x)), np.zeros_like(flat), np.zeros((len(x), 12, 12))
    for k in range(len(x)):
        one = single(contacts, k)
        energies[k] = barrier_energy(one, dhat[k], STIFFNESS)
        add_barrier_gradient(one, dhat[k], STIFFNESS, gradients)
        local = one._replace(points=one.points - 4 * k * (one.points >= 0).astype(np.int32))
        hessians[k] = dense(barrier_hessian(x[k], local, dhat[k], STIFFNESS, project), 1)[0]
    return energies, gradients.reshape(-1, 4, 3), hessians


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_pairs_have_the_librarys_energy_gradient_and_hessian(kind):
    x, c, d = pairs_of(kind, COUNT, 11 + kind)
    rng = np.random.default_rng(5)
    dhat = d * rng.uniform(1.01, 30.0, COUNT)
    size = 3 * min(kind + 2, 4)
    energies, gradients, hessians = evaluated(kind, x, c, dhat, False)
    # The library's formulas of squared distances lose digits where primitives are large for their distance.
    worst = 0.0
    for k in range(COUNT):
        potential = ipctk.BarrierPotential(dhat[k], stiffness=STIFFNESS, use_physical_barrier=True)
        flat = x[k].ravel()[:size]
        value = potential(LIBRARY[kind], flat)
        gradient = potential.gradient(LIBRARY[kind], flat)
        hessian = potential.hessian(LIBRARY[kind], flat)
        lost = 1e-13 * (np.ptp(x[k], axis=0).max() / d[k]) ** 2 + 1e-9
        if kind >= VERTEX_TRIANGLE:
            first, second = (
                (x[k, 2] - x[k, 1], x[k, 3] - x[k, 1])
                if kind == VERTEX_TRIANGLE
                else (x[k, 1] - x[k, 0], x[k, 3] - x[k, 2])
            )
            area = np.linalg.norm(np.cross(first, second)) / (np.linalg.norm(first) * np.linalg.norm(second))
            lost /= area**2
        worst = max(worst, abs(energies[k] - value) / (abs(value) + 1e-9 * STIFFNESS * dhat[k]) / lost)
        worst = max(worst, np.abs(gradients[k].ravel()[:size] - gradient).max() / np.abs(gradient).max() / lost)
        worst = max(worst, np.abs(hessians[k][:size, :size] - hessian).max() / np.abs(hessian).max() / lost)
    assert worst < 1.0


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_the_projected_hessian_is_positive_and_above_the_exact_one(kind):
    """Also not much larger than the nearest positive semi-definite matrix."""
    x, c, d = pairs_of(kind, 500, 21 + kind)
    dhat = d * np.random.default_rng(6).uniform(1.01, 30.0, len(d))
    exact, projected = (evaluated(kind, x, c, dhat, project)[2] for project in (False, True))
    values, vectors = np.linalg.eigh(exact)
    clamped = np.einsum("kij,kj,klj->kil", vectors, np.maximum(values, 0.0), vectors)
    size = values[:, -1]
    assert np.abs(exact - exact.transpose(0, 2, 1)).max(axis=(1, 2)).max() == 0.0
    assert (np.linalg.eigvalsh(projected)[:, 0] > -1e-12 * size).all()
    assert (np.linalg.eigvalsh(projected - exact)[:, 0] > -1e-9 * size).all()
    assert (np.linalg.norm(projected - clamped, axis=(1, 2)) < 0.3 * size).all()
    assert np.median(np.linalg.norm(projected - clamped, axis=(1, 2)) / size) < 0.02


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_the_projected_hessian_of_an_attraction_is_positive_and_above_the_exact_one(kind):
    """Terms of alternating sums have negative weights."""
    x, c, d = pairs_of(kind, 100, 51 + kind)
    for k in range(len(d)):
        one = as_contacts(kind, x[k : k + 1], c[k : k + 1])
        exact, projected = (
            dense(barrier_hessian(x[k], one, 3.0 * d[k], -STIFFNESS, project), 1)[0] for project in (False, True)
        )
        size = np.abs(exact).max()
        assert np.linalg.eigvalsh(projected)[0] > -1e-9 * size
        assert np.linalg.eigvalsh(projected - exact)[0] > -1e-9 * size


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_pairs_keep_both_momenta(kind):
    x, c, d = pairs_of(kind, 200, 31 + kind)
    dhat = 2.0 * d
    _, gradients, hessians = evaluated(kind, x, c, dhat, False)
    size = np.linalg.norm(gradients, axis=2).max(axis=1)
    assert (np.linalg.norm(gradients.sum(axis=1), axis=1) < 1e-12 * size).all()
    moments = np.linalg.norm(np.cross(x, gradients).sum(axis=1), axis=1)
    assert (moments < 1e-12 * size * np.abs(x).max(axis=(1, 2))).all()
    shifts = np.tile(np.eye(3), (4, 1))
    assert (np.abs(hessians @ shifts).max(axis=(1, 2)) < 1e-12 * np.abs(hessians).max(axis=(1, 2))).all()


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_derivatives_with_offsets_have_order_two(kind):
    """The energy is that of the distance less the offset; directions are those of the distance."""
    x, _, d = pairs_of(kind, 40, 61 + kind)
    size = min(kind + 2, 4)
    rng = np.random.default_rng(8)
    for k in range(len(d)):
        x[k] /= d[k]  # a distance of 1
        offset, way = rng.uniform(0.3, 0.95), np.zeros((4, 3))
        dhat = (1.0 - offset) * rng.uniform(1.2, 3.0)
        way[:size] = rng.normal(size=(size, 3))

        def at(h, k=k, way=way, offset=offset):
            return as_contacts(kind, x[k : k + 1] + h * way, closest(kind, x[k] + h * way)[None], offset)

        def gradient(h, at=at, dhat=dhat):
            out = np.zeros((4, 3))
            add_barrier_gradient(at(h), dhat, STIFFNESS, out)
            return out

        exact = dense(barrier_hessian(x[k], at(0.0), dhat, STIFFNESS, False), 1)[0] @ way.ravel()
        slope = (gradient(0.0) * way).sum()
        steps = (1.0 - offset) * 0.002 / np.linalg.norm(way) * 2.0 ** -np.arange(4)
        first = [
            abs((barrier_energy(at(h), dhat, STIFFNESS) - barrier_energy(at(-h), dhat, STIFFNESS)) / (2 * h) - slope)
            for h in steps
        ]
        second = [np.abs((gradient(h) - gradient(-h)).ravel() / (2 * h) - exact).max() for h in steps]
        for errors, scale in ((first, abs(slope)), (second, np.abs(exact).max())):
            if errors[-1] > 1e-6 * scale:
                assert 1.7 < np.log2(errors[-2] / errors[-1]) < 2.3
        assert second[-1] < 0.02 * np.abs(exact).max()


def closest(kind, x):
    """(4,) the coefficients of the closest points of lines and planes through x (4, 3)."""
    basis = {
        VERTEX_VERTEX: [],
        VERTEX_EDGE: [[0, 1, -1, 0]],
        VERTEX_TRIANGLE: [[0, 1, -1, 0], [0, 1, 0, -1]],
        EDGE_EDGE: [[-1, 1, 0, 0], [0, 0, 1, -1]],
    }[kind]
    c = np.array([1.0, 0.0, -1.0, 0.0] if kind == EDGE_EDGE else [1.0, -1.0, 0.0, 0.0])
    if basis:
        D = np.array(basis, dtype=np.float64)
        c = c + np.linalg.lstsq((D @ x).T, -(c @ x), rcond=None)[0] @ D
    return c


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_the_force_is_that_of_the_gradient(kind):
    x, c, d = pairs_of(kind, 50, 41 + kind)
    contacts = as_contacts(kind, x, c)
    for k in range(len(x)):
        one = single(contacts, k)
        out = np.zeros((4 * len(x), 3))
        add_barrier_gradient(one, 3.0 * d[k], STIFFNESS, out)
        sides = slice(4 * k, 4 * k + (2 if kind == EDGE_EDGE else 1))
        force = barrier_forces(one, 3.0 * d[k], STIFFNESS)[0]
        assert np.linalg.norm(out[sides].sum(axis=0)) == pytest.approx(force, rel=1e-9)


@pytest.mark.parametrize("share", [1e-6, 1e-3, 0.1, 0.5, 0.99])
@pytest.mark.parametrize("dhat", [1e-9, 1e-4, 1e3])
def test_the_barrier_has_slope_two(dhat, share):
    d = share * dhat
    first, second = barrier_slopes(d, dhat)
    steps = min(d, dhat - d) * 1e-2 * 2.0 ** -np.arange(5)
    for exact, function in ((first, barrier_value), (second, lambda y, dhat: barrier_slopes(y, dhat)[0])):
        errors = [abs((function(d + h, dhat) - function(d - h, dhat)) / (2 * h) - exact) for h in steps]
        assert 1.85 < np.polyfit(np.log(steps), np.log(errors), 1)[0] < 2.15
    assert first < 0.0 < second


def test_the_barrier_is_smooth_where_it_ends():
    assert barrier_value(1.0, 1.0) == barrier_value(2.0, 1.0) == 0.0
    assert barrier_value(1.0 - 1e-5, 1.0) < 1e-13
    assert abs(barrier_slopes(1.0 - 1e-5, 1.0)[0]) < 1e-8
    assert abs(barrier_slopes(1.0 - 1e-5, 1.0)[1]) < 1e-3
