"""The interface of solvers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, Self

from supple.errors import SolverError
from supple.kinds.kind import Kind
from supple.model.state import SolverDetails, State, StepReport
from supple.model.system import System
from supple.scene.scene import Scene

# Of a simulation by XPBD, at most, for each tet and its share of vertices, edges and surface. Measured: 970 on a cube
# of 83,000 tets, 1600 on three thin plates in contact.
_BYTES_PER_TET = 2000


class Solver(Kind, ABC):
    """An immutable description of a method and its parameters; what changes is in the State and the workspace.

    Attributes
    ----------
    because : why `Auto` has chosen it; "" otherwise. Solvers that differ only in this are equal.
    """

    error = SolverError
    because: str = ""

    @property
    def label(self) -> str:
        """The name of the solver in messages."""
        return type(self).__name__

    def bytes_needed(self, scene: Scene) -> int:
        """Estimate of the memory that a simulation takes beyond that of the program itself [bytes].

        Solvers with other needs than arrays of the scene's size override this method.
        """
        return _BYTES_PER_TET * sum(len(body.mesh.tets) for body in scene.bodies)

    @property
    def account(self) -> str:
        """The solver with its parameters, and why it was chosen."""
        return f"{self}, chosen: {self.because}" if self.because else str(self)

    def chosen(self, because: str) -> Self:
        """This solver, which was not chosen by the user, with the reason."""
        object.__setattr__(self, "because", because)
        return self

    def refuse(self, system: System) -> None:
        """Raise where this solver cannot work with something in the scene; `prepare` does this first.

        Solvers that work with everything do not override this method.

        Raises
        ------
        SolverError : the text names the thing.
        """
        return

    @abstractmethod
    def prepare(self, system: System) -> Any:
        """What is computed once for a system: colorings, sparsity patterns, work arrays.

        Raises
        ------
        SolverError : where this solver cannot work with something in the scene; the text names it.
        """

    def check(self, system: System, state: State, workspace: Any) -> None:
        """Raise where this solver cannot start from `state`. `simulate` calls it before anything is written.

        Solvers that start from any state do not override this method.

        Raises
        ------
        SceneError, SolverError : the text names what is wrong with the state.
        """
        return

    def initial_details(self, system: System, workspace: Any) -> SolverDetails:
        """The details of the start, before any step: of the type and with the names that all steps have."""
        return SolverDetails()

    @abstractmethod
    def step(self, system: System, state: State, dt: float, workspace: Any) -> tuple[State, StepReport]:
        """Advance `state` by `dt` [s]. Where that is impossible, return the last good state and the reason."""
