"""Solvers of a scene file, by `kind`."""

from __future__ import annotations

from supple.app.scene_file.entries.kinds import KindModel, model_of
from supple.app.scene_file.validation_errors import suggestion
from supple.errors import SolverError
from supple.solvers.implicit.solver import Implicit
from supple.solvers.solver import Solver
from supple.solvers.xpbd.solver import XPBD

SOLVERS: tuple[type[Solver], ...] = (XPBD, Implicit)


def solver_of_kind(kind: str) -> Solver:
    """The solver of that kind, with its default parameters.

    Raises
    ------
    SolverError : where there is no such kind.
    """
    known = {solver.kind: solver for solver in SOLVERS}
    if kind not in known:
        raise SolverError(f"there is no solver {kind!r}; {suggestion(kind, known)}")
    return known[kind]()


def model_of_kind(kind: str) -> KindModel:
    """The solver of that kind, with its default parameters, as a scene file describes it.

    Raises
    ------
    SolverError : where there is no such kind.
    """
    return model_of(type(solver_of_kind(kind)), True).model_validate({"kind": kind})
