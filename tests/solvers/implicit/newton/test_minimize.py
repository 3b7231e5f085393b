"""Newton's method on problems whose minimum is known: friction with a kink, and how often Hessians are made."""

from dataclasses import dataclass

import numpy as np
import pytest

import supple as sp
from supple.contact.barrier.friction_energy import Slips
from supple.contact.features.pair_geometry import VERTEX_VERTEX
from supple.model.state import Status
from supple.model.system import System, build_system
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.solvers.implicit.contact.friction import Friction
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection
from supple.solvers.implicit.energies.vertex_potential import inertia as inertia_of
from supple.solvers.implicit.inversion_guard import InversionGuard
from supple.solvers.implicit.newton.direction import Tools
from supple.solvers.implicit.newton.free_motion import FreeMotion
from supple.solvers.implicit.newton.linear_solver import LinearSolver
from supple.solvers.implicit.newton.minimize import Convergence, Outcome, Problem, minimize
from supple.solvers.implicit.newton.objective import Objective
from supple.solvers.implicit.step_limits import StepLimits

H = 0.01


def two_tets(held: tuple[int, ...] = ()) -> System:
    """One of which some vertices are held, and one that is pinned."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    mesh = sp.TetMesh(points, np.array([[0, 1, 2, 3]]))
    material = sp.StableNeoHookean(youngs=1e4, poisson=0.3, density=1000.0)
    bodies = [sp.Body("free", mesh, material), sp.Body("held", mesh, material, position=(0, 0, -3))]
    pins = [sp.Pin("held", [0, 1, 2, 3])] + ([sp.Pin("free", list(held))] if held else [])
    return build_system(sp.Scene(bodies, pins=pins))


def minimum(system: System, terms: list[Potential], tolerance: float, begin: np.ndarray) -> Outcome:
    tools = Tools(
        LinearSolver.of(system, "auto"),
        HessianBlocks.zeros(len(system.tets), len(system.rest_positions)),
        system.pinned_vertices,
        FreeMotion.of(system),
    )
    limits = StepLimits(InversionGuard(system, np.zeros(2, dtype=np.bool_), complete=True), None, tools.clock)
    problem = Problem(Objective(terms), H * H, Convergence(tolerance, 1e-6), 60, 1.0)
    tools.linear_solver.begin_step()
    return minimize(problem, begin, limits, tools)


@dataclass(frozen=True, eq=False)
class Springs(Potential):
    """k/2 |x_i - x_j|^2 of all pairs of the first four vertices, from their offsets at rest."""

    stiffness: float
    rest: np.ndarray
    projection = Projection.UNNEEDED

    def _stretch(self, x):
        d = x[:4] - self.rest[:4]
        return d[:, None] - d[None]

    def value(self, x):
        return 0.25 * self.stiffness * float((self._stretch(x) ** 2).sum())

    def add_gradient(self, x, out):
        out[:4] += self.stiffness * self._stretch(x).sum(axis=1)

    def add_hessian(self, x, out: HessianBlocks, project: bool):
        matrix = np.kron(4.0 * np.eye(4) - np.ones((4, 4)), np.eye(3))
        out.tets[0] += self.stiffness * matrix


@pytest.mark.parametrize("stiffness", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("reach", [1e-4, 1e-6, 1e-8])
def test_vertices_that_stick_beside_vertices_that_slide_are_found_in_few_iterations(reach: float, stiffness: float):
    """Two vertices are held by less friction than pulls them, two by more; springs join all four.

    The search begins where all slide. With the exact Hessian it takes up to 34 iterations and 264 cuts.
    """
    system = two_tets()
    n = len(system.rest_positions)
    pull = np.zeros((n, 3))
    pull[:4, 0] = 5e-3
    masses = system.masses
    load = masses[:4] / H**2 * 5e-3
    springs = Springs(stiffness * load[0] / 5e-3, system.rest_positions)
    slips = Slips(
        kinds=np.full(4, VERTEX_VERTEX, dtype=np.int8),
        points=np.array([[k, 4, -1, -1] for k in range(4)], dtype=np.int32),
        coefficients=np.tile([1.0, -1.0, 0.0, 0.0], (4, 1)),
        normals=np.tile([0.0, 0.0, 1.0], (4, 1)),
        offsets=system.rest_positions[:4] - system.rest_positions[4],
        forces=np.array([0.3, 0.6, 3.0, 5.0]) * load,
    )
    friction = Friction(EmbeddedPoints.at_vertices(np.arange(n, dtype=np.int32)), slips, reach)
    terms: list[Potential] = [inertia_of(masses, system.rest_positions + pull, H * H), springs, friction]
    outcome = minimum(system, terms, 1e-2 * reach, system.rest_positions + pull)
    assert outcome.status is Status.CONVERGED
    moved = (outcome.end.positions - system.rest_positions)[:4, 0]
    # Two slide, and the forces of inertia, springs and full friction balance; two stay within the band.
    force = load - masses[:4] / H**2 * moved - springs.stiffness * (4 * moved - moved.sum())
    assert force[:2] == pytest.approx(slips.forces[:2], rel=1e-4)
    assert (np.abs(moved[2:]) < reach).all()
    assert (moved[:2] > reach).all()
    assert (np.abs(force[2:]) < slips.forces[2:]).all()
    assert len(outcome.rows) <= 15
    assert sum(row.cuts for row in outcome.rows) <= 1


@dataclass(eq=False)
class Counting(Potential):
    """sqrt(1 + |u|^2 / c^2) of the first vertex: Newton's directions are too long far from the minimum."""

    rest: np.ndarray
    scale: float
    values: int = 0
    hessians: int = 0
    projection = Projection.RELEASED_FIRST

    def _u(self, x):
        return (x[0] - self.rest[0] - [0.02, 0.0, 0.0]) / self.scale

    def value(self, x):
        self.values += 1
        u = self._u(x)
        return float(np.sqrt(1.0 + u @ u))

    def add_gradient(self, x, out):
        u = self._u(x)
        out[0] += u / np.sqrt(1.0 + u @ u) / self.scale

    def add_hessian(self, x, out: HessianBlocks, project: bool):
        self.hessians += 1
        u = self._u(x)
        root = np.sqrt(1.0 + u @ u)
        out.vertices[0] += (np.eye(3) / root - np.outer(u, u) / root**3) / self.scale**2


def test_hessians_are_made_where_a_step_was_accepted_alone():
    system = two_tets(held=(1, 2, 3))  # what nothing holds must not feel where it is
    counted = Counting(system.rest_positions, 1e-3)
    inertia = inertia_of(np.full(len(system.masses), 1e-3), system.rest_positions, H * H)
    outcome = minimum(system, [inertia, counted], 1e-9, system.rest_positions)
    assert outcome.status is Status.CONVERGED
    cuts = sum(row.cuts for row in outcome.rows)
    assert cuts > 0
    assert counted.hessians <= len(outcome.rows)
    assert counted.values >= len(outcome.rows) + cuts
