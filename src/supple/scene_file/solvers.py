"""Solvers of a scene file, by `kind`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from supple.errors import SolverError
from supple.scene_file.complaints import suggestion
from supple.scene_file.model import Model
from supple.solver import Solver
from supple.xpbd.solver import XPBD


class XPBDModel(Model):
    """Extended position-based dynamics in small steps."""

    kind: Literal["xpbd"]
    substeps: int = Field(
        default=20, ge=1, le=100_000, description="per frame, each with one sweep over all constraints"
    )
    momentum_restore: bool = Field(default=True, description="false shows what XPBD does to momentum without")
    threads: int | None = Field(default=None, ge=1, le=1024, description="as the scene's size asks for, without it")

    def build(self) -> Solver:
        return XPBD(substeps=self.substeps, momentum_restore=self.momentum_restore, threads=self.threads)


SolverModel = XPBDModel

SOLVERS = {"xpbd": XPBD}


def solver_of_kind(kind: str) -> Solver:
    """The solver of that kind, with its default parameters.

    Raises
    ------
    SolverError : where there is none.
    """
    if kind not in SOLVERS:
        raise SolverError(f"there is no solver {kind!r}; {suggestion(kind, SOLVERS)}")
    return SOLVERS[kind]()
