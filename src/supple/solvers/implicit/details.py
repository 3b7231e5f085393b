"""What the implicit solver reports of a step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from supple.model.state import SolverDetails
from supple.solvers.implicit.newton.trace import NewtonRow

Forces = Mapping[str, NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class ImplicitDetails(SolverDetails):
    """What `Implicit` reports of a step. A recording keeps all but the last two.

    Forces are those at the end of the step. They are empty where no substep succeeded.

    Attributes
    ----------
    contacts : number of pairs (vertex-triangle, edge-edge, vertex-half-space) nearer than `dhat`
    newton_iterations : of all substeps, also of those that were repeated with half the length
    extension_iterations : those that moved pins to their places
    cg_iterations : of the conjugate gradient method, in all linear solves
    linear_solves : systems that were solved; with `max_iterations` of 1 to 3, at most three times as many in a substep,
        and one more where a matrix was found to be indefinite
    direct_solves : those by factorization
    searches : for pairs of surfaces that may touch
    line_search_cuts : how often a step was halved
    filter_steps : iterations in which inversion or contact limited the step
    substeps : how many substeps succeeded
    dhat : distance at which contact begins [m]; None without contact
    contact_stiffness : of the barrier at the end [Pa]; None without contact
    contact_forces, friction_forces : by name of the body or obstacle, (3,) [N]; each sum to zero
    orthogonality_errors : |F^T F - 1| of the rigid bodies, by name [-]
    weld_forces : of the rigid bodies on the soft ones that are welded to them, by name of the weld, (3,) [N]
    time_error : estimate of the error of the positions that the integrator added in the step, the root mean square over
        the mass [m]: of backward Euler half a step times the change of velocity, of BDF2 the next order; else None
    unbalanced_force : norm of what Newton's method has left on all free vertices [N]
    seconds : of wall time, by part of the step; see `supple.solvers.implicit.timings`
    reaction_forces_by_vertex : by label of the pin, (k, 3) [N]
    newton : every iteration
    """

    newton_iterations: int = 0
    extension_iterations: int = 0
    cg_iterations: int = 0
    linear_solves: int = 0
    direct_solves: int = 0
    searches: int = 0
    line_search_cuts: int = 0
    filter_steps: int = 0
    substeps: int = 0
    dhat: float | None = None
    contact_stiffness: float | None = None
    contact_forces: Forces = field(default_factory=dict)
    friction_forces: Forces = field(default_factory=dict)
    orthogonality_errors: Mapping[str, float] = field(default_factory=dict)
    weld_forces: Forces = field(default_factory=dict)
    time_error: float | None = None
    unbalanced_force: float = 0.0
    seconds: Mapping[str, float] = field(default_factory=dict)
    reaction_forces_by_vertex: Forces = field(default_factory=dict, compare=False)
    newton: Sequence[NewtonRow] = field(default=(), compare=False)

    @classmethod
    def of_rows(cls, rows: Sequence[NewtonRow], substeps: int) -> ImplicitDetails:
        """The counts over all iterations of a step with that many successful substeps."""
        return cls(
            newton_iterations=sum(row.kind == "newton" for row in rows),
            extension_iterations=sum(row.kind == "extension" for row in rows),
            cg_iterations=sum(row.linear_iterations for row in rows),
            direct_solves=sum(row.linear_solver == "direct" for row in rows),
            line_search_cuts=sum(row.cuts for row in rows),
            filter_steps=sum(row.filter < 1.0 for row in rows),
            substeps=substeps,
            newton=rows,
        )
