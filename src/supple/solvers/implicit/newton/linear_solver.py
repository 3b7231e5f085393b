"""Newton's linear systems in the free vertices: assembled in place, solved by preconditioned CG or directly."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from time import perf_counter

import numba
import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.numerics.sparse.block_csr import BlockPattern, build_pattern
from supple.numerics.sparse.block_sum import JointPattern
from supple.numerics.sparse.couplings import Correction, Couplings
from supple.numerics.sparse.pcg import CGResult, conjugate_gradients, gradients_by_products, preconditioned
from supple.numerics.sparse.preconditioner import RowOrder, TwoLevel, order_rows, two_level
from supple.runtime.thread_tuning import ThreadTuner
from supple.runtime.threads import has_several
from supple.solvers.implicit.energies.potential import HessianBlocks
from supple.solvers.implicit.newton.direct_solver import solve_directly
from supple.solvers.implicit.newton.reduction import Reduction

logger = logging.getLogger(__name__)

# Where CG has not converged after this many iterations, a factorization is likely faster: usual systems take 10 to 60,
# thin bodies of nearly incompressible material more than 500 (docs/theory/implicit.md).
_STALLED = 400

# The same with the corrections of shells: factorizations of surfaces cost less.
_STALLED_SURFACE = 100

# After this many iterations the slower number of threads is tried again, see `ThreadTuner`.
_REST = 40

# The coarse level of the preconditioner is renewed where CG takes this factor times its first number of iterations, and
# this many more: a renewal costs about as much as the iterations that it saves.
_AGED_RATIO = 1.5
_AGED_EXTRA = 4


@dataclass(frozen=True)
class LinearReport:
    """The method of a solve, its CG iterations, and the residual's preconditioned norm at the start."""

    method: str
    iterations: int
    first_norm: float


@dataclass(eq=False)
class LinearSolver:
    """The matrix of the free vertices and its preconditioner; its coarse level is reused from iteration to iteration.

    Attributes
    ----------
    kind : "auto" (CG, and a factorization where CG stalls), "pcg" or "direct"
    order : which vertex each row belongs to; row_of : (n,) row of each vertex, -1 where it is pinned
    matrix : the sparse part; low_rank : (k, rows, 3) vectors g, of which g g^T is added to it
    corrections : what else is added
    age, fresh_iterations : the number of runs of CG on the present coarse level (-1: none), and the iterations of the
        first one
    solves : how many systems have been solved
    stalled : whether CG has stalled in this step on a matrix with corrections; the next ones are factorized
    pace : the number of threads of an iteration, one or `most_threads`, chosen by its time without the linear solve,
        whose work varies
    """

    kind: str
    order: RowOrder
    row_of: NDArray[np.int32]
    pattern: BlockPattern
    elements_only: TwoLevel
    elements: NDArray[np.float64]
    matrix: NDArray[np.float64] = field(init=False)
    preconditioner: TwoLevel = field(init=False)
    joint: JointPattern | None = None
    reduction: Reduction | None = None
    low_rank: NDArray[np.float64] = field(init=False)
    corrections: Sequence[Correction] = ()
    age: int = -1
    fresh_iterations: int = 0
    solves: int = 0
    stalled: bool = False
    pace: ThreadTuner = field(init=False)
    most_threads: int = 1

    @classmethod
    def of(cls, system: System, kind: str) -> LinearSolver:
        """Build the pattern and the groups of a system's free vertices."""
        free = np.ones(len(system.rest_positions), dtype=bool)
        free[system.pinned_vertices] = False
        free[system.welding.vertices] = False
        order = order_rows(system.rest_positions, system.components, system.elements, free)
        rows = np.full(len(free) + 1, -1, dtype=np.int32)  # the last one for nodes without a vertex, number -1
        rows[order.vertices] = np.arange(len(order.vertices), dtype=np.int32)
        pattern = build_pattern(rows[system.elements], len(order.vertices))
        preconditioner = two_level(pattern, system.rest_positions[order.vertices], order.group_start)
        elements = np.zeros((pattern.blocks, 3, 3))
        return cls(kind, order, rows[:-1], pattern, preconditioner, elements, reduction=Reduction.of(system))

    def __post_init__(self) -> None:
        self.matrix, self.preconditioner = self.elements, self.elements_only
        self.low_rank = np.zeros((0, len(self.order.vertices), 3))
        self.pace = ThreadTuner(has_several(), has_several(), _REST)

    def begin_step(self) -> None:
        """Discard what earlier steps have left, so that a step depends on its state alone."""
        self.age, self.joint, self.stalled = -1, None, False

    def own_threads(self) -> AbstractContextManager[None]:
        """A substep's block. What is outside of iterations runs in the mode that was faster so far."""
        self.most_threads = numba.get_num_threads()
        return self.pace.threads(self.pace.parallel, self.most_threads)

    def iterations(self, count: int) -> Iterator[int]:
        """The numbers of this many iterations, each on one thread or on several."""
        return self.pace.tasks(count, self.most_threads)

    def assemble(self, hessian: HessianBlocks) -> None:
        """Assemble the matrix of a new Hessian, and update the preconditioner."""
        diagonal = hessian.vertices[self.order.vertices]
        reduction = self.reduction
        if couplings := (hessian.beyond_elements if reduction is None else reduction.couplings(hessian)):
            self._assemble_joint(hessian.elements, diagonal, Couplings.joined(couplings))
        else:
            if self.joint is not None:
                self.joint, self.age = None, -1
            self.matrix, self.preconditioner = self.elements, self.elements_only
            self.pattern.assemble(hessian.elements, diagonal, self.elements)
        count = len(self.order.vertices)
        self.low_rank = np.zeros((len(hessian.low_rank), count, 3))
        for k, part in enumerate(hessian.low_rank):
            self.low_rank[k] = part.in_rows(self.row_of, count)
        self.corrections = tuple(hessian.corrections)
        if self.kind != "direct":
            self.preconditioner.update(self.matrix, coarse=self.age < 0)

    def _assemble_joint(
        self, elements: NDArray[np.float64], diagonal: NDArray[np.float64], couplings: Couplings
    ) -> None:
        """Assemble with couplings of vertices that no element joins, on a new pattern where one has no block yet."""
        places = self.joint.places(couplings) if self.joint is not None else None
        renewed = self.joint is None or places is None
        if self.joint is None or places is None:
            self.joint = JointPattern.of(self.pattern, couplings, self.row_of)
            places = self.joint.places(couplings)
            assert places is not None
            self.matrix = np.empty((self.joint.pattern.blocks, 3, 3))
        self.joint.assemble(elements, diagonal, couplings.blocks, places, self.matrix)
        if renewed or self.age < 0:
            before = self.preconditioner.first
            self.preconditioner = self.elements_only.on(self.joint.pattern, self.matrix)
            if not np.array_equal(before, self.preconditioner.first):
                self.age = -1

    def solve(
        self, force: NDArray[np.float64], tolerance: float, convex: bool = True
    ) -> tuple[NDArray[np.float64] | None, LinearReport]:
        """Solve H p = force.

        Parameters
        ----------
        force : (n, 3), of which the free rows are read; tolerance : relative, for CG
        convex : whether the Hessian is known to be positive semi-definite. Where that is not known, every method checks
            it: CG the curvature along its directions, the factorization the signs of all eigenvalues

        Returns
        -------
        p : (n, 3), zero where pinned, and welded vertices with their rigid bodies; None where the system could not be
            solved, or was found to be indefinite
        """
        began = perf_counter()
        self.solves += 1
        p, report = self._solve(force, tolerance, convex)
        self.pace.untimed += perf_counter() - began
        if p is not None and self.reduction is not None:
            self.reduction.welding.follow(p)
        return p, report

    def _solve(
        self, force: NDArray[np.float64], tolerance: float, convex: bool
    ) -> tuple[NDArray[np.float64] | None, LinearReport]:
        b = force[self.order.vertices]
        x = np.zeros_like(b)
        p = np.zeros_like(force)
        if len(b) == 0 or not b.any():
            return p, LinearReport("none", 0, 0.0)
        first_norm = 0.0
        iterations = 0
        if self.kind != "direct" and not self.stalled:
            most = _STALLED_SURFACE if self.corrections else _STALLED
            most = most if self.kind == "auto" else max(1000, 3 * b.size)
            result = self._conjugate_gradients(b, x, tolerance, most)
            if result.indefinite and not convex:
                return None, LinearReport("pcg", result.iterations, result.first_norm)
            if not result.converged and self.age > 0:
                # The coarse level belongs to an older matrix.
                iterations += result.iterations
                self.preconditioner.update(self.matrix)
                self.age = -1
                result = self._conjugate_gradients(b, x, tolerance, most)
            iterations += result.iterations
            first_norm = result.first_norm
            self._age_by(result.iterations)
            if result.converged or (self.kind == "pcg" and np.isfinite(x).all() and x.any()):
                p[self.order.vertices] = x
                return p, LinearReport("pcg", iterations, first_norm)
            if self.kind == "pcg":
                return None, LinearReport("pcg", iterations, first_norm)
            self.stalled = bool(self.corrections)
            logger.debug("CG stalled after %d iterations; factorizing", iterations)
        pattern = self.preconditioner.pattern
        correct = self._correct if self.corrections else None
        solution = solve_directly(pattern, self.matrix, b, not convex, self.low_rank, correct)
        if solution is None:
            return None, LinearReport("direct", iterations, first_norm)
        p[self.order.vertices] = solution
        return p, LinearReport("direct", iterations, first_norm)

    def _correct(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """The products of the corrections with a vector of the free vertices (n, 3)."""
        whole = np.zeros((len(self.row_of), 3))
        whole[self.order.vertices] = rows
        if self.reduction is not None:
            self.reduction.welding.follow(whole)
        out = np.zeros_like(whole)
        for one in self.corrections:
            one.add_product(whole, out)
        if self.reduction is not None:
            out = self.reduction.welding.reduced(out)
        return out[self.order.vertices]

    def _conjugate_gradients(
        self, b: NDArray[np.float64], x: NDArray[np.float64], tolerance: float, most: int
    ) -> CGResult:
        if not self.corrections:
            return conjugate_gradients(self.preconditioner, b, x, tolerance, most, self.low_rank)
        matrix = self.preconditioner.pattern.to_scipy(self.matrix)

        def product(p: NDArray[np.float64]) -> NDArray[np.float64]:
            out = (matrix @ p.ravel()).reshape(-1, 3) + self._correct(p)
            for g in self.low_rank:
                out += np.vdot(g, p) * g
            return out

        x[:], result = gradients_by_products(
            product, lambda r: preconditioned(self.preconditioner, r), b, tolerance, most
        )
        return result

    def _age_by(self, iterations: int) -> None:
        """After a run of CG: keep the coarse level unless it has become too old."""
        if self.age < 0:
            self.fresh_iterations = iterations
            self.age = 0
        self.age += 1
        if iterations > _AGED_RATIO * self.fresh_iterations + _AGED_EXTRA:
            self.age = -1
