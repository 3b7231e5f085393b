"""Newton directions of given Hessians: indefinite ones are found out by every linear solver, and projected."""

from dataclasses import dataclass

import numpy as np
import pytest

import supple as sp
from supple.model.system import build_system
from supple.numerics.sparse.couplings import Couplings
from supple.solvers.implicit.energies.potential import ContactPotential, HessianBlocks, Potential, Projection
from supple.solvers.implicit.newton import direct_solver
from supple.solvers.implicit.newton.direction import DirectionFinder, Tools
from supple.solvers.implicit.newton.free_motion import FreeMotion
from supple.solvers.implicit.newton.hessian_projection import ProjectedTerms
from supple.solvers.implicit.newton.linear_solver import LinearSolver
from supple.solvers.implicit.newton.objective import Objective

MESH = sp.shapes.box((1, 1, 1), (2, 2, 2))
PINNED = [0, 1, 2]
N = len(MESH.vertices)


def clamped(matrices):
    w, Q = np.linalg.eigh(matrices)
    return np.einsum("nij,nj,nkj->nik", Q, np.maximum(w, 1.0), Q)


@dataclass(frozen=True, eq=False)
class Quadratic(Potential):
    """x_i . A_i x_i / 2 + b_i . x_i, summed over vertices; projection raises eigenvalues to 1."""

    A: np.ndarray
    b: np.ndarray
    projection = Projection.RELEASED_FIRST

    def value(self, x):
        return 0.5 * float(np.einsum("ni,nij,nj->", x, self.A, x)) + float((self.b * x).sum())

    def add_gradient(self, x, out):
        out += np.einsum("nij,nj->ni", self.A, x) + self.b

    def add_hessian(self, x, out: HessianBlocks, project: bool):
        out.vertices[:] += clamped(self.A) if project else self.A


@dataclass(frozen=True, eq=False)
class Touch(ContactPotential):
    """stiffness/2 |x_a - x_b|^2 between two vertices; projection leaves it out where the stiffness is negative."""

    a: int
    b: int
    stiffness: float

    def value(self, x):
        return 0.5 * self.stiffness * float(((x[self.a] - x[self.b]) ** 2).sum())

    def add_gradient(self, x, out):
        force = self.stiffness * (x[self.a] - x[self.b])
        out[self.a] += force
        out[self.b] -= force

    def add_hessian(self, x, out: HessianBlocks, project: bool):
        k = max(self.stiffness, 0.0) if project else self.stiffness
        ends = np.array([self.a, self.b, self.a], dtype=np.int32), np.array([self.a, self.b, self.b], dtype=np.int32)
        out.couplings.append(Couplings(*ends, np.array([1.0, 1.0, -1.0])[:, None, None] * k * np.eye(3)))


def blocks(smallest: float) -> np.ndarray:
    """(n, 3, 3) symmetric, with eigenvalues 5, 3 and `smallest` in random directions."""
    Q = np.linalg.qr(np.random.default_rng(2).normal(size=(N, 3, 3)))[0]
    return np.einsum("nij,j,nkj->nik", Q, [5.0, 3.0, smallest], Q)


@pytest.fixture(params=["auto", "pcg", "pardiso", "superlu"])
def solver(request, monkeypatch) -> str:
    if request.param == "pardiso":
        pytest.importorskip("pypardiso")
    if request.param == "superlu":
        monkeypatch.setattr(direct_solver, "_pardiso", lambda: None)
    return "direct" if request.param in ("pardiso", "superlu") else request.param


def finder(terms, solver: str, projected: ProjectedTerms) -> DirectionFinder:
    body = sp.Body("cube", MESH, sp.StableNeoHookean(youngs=1e5, poisson=0.3))
    system = build_system(sp.Scene([body], pins=[sp.Pin("cube", PINNED)]))
    hessian = HessianBlocks.zeros(len(system.tets), N)
    tools = Tools(LinearSolver.of(system, solver), hessian, system.pinned_vertices, FreeMotion.of(system))
    made = DirectionFinder(Objective(terms), tools, scale=1.0, short=0.0, longest=1.0, forcing=1e-12)
    made.policy.now = projected
    return made


def find(terms, solver: str, projected: ProjectedTerms):
    made = finder(terms, solver, projected)
    here = made.objective.model(MESH.vertices, made.tools.hessian, projected)
    found = made.find(here)
    assert found is not None
    assert not found.vector[PINNED].any()
    assert found.slope < 0.0
    assert found.length == np.abs(found.vector).max()
    return found, here.gradient


def newton(A, gradient):
    exact = -np.linalg.solve(A, gradient[:, :, None])[:, :, 0]
    exact[PINNED] = 0.0
    return exact


LOAD = np.random.default_rng(3).normal(size=(N, 3))


def test_a_definite_hessian_is_used_as_it_is(solver):
    A = blocks(0.5)
    found, gradient = find([Quadratic(A, LOAD)], solver, ProjectedTerms.NONE)
    assert found.projected is ProjectedTerms.NONE
    np.testing.assert_allclose(found.vector, newton(A, gradient), atol=1e-8)


def test_an_indefinite_hessian_is_projected(solver):
    A = blocks(-0.5)
    found, gradient = find([Quadratic(A, LOAD)], solver, ProjectedTerms.NONE)
    assert found.projected is ProjectedTerms.ALL
    np.testing.assert_allclose(found.vector, newton(clamped(A), gradient), atol=1e-8)


@pytest.mark.parametrize("superlu", [False, True])
def test_a_factorization_finds_negative_eigenvalues_that_the_direction_does_not_meet(superlu, monkeypatch):
    if superlu:
        monkeypatch.setattr(direct_solver, "_pardiso", lambda: None)
    else:
        pytest.importorskip("pypardiso")
    A = np.tile(np.diag([1.0, 2.0, 3.0]), (N, 1, 1))
    A[5] = np.diag([1.0, 2.0, -3.0])
    load = LOAD - np.einsum("nij,nj->ni", A, MESH.vertices)
    load[5, 2] = 3.0 * MESH.vertices[5, 2]
    found, gradient = find([Quadratic(A, load)], "direct", ProjectedTerms.NONE)
    assert gradient[5, 2] == 0.0
    assert found.projected is ProjectedTerms.ALL


def test_contact_alone_is_projected_where_that_is_enough(solver):
    terms = [Quadratic(blocks(2.0), LOAD), Touch(5, 20, -9.0)]
    for order in (terms, terms[::-1]):
        found, _ = find(order, solver, ProjectedTerms.NONE)
        assert found.touching
        assert found.projected is ProjectedTerms.RELEASED_LAST


def test_without_inertia_a_direction_is_not_longer_than_allowed(solver):
    made = finder([Quadratic(blocks(0.5), 100.0 * LOAD)], solver, ProjectedTerms.ALL)
    made.scale = None
    found = made.find(made.objective.model(MESH.vertices, made.tools.hessian))
    assert found is not None
    assert found.length == pytest.approx(1.0)


def test_the_tolerance_of_the_linear_solver_follows_the_gradient():
    made = finder([Quadratic(blocks(2.0), LOAD)], "pcg", ProjectedTerms.ALL)
    made.forcing = 1e-2
    here = made.objective.model(MESH.vertices, made.tools.hessian)
    tolerances = []
    for _ in range(4):
        found = made.find(here)
        assert found is not None
        tolerances.append(found.tolerance)
        here = made.objective.model(here.positions + 0.99 * found.vector, made.tools.hessian)
    # Choice 2 of Eisenstat and Walker: half the square of the factor by which the residual fell, here 0.01.
    assert tolerances == pytest.approx([1e-2, 1e-2, 5e-5, 5e-5], rel=1e-3)
