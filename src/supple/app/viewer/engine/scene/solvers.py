"""The solvers that a page can select, and the parameters of these solvers that it can change."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from supple.app.viewer.protocol.parameters import PARAMETERS, Value
from supple.errors import CommandError
from supple.solvers.solver import Solver


def _xpbd() -> Solver:
    from supple.solvers.xpbd.solver import XPBD

    return XPBD()


def _implicit() -> Solver:
    from supple.solvers.implicit.solver import Implicit

    # A step with hundreds of iterations is too slow for an interactive page.
    return Implicit(max_substeps=8)


SOLVERS: dict[str, Callable[[], Solver]] = {"xpbd": _xpbd, "implicit": _implicit}


# The number of substeps that stands for "auto" on a page.
AUTOMATIC = 0


def kind_of(solver: Solver) -> str:
    """The name of a solver on the page: that of its class, in lower case."""
    return type(solver).__name__.lower()


def solver_values(solver: Solver) -> dict[str, Value]:
    """The parameters of the solver that a page can change."""
    values: dict[str, Value] = {}
    for name in _fields(solver):
        if name in PARAMETERS and PARAMETERS[name].owner == "solver":
            value = getattr(solver, name)
            values[name] = value is not None if name == "contact" else AUTOMATIC if value == "auto" else value
    return values


def with_value(solver: Solver, name: str, value: Value) -> Solver:
    """The solver with one parameter changed; raises `CommandError` where it has no such parameter."""
    fields = _fields(solver)
    if name not in fields:
        raise CommandError(f"the solver {kind_of(solver)} has no parameter {name}")
    changed: object = value
    if name == "substeps" and value == AUTOMATIC:
        changed = "auto"
    if name == "contact":
        changed = getattr(solver, name) or getattr(type(solver)(), name) if value else None
    return dataclasses.replace(solver, **{name: changed})  # pyright: ignore[reportArgumentType]


def _fields(solver: Solver) -> set[str]:
    return {field.name for field in dataclasses.fields(solver)}  # pyright: ignore[reportArgumentType]
