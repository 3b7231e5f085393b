"""Barriers and friction: gradients and Hessians against differences, slope 2, in metres and in millimetres."""

import ipctk
import numpy as np
import pytest
from tests.derivatives import assert_derivatives, dense_couplings, gradient_of

import supple as sp
from supple.contact.barrier.barrier_energy import barrier_slopes, barrier_value
from supple.contact.mesh.obstacles import obstacle_positions
from supple.model.system import build_system, initial_state
from supple.numerics.svd3 import rotation_variant_svd
from supple.solvers.implicit.contact.collisions import Barrier
from supple.solvers.implicit.contact.model import contact_model
from supple.solvers.implicit.energies.potential import HessianBlocks

GAP = 2e-3  # of a unit tet, and dhat five times as much
H = 0.01
SLOW = 0.05


def tet(*points):
    return np.array(points, dtype=np.float64)


# Pairs of tets with one nearest pair of primitives, GAP apart along y.
UPPER_TIP = tet((0, 0, 0), (0.3, 1, 0.2), (-0.4, 1, 0.3), (0.1, 1, -0.5))
LOWER_FACE = tet((-1, 0, -0.8), (0.2, 0, 1.1), (1, 0, -0.7), (0.1, -1, 0))
LOWER_TIP = UPPER_TIP * (1, -1, 1)
UPPER_EDGE = tet((-1, 0, 0.1), (1.1, 0, -0.1), (0.2, 1, 0.4), (0, 1, -0.4))


def lower_edge(angle):
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    return (UPPER_EDGE * (1, -1, 1)) @ turn.T


PAIRS = {
    "vertex-face": (UPPER_TIP, LOWER_FACE),
    "vertex-vertex": (UPPER_TIP, LOWER_TIP),
    "edge-edge": (UPPER_EDGE, lower_edge(1.2)),
    "edge-edge, nearly parallel": (UPPER_EDGE, lower_edge(0.02)),
}


def random_turn(rng):
    U, _, V = rotation_variant_svd(rng.normal(size=(3, 3)))
    return U @ V.T


def model_of(bodies, size, obstacles=(), friction=0.3):
    """A contact model of tets at the given places."""
    made = []
    for k, points in enumerate(bodies):
        mesh = sp.TetMesh(points, np.array([[0, 1, 2, 3]]))
        made.append(
            sp.Body(f"tet {k}", mesh, sp.StableNeoHookean(youngs=1e4, poisson=0.3, density=1000.0), friction=friction)
        )
    scene = sp.Scene(made, obstacles=list(obstacles))
    contact = sp.IPCContact(dhat=5 * GAP * size, stiffness=1e4, friction_velocity=SLOW * size)
    model = contact_model(build_system(scene), contact, np.full(len(made), 1e4))
    x = np.concatenate([initial_state(scene).positions, obstacle_positions(model.obstacles, 0.0)])
    return model, x


def near_pair(kind, seed, size):
    rng = np.random.default_rng(seed)
    upper, lower = PAIRS[kind]
    turn = random_turn(rng)
    # Noise far below the gap: no two seeds are alike, the nearest pair stays the nearest.
    bodies = [
        size * (part + 0.1 * GAP * rng.normal(size=(4, 3))) @ turn.T for part in (upper + np.array([0, GAP, 0]), lower)
    ]
    return model_of(bodies, size)


def dense_hessian(potential, x, project=False):
    blocks = HessianBlocks.zeros(0, len(x))
    potential.add_hessian(x, blocks, project)
    dense = dense_couplings(blocks.couplings, len(x))
    for v, block in enumerate(blocks.vertices):
        dense[3 * v : 3 * v + 3, 3 * v : 3 * v + 3] += block
    return dense


@pytest.mark.parametrize("size", [1.0, 1e-3])
@pytest.mark.parametrize("kind", PAIRS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_barrier_has_slope_two(kind, seed, size):
    model, x = near_pair(kind, seed, size)
    barrier = Barrier(model.collisions, 1e4)
    assert barrier.value(x) > 0.0
    # Contacts keep their weights while a minimum is searched; that of nearly parallel edges depends on their angle.
    model.collisions.keep_weights(x)
    d = unit(np.random.default_rng(seed + 100).normal(size=x.shape))
    assert_derivatives(barrier, dense_hessian(barrier, x) @ d.ravel(), x, d, 0.02 * GAP * size, 0.15)


@pytest.mark.parametrize("kind", PAIRS)
def test_the_barriers_projected_hessian_has_no_negative_eigenvalue(kind):
    model, x = near_pair(kind, 4, 1.0)
    barrier = Barrier(model.collisions, 1e4)
    full, projected = dense_hessian(barrier, x), dense_hessian(barrier, x, True)
    assert np.abs(full - full.T).max() < 1e-9 * np.abs(full).max()
    values = np.linalg.eigvalsh(projected)
    assert values.min() > -1e-9 * values.max()
    # The surfaces repel each other: without projection some direction has a negative curvature.
    assert np.linalg.eigvalsh(full).min() < -1e-6 * values.max()


def unit(d):
    """Its longest component is one."""
    return d / np.abs(d).max()


def check_majorizer(friction, x, slips, longest):
    """With duals of zero the matrix is that of a quadratic above the energy.

    Its gradient is zero where nothing slips, at x - slips; ends up to `longest` away are tried.
    """
    majorizer = dense_hessian(friction, x)
    assert np.linalg.eigvalsh(majorizer).min() > -1e-9 * np.abs(majorizer).max()
    energy, gradient = friction.value(x), gradient_of(friction, x)
    assert majorizer @ slips.ravel() == pytest.approx(gradient.ravel(), abs=1e-9 * np.abs(gradient).max())
    rng = np.random.default_rng(11)
    for length in longest * np.array([0.01, 0.1, 1.0]):
        for _ in range(20):
            d = rng.normal(size=x.shape)
            d *= length / np.abs(d).max()
            above = energy + (gradient * d).sum() + 0.5 * d.ravel() @ majorizer @ d.ravel()
            assert friction.value(x + d) <= above + 1e-9 * energy


@pytest.mark.parametrize("size", [1.0, 1e-3])
@pytest.mark.parametrize("kind", ["vertex-face", "edge-edge", "vertex-vertex"])
@pytest.mark.parametrize("speed", [0.4, 0.9, 3.0], ids=["sticking", "nearly sliding", "sliding"])
def test_friction_has_slope_two(kind, size, speed):
    model, lagged = near_pair(kind, 5, size)
    rng = np.random.default_rng(6)
    start = lagged.copy()
    # The first tet slides by `speed` of the velocity below which friction is static.
    across = np.linalg.svd((lagged[:4].mean(axis=0) - lagged[4:8].mean(axis=0))[None])[2][1]
    start[:4] -= speed * SLOW * size * H * across
    start += 1e-2 * SLOW * size * H * rng.normal(size=start.shape)
    (friction,) = model.frictions(Barrier(model.collisions, 1e4), lagged, start, H)
    check_majorizer(friction, lagged, lagged - start, 2.0 * SLOW * size * H)
    d = unit(rng.normal(size=lagged.shape))
    friction.renew(lagged, np.zeros_like(lagged))
    assert_derivatives(friction, dense_hessian(friction, lagged) @ d.ravel(), lagged, d, 0.02 * SLOW * size * H, 0.15)


def on_plane(seed, size, friction=0.3, motion=None):
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    turn = random_turn(rng)
    points = size * LOWER_FACE @ turn.T
    lowest = (points @ normal).min()
    point = normal * (lowest - GAP * size) + size * np.cross(normal, rng.normal(size=3))
    floor = sp.HalfSpace(point=point, normal=normal, friction=friction, motion=motion)
    return model_of([points], size, [floor], 0.0)


@pytest.mark.parametrize("size", [1.0, 1e-3])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_barrier_of_planes_has_slope_two(seed, size):
    model, x = on_plane(seed, size)
    barrier = Barrier(model.collisions, 1e4)
    assert barrier.value(x) > 0.0
    # Also by the three points of the plane, which tilt it.
    d = unit(np.random.default_rng(seed + 100).normal(size=x.shape))
    assert_derivatives(barrier, dense_hessian(barrier, x) @ d.ravel(), x, d, 0.02 * GAP * size, 0.15)
    body = dense_hessian(barrier, x, True)[:12, :12]
    assert np.linalg.eigvalsh(body).min() > -1e-12 * np.abs(body).max()


def test_the_barrier_of_planes_pushes_plane_and_body_apart_with_the_same_force():
    model, x = on_plane(7, 1.0)
    gradient = gradient_of(Barrier(model.collisions, 1e4), x)
    assert np.linalg.norm(gradient[:4].sum(axis=0)) > 1.0
    assert np.abs(gradient.sum(axis=0)).max() < 1e-9 * np.abs(gradient).max()
    moments = np.cross(x, gradient).sum(axis=0)
    assert np.abs(moments).max() < 1e-9 * np.abs(np.cross(x, gradient)).max()


@pytest.mark.parametrize("size", [1.0, 1e-3])
@pytest.mark.parametrize("speed", [0.4, 0.9, 3.0], ids=["sticking", "nearly sliding", "sliding"])
def test_friction_with_planes_has_slope_two(size, speed):
    model, lagged = on_plane(8, size)
    normal = np.asarray(model.obstacles[0].obstacle.normal)  # pyright: ignore[reportAttributeAccessIssue]
    rng = np.random.default_rng(9)
    across = np.cross(normal, rng.normal(size=3))
    start = lagged - speed * SLOW * size * H * across / np.linalg.norm(across)
    start[4:] = lagged[4:]
    (friction,) = model.frictions(Barrier(model.collisions, 1e4), lagged, start, H)
    d = rng.normal(size=lagged.shape)
    check_majorizer(friction, lagged, lagged - start, 2.0 * SLOW * size * H)
    friction.renew(lagged, np.zeros_like(lagged))
    d = unit(d)
    assert_derivatives(friction, dense_hessian(friction, lagged) @ d.ravel(), lagged, d, 0.02 * SLOW * size * H, 0.15)


@pytest.mark.parametrize("dhat", [0.1, 1e-5])
def test_planes_have_the_barrier_that_triangles_have(dhat):
    """One vertex with unit area: the library's physical barrier of two points as far apart."""
    library = ipctk.BarrierPotential(dhat, stiffness=3.0, use_physical_barrier=True)
    pair = ipctk.VertexVertexNormalCollision(0, 1)
    for share in (1e-3, 0.1, 0.5, 0.9, 0.999):
        d = share * dhat
        points = np.array([0, 0, 0, 0, d, 0.0])
        energy, first, second = (3.0 * value for value in (barrier_value(d, dhat), *barrier_slopes(d, dhat)))
        assert energy == pytest.approx(library(pair, points), rel=1e-9)
        assert first == pytest.approx(library.gradient(pair, points)[4], rel=1e-9)
        hessian = library.hessian(pair, points, ipctk.PSDProjectionMethod.NONE)
        assert second == pytest.approx(hessian[4, 4], rel=1e-9)


def test_planes_have_the_friction_that_triangles_have():
    model, lagged = on_plane(10, 1.0)
    normal = np.asarray(model.obstacles[0].obstacle.normal)  # pyright: ignore[reportAttributeAccessIssue]
    across = np.cross(normal, [0.3, 0.2, -0.8])
    across /= np.linalg.norm(across)
    barrier = Barrier(model.collisions, 1e4)
    reach = SLOW * H
    for share in (0.0, 0.2, 0.99, 1.01, 5.0):
        start = lagged - share * reach * across
        start[4:] = lagged[4:]
        (friction,) = model.frictions(Barrier(model.collisions, 1e4), lagged, start, H)
        pressing = friction.slips.forces.sum()
        expected = pressing * ipctk.smooth_friction_f0(share * reach, reach)
        assert friction.value(lagged) == pytest.approx(expected, rel=1e-9)
        gradient = gradient_of(friction, lagged)
        assert np.allclose(gradient.sum(axis=0), 0.0, atol=1e-9 * pressing)
        force = gradient[:4].sum(axis=0)
        assert np.allclose(
            force, pressing * ipctk.smooth_friction_f1(share * reach, reach) * across, atol=1e-9 * pressing
        )
    # mu times the force of the barrier, which acts on the body alone.
    assert pressing == pytest.approx(0.3 * np.linalg.norm(gradient_of(barrier, lagged)[:4].sum(axis=0)), rel=1e-12)
