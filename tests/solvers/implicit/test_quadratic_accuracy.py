"""Quadratic tets against exact solutions: Cook's membrane, cantilever, torsion, a manufactured solution."""

from functools import cache

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import spsolve

import supple as sp
from supple.model.system import build_system
from supple.numerics.quadratic_shape_functions import conical_rule, reference_gradients, shape_functions
from supple.scene.forces import Force
from supple.solvers.implicit.energies.elasticity import elasticity_of
from supple.solvers.implicit.energies.loads.external_forces import total_forces
from supple.solvers.implicit.energies.potential import HessianBlocks

STATIC = sp.Implicit(integrator="static", contact=None)
SOFT = sp.StableNeoHookean(youngs=1e4, poisson=0.4, density=1000.0, damping=0.01)


def equilibrium(scene, solver=STATIC):
    frame = list(sp.simulate(scene, solver, 1.0, 1))[-1]
    assert frame.report.status == "converged", frame.report.message
    return frame


def cook(cells, poisson, graded):
    """Deflection of the middle of the loaded edge of Cook's membrane, 10 thick, per load; cells may be graded."""
    unit = sp.shapes.box((1, 1, 1), (cells, cells, 1))
    X = unit.vertices + 0.5
    s, t = X[:, 0], 1.0 - X[:, 1]
    if graded:
        s, t = s**2, np.where(t < 0.5, 0.5 * (2 * t) ** 1.5, 1 - 0.5 * np.maximum(2 * (1 - t), 0.0) ** 1.5)
    places = np.column_stack([48 * s, 44 * s + t * (44 - 28 * s), 10 * X[:, 2]])
    mesh = sp.TetMesh(places, unit.tets).to_order(2)
    x, load = mesh.vertices, 1e-5
    end = np.flatnonzero((x[mesh.surface.triangles][:, :, 0] > 48 - 1e-9).all(axis=1))
    scene = sp.Scene(
        [sp.Body("cook", mesh, sp.StableNeoHookean(youngs=1.0, poisson=poisson))],
        pins=[sp.Pin("cook", np.flatnonzero(x[:, 0] < 1e-9))],
        loads=[sp.Traction("cook", (0.0, load / 16, 0.0), end)],
        gravity=(0, 0, 0),
    )
    middle = (x[:, 0] > 48 - 1e-9) & (np.abs(x[:, 1] - 52) < 1e-6)
    return (equilibrium(scene).positions["cook"] - x)[middle, 1].mean() / load


# Limits of meshes with 16 and 24 graded cells; see docs/theory/locking.md.
@pytest.mark.parametrize(
    ("poisson", "graded", "limit"), [(1 / 3, True, 23.85), (0.499, True, 23.85), (0.4999, False, 23.778)]
)
def test_cooks_membrane_with_eight_elements_on_a_side(poisson, graded, limit):
    assert cook(8, poisson, graded) == pytest.approx(limit, rel=0.01)


def test_cantilever():
    """Timoshenko's deflection; that of a solid is 0.9935 of it, on 8,640 graded tets (docs/theory/locking.md)."""
    length, side, youngs, nu, load = 1.0, 0.1, 1e6, 0.3, 0.01
    linear = sp.shapes.box((1, side, side), (20, 3, 3))
    x = linear.vertices.copy()
    x[:, 0] = length * (x[:, 0] + 0.5) ** 1.5
    mesh = sp.TetMesh(x, linear.tets).to_order(2)
    x = mesh.vertices
    end = np.flatnonzero((x[mesh.surface.triangles][:, :, 0] > length - 1e-9).all(axis=1))
    scene = sp.Scene(
        [sp.Body("bar", mesh, sp.StableNeoHookean(youngs=youngs, poisson=nu))],
        pins=[sp.Pin("bar", np.flatnonzero(x[:, 0] < 1e-9))],
        loads=[sp.Traction("bar", (0, -load / side**2, 0), end)],
        gravity=(0, 0, 0),
    )
    moved = equilibrium(scene).positions["bar"] - x
    deflection = -moved[x[:, 0] > length - 1e-9, 1].mean()
    kappa = 10 * (1 + nu) / (12 + 11 * nu)
    shear = load * length / (kappa * youngs / (2 * (1 + nu)) * side**2)
    assert len(mesh.tets) == 1080
    share = deflection / (4 * load * length**3 / (youngs * side**4) + shear)
    assert share == pytest.approx(0.9935, abs=0.003)


def test_cantilever_with_the_support_of_the_theory():
    """Plane at the wall, but free to contract sideways, under the shear of the load: 99.5 % with 336 tets."""
    length, side, nu = 1.0, 0.1, 0.3
    linear = sp.shapes.box((1, side, side), (14, 2, 2))
    x = linear.vertices.copy()
    x[:, 0] = length * (x[:, 0] + 0.5) ** 1.5
    mesh = sp.TetMesh(x, linear.tets).to_order(2)
    x, triangles = mesh.vertices, mesh.surface.triangles
    loads = []
    for at, sign in ((length, -1.0), (0.0, 1.0)):
        rows = np.flatnonzero((np.abs(x[triangles][:, :, 0] - at) < 1e-9).all(axis=1))
        loads.append(sp.Traction("bar", (0, sign / side**2, 0), rows))
    material = sp.StableNeoHookean(youngs=1.0, poisson=nu)
    system = build_system(sp.Scene([sp.Body("bar", mesh, material)], loads=loads, gravity=(0, 0, 0)))
    blocks, n = HessianBlocks.zeros(len(mesh.tets), len(x)), len(x)
    elasticity_of(system).add_hessian(x, blocks, False)
    (part,) = blocks.patches
    i, j = np.indices((3, 3))
    rows, columns = 3 * part.rows[:, None, None] + i, 3 * part.columns[:, None, None] + j
    K = sparse.coo_array((part.blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(3 * n, 3 * n)).tocsc()
    K = (sparse.triu(K) + sparse.triu(K, 1).T).tocsc()
    wall = np.flatnonzero(np.abs(x[:, 0]) < 1e-9)
    middle = wall[np.argmin(np.abs(x[wall, 1:]).max(axis=1))]
    edge = wall[np.argmin(np.abs(x[wall, 1:] - [0.0, side / 2]).max(axis=1))]
    held = np.concatenate([3 * wall, [3 * middle + 1, 3 * middle + 2, 3 * edge + 1]])
    free = np.setdiff1d(np.arange(3 * n), held)
    force = total_forces(system, x, 0.0)
    moved = np.zeros(3 * n)
    moved[free] = spsolve(K[free][:, free], force.ravel()[free])
    work = (moved.reshape(-1, 3) * force).sum()
    kappa = 10 * (1 + nu) / (12 + 11 * nu)
    theory = 4 * length**3 / side**4 + length / (kappa * side**2 / (2 * (1 + nu)))
    assert work == pytest.approx(theory, rel=0.002)


def test_torsion_constant_at_three_elements_across():
    """Of a unit square, 0.1406 (Saint-Venant), from bars of two lengths, so that their bonded ends do not count."""
    nu, angle = 0.3, 1e-4
    compliances = []
    for cells in (6, 12):
        mesh = sp.shapes.box((1, 1, cells / 3), (3, 3, cells), order=2)
        x = mesh.vertices
        ends = np.flatnonzero(np.abs(x[:, 2]) > cells / 6 - 1e-9)
        around = np.column_stack([-x[ends, 1], x[ends, 0], 0 * x[ends, 0]])
        turn = np.where(x[ends, 2] > 0, angle, 0.0)[:, None] * around
        scene = sp.Scene(
            [sp.Body("bar", mesh, sp.StableNeoHookean(youngs=2 * (1 + nu), poisson=nu))],
            pins=[sp.Pin("bar", ends, lambda t, turn=turn: t * turn)],
            gravity=(0, 0, 0),
        )
        compliances.append(0.5 * angle**2 / equilibrium(scene).report.elastic_energy)
    assert 2.0 / (compliances[1] - compliances[0]) == pytest.approx(0.1406, rel=0.02)


@cache
def manufactured_errors(n, order):
    """L2 and H1 errors of the displacement a sin(pi x) sin(pi y) sin(pi z) e on the unit cube."""
    unit = sp.shapes.box((1, 1, 1), (n, n, n), order=order)
    mesh = sp.TetMesh(unit.vertices + 0.5, unit.nodes)
    nu, a, e = 0.3, 1e-6, np.array([1.0, 0.5, -0.7])
    mu, lam = 1.0 / (2 * (1 + nu)), nu / ((1 + nu) * (1 - 2 * nu))
    places, weights = conical_rule(order + 2)
    corners, N = mesh.vertices[mesh.nodes], places
    slopes = np.vstack([-np.ones(3), np.eye(3)])[None].repeat(len(places), 0)
    if order == 2:
        N, slopes = shape_functions(places), reference_gradients(places)
    at = np.einsum("qa,mai->mqi", N, corners)
    s, c = np.sin(np.pi * at), np.cos(np.pi * at)
    phi = s.prod(axis=2)
    u = a * phi[..., None] * e
    slope = np.pi * np.stack([np.where(np.arange(3) == k, c, s).prod(axis=2) for k in range(3)], axis=2)
    second = np.empty((*phi.shape, 3, 3))
    for i in range(3):
        for j in range(3):
            chosen = (np.arange(3) == i) | (np.arange(3) == j)
            second[..., i, j] = np.pi**2 * (-phi if i == j else np.where(chosen, c, s).prod(axis=2))
    force = a * (3 * np.pi**2 * mu * phi[..., None] * e - (lam + mu) * second @ e)
    dV = np.outer(mesh.volumes, weights)
    loads = np.zeros_like(mesh.vertices)
    np.add.at(loads, mesh.nodes, np.einsum("mq,mqi,qa->mai", dV, force, N))
    hull = np.unique(mesh.surface.triangles)
    inner = np.setdiff1d(np.arange(len(mesh.vertices)), hull)
    scene = sp.Scene(
        [sp.Body("cube", mesh, sp.StableNeoHookean(youngs=1.0, poisson=nu))],
        pins=[sp.Pin("cube", hull)],
        forces=[Force("cube", inner, loads[inner])],
        gravity=(0, 0, 0),
    )
    moved = (equilibrium(scene).positions["cube"] - mesh.vertices)[mesh.nodes]
    inverse = np.linalg.inv(np.einsum("mai,aj->mij", corners, slopes[0]))
    gradients = np.einsum("mai,qak,mkj->mqij", moved, slopes, inverse)
    wrong = np.einsum("qa,mai->mqi", N, moved) - u
    wrong_slope = gradients - a * e[:, None] * slope[:, :, None, :]
    return (
        np.sqrt(np.einsum("mq,mqi,mqi->", dV, wrong, wrong)),
        np.sqrt(np.einsum("mq,mqij,mqij->", dV, wrong_slope, wrong_slope)),
    )


@pytest.mark.parametrize(
    ("order", "cells", "orders"),
    [
        (1, (9, 18), (1.9, 0.9)),
        (2, (3, 6), (2.9, 1.8)),
        pytest.param(2, (8, 12), (2.97, 1.96), marks=pytest.mark.slow),
    ],
)
def test_manufactured_solution_converges_with_the_orders_of_the_elements(order, cells, orders):
    coarse, fine = (np.array(manufactured_errors(n, order)) for n in cells)
    rates = np.log(coarse / fine) / np.log(cells[1] / cells[0])
    assert (rates > orders).all()
