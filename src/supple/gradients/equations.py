"""The linearized equations of a substep at its end.

The unknowns y are the vertices that are neither pinned nor welded, x = T y + (pins), and the multipliers m of
conditions c(x) = 0, of joints and of actuators with a given coordinate. The equations are T^T g(x; s, p) = 0 and c = 0,
where g contains the forces C^T m. K = dg/dx is the true Hessian of the objective, in which nothing is projected, with
the derivative of friction by the state that its normal forces belong to, where that is the end: it is not symmetric
then.
Actuators add G G^T, which is kept apart so that the matrix is sparse.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_array, csr_array, eye_array
from scipy.sparse.linalg import splu

from supple.errors import SolverError
from supple.gradients.kept import Replay
from supple.model.loads.actuators.laws import Held
from supple.solvers.implicit.contact.areas import area_derivatives, barrier_by_areas
from supple.solvers.implicit.energies.potential import HessianBlocks
from supple.solvers.implicit.natural_modes import (
    column,
    conditions_of,
    hessian_matrix,
    independent,
    joint_conditions,
    stacked,
    unknowns,
)
from supple.solvers.implicit.newton.hessian_projection import ProjectedTerms

Floats = NDArray[np.float64]

# Relative, of systems that the step's own solver can solve: those that are symmetric and have no conditions.
_EXACT = 1e-12


@dataclass(frozen=True, eq=False)
class Equations:
    """See the module. They are those of the latest substep that was linearized in their workspace.

    Attributes
    ----------
    lag : (3 n, 3 n) the derivative of contact by the state that its areas, and the normal forces of friction, belong
        to; None where that is not the end, or nothing depends on it
    rows : (c,) which of the conditions C (c, 3 n) are independent, of `count`; held : (l,) which laws of joints are
        conditions
    """

    replay: Replay
    blocks: HessianBlocks
    lag: Any
    C: Any
    rows: NDArray[np.int64]
    held: NDArray[np.int64]
    count: int

    @classmethod
    def of(cls, replay: Replay) -> Equations:
        blocks, x, lag = replay.workspace.tools.hessian, replay.x, None
        for friction in replay.frictions:
            friction.settle(x)
        replay.objective.model(x, blocks, ProjectedTerms.NONE)
        barrier = replay.barrier
        if barrier is not None and len(barrier.collisions.at(x).kinds):
            weights, areas = barrier.collisions.at(x).weights, area_derivatives(barrier.collisions, x)
            parts = [barrier_by_areas(barrier, x, areas)] if areas.nnz else []
            if replay.kept.at_end:
                parts += [one.derivative(x, weights, areas) for one in replay.lags]
            lag = sum(parts[1:], start=parts[0]) if parts else None
        return cls(replay, blocks, lag, *_conditions(replay))

    def product(self, way: Floats) -> Floats:
        """(n, 3) dg/dx times a way (n, 3)."""
        own = self._symmetric_product(way)
        return own if self.lag is None else own + (self.lag @ way.ravel()).reshape(-1, 3)

    def transposed_product(self, forces: Floats) -> Floats:
        """(n, 3) the transpose of dg/dx times forces (n, 3)."""
        own = self._symmetric_product(forces)
        return own if self.lag is None else own + (self.lag.T @ forces.ravel()).reshape(-1, 3)

    def contact_product(self, way: Floats, *, transposed: bool = False) -> Floats:
        """(n, 3) the derivative of contact's part of g by x, times a way (n, 3)."""
        blocks, out = HessianBlocks.zeros(0, len(way)), np.zeros_like(way)
        for term in self.replay.contact.terms:
            term.add_hessian(self.replay.x, blocks, False)
        for part in blocks.couplings:
            part.add_product(way, out)
        if self.lag is not None:
            out += ((self.lag.T if transposed else self.lag) @ way.ravel()).reshape(-1, 3)
        return out

    def solve(self, right: Floats, of_conditions: Floats) -> tuple[Floats, Floats, Floats]:
        """The way (n, 3) of the unknowns, zero at pins, that changes g by `right` (n, 3) and conditions by (c,); (n, 3)
        the change of g by what the multipliers do; and these (c,)."""
        way, multipliers = self._solved(right, of_conditions, "N")
        return way, (self.C.T @ multipliers).reshape(-1, 3), multipliers

    def solve_transposed(self, right: Floats, pins: Floats, held: Floats) -> tuple[Floats, Floats]:
        """The forces (n, 3), zero at pins, and u (c,) for a `right` side (n, 3), forces at pins (n, 3), and derivatives
        of the loss by forces of actuators with a given coordinate, which are minus their multipliers (h,)."""
        by_multipliers = np.zeros(self.count)
        by_multipliers[: len(held)] = -held
        return self._solved(right, -(self.C @ pins.ravel()) - by_multipliers[self.rows], "T")

    def newton_step(self, gradient: Floats, values: Floats) -> tuple[Floats, Floats]:
        """The way (n, 3) to where g and conditions (c,) vanish, and the changes (c,) of multipliers."""
        return self._solved(-gradient, -values, "N")

    def _solved(self, right: Floats, of_conditions: Floats, way: str) -> tuple[Floats, Floats]:
        tools = self.replay.workspace.tools
        if self.lag is None and not len(self.rows):
            if way == "T" or "_assembled" not in vars(self):
                tools.linear_solver.begin_step()
                tools.linear_solver.assemble(self.blocks)
                object.__setattr__(self, "_assembled", True)
            solution, _ = tools.linear_solver.solve(tools.freed(right), _EXACT, convex=False)
            if solution is not None and np.isfinite(solution).all():
                return solution, np.zeros(0)
        whole = np.concatenate([self.T.T @ right.ravel(), of_conditions, np.zeros(self.G.shape[1])])
        u = self.T.shape[1]
        if u == 0:
            return np.zeros_like(right), np.zeros(len(self.rows))
        solved = self._factors.solve(whole, trans=way)
        if not np.isfinite(solved).all():
            raise SolverError("gradient: the equations of a step are singular; something is free to move at no cost")
        return (self.T @ solved[:u]).reshape(-1, 3), solved[u : u + len(self.rows)]

    def _symmetric_product(self, way: Floats) -> Floats:
        nodes, out = self.replay.workspace.system.elements, np.zeros((len(way) + 1, 3))
        # One row more, for the nodes without a vertex, number -1.
        own = np.concatenate([way, np.zeros((1, 3))])[nodes].reshape(-1, 12, 1)
        np.add.at(out, nodes, (self.blocks.elements @ own).reshape(-1, 4, 3))
        out = out[:-1] + np.einsum("nij,nj->ni", self.blocks.vertices, way)
        for part in (*self.blocks.beyond_elements, *self.blocks.low_rank):
            part.add_product(way, out)
        return out

    @cached_property
    def T(self) -> Any:
        return unknowns(self.replay.workspace.system)

    @cached_property
    def G(self) -> Any:
        size = self.replay.x.size
        columns = (column(part.vertices, part.vector, size) for part in self.blocks.low_rank)
        return csr_array(block_array([[csr_array((size, 0)), *columns]]))

    @cached_property
    def K(self) -> Any:
        """(3 n, 3 n) dg/dx without actuators' G G^T."""
        K = hessian_matrix(self.blocks, self.replay.workspace.system.elements, len(self.replay.x))
        return csr_array(K if self.lag is None else K + self.lag)

    @cached_property
    def _factors(self) -> Any:
        K, C, G = self.T.T @ self.K @ self.T, self.C @ self.T, self.T.T @ self.G
        c, g = C.shape[0], G.shape[1]
        if c + g:
            K = block_array([[K, C.T, G], [C, None, csr_array((c, g))], [G.T, None, -eye_array(g)]])
        try:
            return splu(K.tocsc())
        except RuntimeError as error:
            raise SolverError(f"gradient: the equations of a step are singular ({error})") from None


def _conditions(replay: Replay) -> tuple[Any, NDArray[np.int64], NDArray[np.int64], int]:
    """C (c, 3 n) of independent conditions, which ones of `Replay.conditions` they are, which laws are among them,
    and the number of all."""
    x, found = replay.x, []
    for actuator in replay.posed.actuators:
        if isinstance(actuator.law, Held):
            own = actuator.coordinate.vertices
            gradient = actuator.coordinate.gradient(x[own])
            found.append(conditions_of(np.zeros(len(own), dtype=np.int64), own, gradient, 1, x.size))
    held = np.zeros(0, dtype=np.int64)
    if replay.joints is not None:
        laws = replay.joints.laws
        if len(laws.table):
            g = replay.joints.coordinates(x)[laws.table["function"]]
            active = laws.table["adapts"] & (laws.stiffness(g, replay.joints.law_multipliers) > 0.0)
            held = np.flatnonzero(active)
            held = held[np.unique(laws.table["function"][held], return_index=True)[1]]
        found.append(joint_conditions(replay.joints, x))
    C: Any = csr_array(stacked(found, x.size))
    rows = independent(csr_array(C @ unknowns(replay.workspace.system))) if C.shape[0] else np.zeros(0, dtype=np.int64)
    return C[rows], rows, held, C.shape[0]
