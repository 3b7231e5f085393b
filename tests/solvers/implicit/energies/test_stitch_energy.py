"""The energy of stitches against an independent dense evaluation, and its derivatives against differences."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from tests.derivatives import assert_derivatives, gradient_of

import supple as sp
from supple.scene.stitches.elements import Pairs, Springs
from supple.scene.stitches.side import Side
from supple.scene.stitches.stitching import no_stitching
from supple.scene.stitches.vertex_triangle import SoftVertexTriangleStitch
from supple.solvers.implicit.energies.potential import HessianBlocks
from supple.solvers.implicit.energies.stitches import StitchEnergy

D, MU, LAM = 0.05, 3e3, 8e3
TRIANGLE = np.array([[0.1, 0.2, -0.3], [1.3, 0.1, 0.2], [0.3, 1.1, 0.4]])


def side(points, triangles=()):
    triangles = np.array(triangles, dtype=np.int32).reshape(-1, 3)
    points = np.asarray(points, dtype=float)
    edges = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0).astype(np.int32)
    return Side("side", points, triangles, edges, np.arange(len(points), dtype=np.int32))


def vertex_over_triangle(s, permutation=(0, 1, 2)):
    """The vertex at the signed distance s above a point inside the triangle; (4, 3) points, the vertex first."""
    corners = TRIANGLE[list(permutation)]
    n = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    n /= np.linalg.norm(n)
    return np.concatenate([[[0.2, 0.3, 0.5] @ TRIANGLE + s * n], corners])


def stitching_of(points, d=D):
    """One soft stitch of the first point to the triangle of the other three."""
    stitch = SoftVertexTriangleStitch("a", "b", pairs=[[0, 0]], mu=MU, lam=LAM, min_separate_distance=d)
    first, second = side(points[:1]), side(points[1:], [[0, 1, 2]])
    numbers = np.zeros(1, dtype=np.int32), np.arange(1, 4, dtype=np.int32)
    return replace(no_stitching(4), tets=stitch.join(first, second, stitch.find(first, second)).numbered(*numbers))


def dense_rest(points, d=D):
    """The rest shape, written down independently: points (4, 3) and the order of the corners."""
    x0, x1, x2, x3 = points
    n = np.cross(x2 - x1, x3 - x1) / np.linalg.norm(np.cross(x2 - x1, x3 - x1))
    s = float(n @ (x0 - x1))
    if abs(s) < d:
        x0 = x0 + ((1.0 if s >= -1e-15 else -1.0) * d - s) * n
    Dm = np.array([x1 - x0, x2 - x0, x3 - x0]).T
    return Dm, abs(np.linalg.det(Dm)) / 6.0


def dense_model(points, Dm, volume):
    """Energy (from rest), gradient (12,), Hessian and projected Hessian (12, 12) by 9x9 matrices."""
    B = np.linalg.inv(Dm)
    Ds = np.array([points[k] - points[0] for k in (1, 2, 3)]).T
    F = Ds @ B
    J, c = np.linalg.det(F), np.zeros((3, 3))
    for i in range(3):
        c[:, i] = np.cross(F[:, (i + 1) % 3], F[:, (i + 2) % 3])  # dJ/dF
    psi = 0.5 * MU * ((F * F).sum() - 3) - MU * (J - 1) + 0.5 * LAM * (J - 1) ** 2
    pressure = LAM * (J - 1) - MU
    P = MU * F + pressure * c
    eps = np.zeros((3, 3, 3))
    for i, j, k in itertools.permutations(range(3)):
        eps[i, j, k] = np.linalg.det(np.eye(3)[[i, j, k]])
    dc = np.einsum("ikm,jln,mn->ijkl", eps, eps, F)  # d^2 J / dF_ij dF_kl
    H = MU * np.eye(9) + LAM * np.outer(c.ravel(), c.ravel()) + pressure * dc.reshape(9, 9)
    w, Q = np.linalg.eigh(H)
    projected = (Q * np.maximum(w, 0)) @ Q.T
    # F_ij = sum_k (x_k - x_0)_i B_kj
    dF = np.zeros((9, 12))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                dF[3 * i + j, 3 * (k + 1) + i] += B[k, j]
                dF[3 * i + j, i] -= B[k, j]
    return volume * psi, volume * dF.T @ P.ravel(), volume * dF.T @ H @ dF, volume * dF.T @ projected @ dF


def hessian_of(energy, x, project):
    stitching = energy.stitching
    blocks = HessianBlocks.zeros(0, len(x), len(stitching))
    energy.add_hessian(x, blocks, project)
    assert not blocks.vertices.any()
    out = np.zeros((len(x), 3, len(x), 3))
    for block, nodes in zip(blocks.stitches, stitching.elements(), strict=True):
        for p, q in itertools.product(range(4), repeat=2):
            if nodes[p] >= 0 and nodes[q] >= 0:
                out[nodes[p], :, nodes[q], :] += block.reshape(4, 3, 4, 3)[p, :, q, :]
    return out.reshape(3 * len(x), -1)


def assert_slope_two_along(energy, x):
    d = np.random.default_rng(1).normal(size=x.shape)
    d *= 0.02 / np.abs(d).max()
    assert_derivatives(energy, hessian_of(energy, x, False) @ d.ravel(), x, d, 1.0)


def assert_close(found, wanted):
    assert np.abs(found - wanted).max() <= 1e-10 * max(1.0, np.abs(wanted).max())


@pytest.mark.parametrize("permutation", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("multiple", [0.0, 0.5, -0.5, 1.0, -1.0, 2.0, -2.0])
def test_tets_agree_with_dense_numpy(multiple, permutation):
    rest = vertex_over_triangle(multiple * D, permutation)
    stitching = stitching_of(rest)
    energy = StitchEnergy.of(stitching, 0.0)
    Dm, volume = dense_rest(rest)
    assert stitching.tets.rest_volumes[0] == pytest.approx(volume, rel=1e-12)
    assert bool(stitching.tets.offset[0]) == (abs(multiple) < 1.0)
    assert np.linalg.det(stitching.tets.rest_shape_inverse[0]) > 0.0
    rng = np.random.default_rng(3)
    moved = rest + 0.3 * D * rng.normal(size=(4, 3))
    inverted = rest.copy()
    inverted[0] += 4 * D * np.cross(rest[2] - rest[1], rest[3] - rest[1]) * (-1.0 if multiple >= 0 else 1.0)
    for x in (rest, moved, inverted):
        value, gradient, hessian, projected = dense_model(x, Dm, volume)
        assert_close(energy.value(x), value)
        assert_close(gradient_of(energy, x).ravel(), gradient)
        assert_close(hessian_of(energy, x, False), hessian)
        assert_close(hessian_of(energy, x, True), projected)


@pytest.mark.parametrize("multiple", [0.0, 0.5, -1.0, 2.0])
def test_the_published_density_has_its_constant_and_the_energy_is_measured_from_rest(multiple):
    rest = vertex_over_triangle(multiple * D)
    tets = stitching_of(rest).tets
    stitch = SoftVertexTriangleStitch("a", "b", pairs=[[0, 0]], mu=MU, lam=LAM)
    assert stitch.energy_density(np.eye(3)) == pytest.approx((MU / LAM) ** 2, rel=1e-12)
    x = rest + 0.01 * np.random.default_rng(0).normal(size=(4, 3))
    corners = x[tets.vertices[0]]
    F = (corners[1:] - corners[0]).T @ tets.rest_shape_inverse[0]
    published = stitch.energy_density(F)[()] * tets.rest_volumes[0]
    measured = StitchEnergy.of(stitching_of(rest), 0.0).value(x)
    assert published - (MU / LAM) ** 2 * tets.rest_volumes[0] == pytest.approx(measured, rel=1e-10)


def springs_of(rest_lengths):
    """A spring to a vertex, one to a point of an edge, one to an edge's end."""
    vertices = np.array([[0, 1, 1], [0, 1, 2], [3, 2, 1]], dtype=np.int32)
    place = np.array([0.0, 0.3, 1.0])
    springs = Springs(vertices, place, np.array([50.0, 80.0, 20.0]), np.asarray(rest_lengths, float), np.zeros(3))
    return replace(no_stitching(4), springs=springs)


def dense_spring_energy(springs, x):
    total = 0.0
    for (v, a, b), t, k, rest in zip(
        springs.vertices, springs.place, springs.stiffness, springs.rest_lengths, strict=True
    ):
        total += 0.5 * k * (np.linalg.norm(x[v] - ((1 - t) * x[a] + t * x[b])) - rest) ** 2
    return total


@pytest.mark.parametrize("rest_lengths", [(0.0, 0.0, 0.0), (0.4, 0.2, 3.0)])
def test_springs_have_their_energy_and_slope_two(rest_lengths):
    stitching = springs_of(rest_lengths)
    energy = StitchEnergy.of(stitching, 0.0)
    x = vertex_over_triangle(0.4)
    assert energy.value(x) == pytest.approx(dense_spring_energy(stitching.springs, x), rel=1e-12)
    assert_slope_two_along(energy, x)
    projected = hessian_of(energy, x, True)
    assert np.linalg.eigvalsh(projected).min() >= -1e-9 * np.abs(projected).max()


@pytest.mark.parametrize("multiple", [0.0, 0.5, -0.5, 1.0, -1.0, 2.0, -2.0])
def test_tets_have_slope_two(multiple):
    rest = vertex_over_triangle(multiple * D)
    assert_slope_two_along(
        StitchEnergy.of(stitching_of(rest), 0.0), rest + 0.01 * np.random.default_rng(5).normal(size=(4, 3))
    )


def test_a_spring_of_zero_length_has_no_force():
    stitching = springs_of((0.4, 0.2, 0.1))
    x = np.zeros((4, 3))
    energy = StitchEnergy.of(stitching, 0.0)
    assert not gradient_of(energy, x).any()
    assert np.isfinite(hessian_of(energy, x, True)).all()


def test_pairs_may_be_given():
    pairs = Pairs(np.array([0], np.int32), np.array([0], np.int32), np.array([0.1]))
    stitch = sp.SoftVertexTriangleStitch("a", "b", pairs=[[0, 0]], youngs=1e5, poisson=0.25)
    tets = stitch.join(side([[0.2, 0.1, 0.2]]), side([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]]), pairs)
    assert tets.mu[0] == pytest.approx(4e4)
    assert tets.lam[0] == pytest.approx(4e4)
