"""The solvers by their kind."""

from __future__ import annotations

from supple.errors import SolverError
from supple.kinds.suggestion import suggestion
from supple.solvers.auto import Auto
from supple.solvers.implicit.solver import Implicit
from supple.solvers.solver import Solver
from supple.solvers.xpbd.solver import XPBD

SOLVERS: list[type[Solver | Auto]] = [XPBD, Implicit, Auto]


def solver_of_kind(kind: str) -> Solver | Auto:
    """The solver of that kind, with its default parameters.

    Raises
    ------
    SolverError : where no such kind exists.
    """
    known = {solver.kind: solver for solver in SOLVERS}
    if kind not in known:
        raise SolverError(f"solver {kind!r} does not exist; {suggestion(kind, list(known))}")
    return known[kind]()
