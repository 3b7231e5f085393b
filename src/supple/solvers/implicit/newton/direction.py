"""Newton directions: an inexact solution of H p = -g, with a Hessian that is positive definite.

The tolerance of the linear solver follows the decrease of the gradient (Eisenstat, Walker). A Hessian that is not fully
projected may be indefinite: every linear solver detects this, and more terms are then projected.

Source: Eisenstat, Walker, "Choosing the Forcing Terms in an Inexact Newton Method" (1996), choice 2.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from supple.numerics.inner_product import inner
from supple.solvers.implicit.energies.potential import HessianBlocks
from supple.solvers.implicit.newton.free_motion import FreeMotion
from supple.solvers.implicit.newton.hessian_projection import ProjectedTerms, ProjectionPolicy
from supple.solvers.implicit.newton.linear_solver import LinearReport, LinearSolver
from supple.solvers.implicit.newton.objective import Model, Objective
from supple.solvers.implicit.newton.trace import NewtonRow
from supple.solvers.implicit.timings import Clock

# The relative tolerance of linear systems: 1e-2 at first, since a better solution of a poor model does not help; below
# 1e-8 round-off in the gradient makes up the rest of it.
_LOOSEST = 1e-2
_TIGHTEST = 1e-8

# The tolerance of the last system where surfaces touch, below `Implicit.force_tolerance`: its error times the stiffness
# of contact has to be less than the forces that may remain.
_LAST = 1e-5


@dataclass(frozen=True, eq=False)
class Tools:
    """The data that is kept from step to step: linear solver, memory for Hessians, pinned vertices, free pieces."""

    linear_solver: LinearSolver
    hessian: HessianBlocks
    pinned: NDArray[np.int32]
    free_motion: FreeMotion
    clock: Clock = field(default_factory=Clock)

    def freed(self, gradient: NDArray[np.float64]) -> NDArray[np.float64]:
        """A gradient (n, 3) by the free vertices: zero where pinned or welded."""
        reduction = self.linear_solver.reduction
        out = gradient.copy() if reduction is None else reduction.welding.reduced(gradient)
        out[self.pinned] = 0.0
        return out


@dataclass(frozen=True, eq=False)
class Direction:
    """A Newton direction.

    Attributes
    ----------
    vector : (n, 3) [m], zero where pinned; length : its largest component [m]
    slope : of the energy along it [J]; force : largest component of the gradient on free vertices [N]
    linear : how the system was solved; tolerance : of the linear solver
    projected : the terms whose Hessians were projected; touching : whether contact is part of the Hessian
    """

    vector: NDArray[np.float64]
    length: float
    slope: float
    force: float
    linear: LinearReport
    tolerance: float
    projected: ProjectedTerms
    touching: bool


def newton_row(
    iteration: int, energy: float, found: Direction, taken: tuple[float, float, int], reason: str
) -> NewtonRow:
    """The record of a step along a direction.

    Parameters
    ----------
    energy : at its end [J]; taken : what filters allowed, the length, and how often it was halved; reason : of filters
    """
    largest, step, cuts = taken
    return NewtonRow(
        iteration=iteration,
        energy=energy,
        force=found.force,
        direction=found.length,
        linear_solver=found.linear.method,
        linear_iterations=found.linear.iterations,
        linear_tolerance=found.tolerance,
        filter=largest,
        step=step,
        cuts=cuts,
        limit="; ".join(([reason] if reason else []) + (["energy"] if cuts else [])),
        projected=found.projected is ProjectedTerms.ALL,
    )


@dataclass(eq=False)
class DirectionFinder:
    """The directions of one minimization.

    Attributes
    ----------
    scale : s of the inertia term [s^2], or None
    short : length [m] of a step that is the last one, for which a system with contact is solved more exactly
    longest : largest component [m] that a direction may have without inertia
    policy : which terms are projected; forcing : tolerance of the next linear system; last_norm : of the last residual
    """

    objective: Objective
    tools: Tools
    scale: float | None
    short: float
    longest: float
    policy: ProjectionPolicy = field(default_factory=ProjectionPolicy)
    forcing: float = _LOOSEST
    last_norm: float = 0.0

    def find(self, here: Model) -> Direction | None:
        """The direction from a point whose Hessian is in `tools.hessian`; None where no system could be solved."""
        tools = self.tools
        gradient = tools.freed(here.gradient)
        vector, report = self._solve(gradient)
        while vector is None and self.policy.now is not ProjectedTerms.ALL:
            self.policy.step_back(bool(tools.hessian.couplings))
            self.objective.model(here.positions, tools.hessian, self.policy.now)
            vector, report = self._solve(gradient)
        if vector is None or not np.isfinite(vector).all():
            return None
        touching = bool(tools.hessian.couplings)
        loose = report.method == "pcg" and self.forcing > _LAST
        if touching and loose and float(np.abs(vector).max(initial=0.0)) <= self.short:
            # Contact is stiff: the error of a loose solution is small in length, and large in force.
            with tools.clock.of("linear_solve"):
                better, more = tools.linear_solver.solve(-gradient, _LAST, self._convex)
            if better is not None and np.isfinite(better).all():
                vector, report = better, replace(report, iterations=report.iterations + more.iterations)
        if self.scale is not None:
            tools.free_motion.joined(tools.hessian.between_bodies).correct(vector, gradient, self.scale)
        else:
            # Without inertia a turn may cost nothing: the direction is as long as the linear solver's errors make it.
            vector *= min(1.0, self.longest / max(float(np.abs(vector).max(initial=0.0)), np.finfo(float).tiny))
        found = Direction(
            vector=vector,
            length=float(np.abs(vector).max(initial=0.0)),
            slope=inner(gradient, vector),
            force=float(np.abs(gradient).max(initial=0.0)),
            linear=report,
            tolerance=self.forcing,
            projected=self.policy.now,
            touching=touching,
        )
        if self.last_norm > 0.0 and report.first_norm > 0.0:
            self.forcing = min(_LOOSEST, max(_TIGHTEST, 0.5 * (report.first_norm / self.last_norm) ** 2))
        self.last_norm = report.first_norm
        return found

    @property
    def _convex(self) -> bool:
        return self.policy.now is ProjectedTerms.ALL

    def _solve(self, gradient: NDArray[np.float64]) -> tuple[NDArray[np.float64] | None, LinearReport]:
        with self.tools.clock.of("linear_solve"):
            self.tools.linear_solver.assemble(self.tools.hessian)
            return self.tools.linear_solver.solve(-gradient, self.forcing, self._convex)
