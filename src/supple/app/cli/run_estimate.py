"""What a run will take, said while it runs, and a faster way where there is one."""

from __future__ import annotations

import time
from dataclasses import replace

from supple.model.system import System
from supple.results.frame import Frame
from supple.solvers.auto import cost_of_frame
from supple.solvers.implicit.solver import Implicit
from supple.solvers.solver import Solver
from supple.solvers.xpbd.solver import XPBD

# Said after so many seconds of frames, and only where so many remain [s]; again where it has become so many times more.
_AFTER, _LEAST, _AGAIN = 5.0, 30.0, 2.0
# Of the cost by counts: what is not cheaper than this is not suggested.
_GAIN = 0.7
_ROUGH = 0.1


class RunEstimate:
    """A sink that prints how long the rest of the run takes at the pace of the latest frames.

    The first frame does not count: kernels are compiled in it. It is said again where frames have become slower, as at
    an impact.
    """

    def begin(self, first: Frame, dt: float, steps: int) -> None:
        self._dt, self._left, self._said = dt, steps, 0.0
        self._began: float | None = None
        self._seconds: list[float] = []

    def write(self, frame: Frame) -> None:
        from supple.results.progress import error_console

        self._left -= 1
        if self._began is None:
            self._began = time.perf_counter()
            return
        self._seconds.append(frame.report.wall_seconds)
        if sum(self._seconds) < _AFTER:
            return
        latest = self._seconds[-max(3, len(self._seconds) // 4) :]
        rest = self._left * sum(latest) / len(latest)
        if rest < _LEAST or rest < _AGAIN * self._said or not frame.report.status.can_go_on:
            return
        assert frame.solver is not None
        ways = [] if self._said else faster_ways(frame.solver, frame.system, self._dt)
        faster = f"; faster: {', or '.join(ways)}" if ways else ""
        text = f"about {_in_words(rest)} more for {self._left} frames{faster}"
        error_console().print(text, soft_wrap=True, highlight=False, markup=False)
        self._said = rest

    def end(self) -> None: ...


def faster_ways(solver: Solver, system: System, dt: float) -> list[str]:
    """What would make frames of dt [s] faster, by counts; the fastest first, and fewer tets last."""
    others: list[tuple[Solver, str]] = []
    if isinstance(solver, XPBD):
        others.append((Implicit(), "solver: {kind: implicit}"))
        if solver.substeps == "auto" and solver.accuracy < _ROUGH:
            rough = f"solver: {{kind: xpbd, accuracy: {_ROUGH}}}, which is softer"
            others.append((XPBD(accuracy=_ROUGH), rough))
    elif isinstance(solver, Implicit):
        others.append((XPBD(), "solver: {kind: xpbd}"))
        if solver.integrator not in ("static", "newmark"):
            one = "solver: {kind: implicit, max_iterations: 1}, one linearization a step"
            others.append((replace(solver, max_iterations=1), one))
    now = cost_of_frame(solver, system, dt)
    ways = sorted((cost_of_frame(other, system, dt), text) for other, text in others)
    return [text for cost, text in ways if cost < _GAIN * now] + ["fewer tets"]


def _in_words(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
