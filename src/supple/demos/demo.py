"""What a demo is: a scene, a solver for it, and claims that are measured while it runs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from supple.errors import SolverError
from supple.scene.scene import Scene
from supple.simulate import Frame
from supple.solver import Solver


@dataclass(frozen=True)
class Claim:
    """One sentence that the run has put to the test.

    Attributes
    ----------
    text : what is claimed, with its limit; measured : what came out; holds : whether it is so.
    """

    text: str
    measured: str
    holds: bool


class Measurement(ABC):
    """A sink that watches a demo and says at the end which of its claims hold."""

    def begin(self, first: Frame, dt: float, steps: int) -> None:
        """Called with the frame at the start."""

    @abstractmethod
    def write(self, frame: Frame) -> None:
        """Called with every frame."""

    def end(self) -> None:
        """Called when the run is over."""

    @abstractmethod
    def claims(self) -> list[Claim]:
        """What was claimed, and what was measured."""


@dataclass(frozen=True)
class Demo:
    """A named scene.

    Attributes
    ----------
    name, summary : for the list of demos; explanation : a paragraph on what to look at
    scene : builds the scene; measurement : builds the sink that judges the claims
    solvers : by kind ("xpbd", "implicit"), each builds the solver; the first is the default
    dt : time from frame to frame [s]; steps : how many frames
    """

    name: str
    summary: str
    explanation: str
    scene: Callable[[], Scene]
    solvers: Mapping[str, Callable[[], Solver]]
    measurement: Callable[[], Measurement]
    dt: float
    steps: int

    def solver(self, kind: str | None = None) -> Solver:
        """The solver of that kind, or the default one.

        Raises
        ------
        SolverError : where this demo does not run on it.
        """
        kind = next(iter(self.solvers)) if kind is None else kind
        if kind not in self.solvers:
            raise SolverError(
                f"demo {self.name!r}: there is no solver {kind!r} for it; it has {', '.join(self.solvers)}"
            )
        return self.solvers[kind]()
