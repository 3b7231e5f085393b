"""`Auto`: the solver that suits a scene, by counts alone, so that every machine has the same answer.

A frame of XPBD takes n substeps, where n keeps the stiffness of bodies within the accuracy (`Softening`): it grows with
dt and with the frequency of a tet alone, sqrt(E / density) / edge. A frame of `Implicit` takes some iterations of
Newton's method, which are few whatever the stiffness. In milliseconds of one core of an AMD EPYC,

    XPBD       n (0.15 + 0.08 m + 0.07 b + 1.0 j)
    Implicit   i (1.2 + 2.1 m)

with m thousands of tets, b the number of bodies where there are several, j 1 where there are joints or welds, and i = 4
iterations for one body, 9 with joints or welds, 12 for several bodies, which touch each other. Only the quotient of the
two counts. The constants are fitted to scenes of 4 to 25,560 tets, E = 1e3 to 1e9 Pa, 5 mm to 1 m, with and without
contact, joints and several bodies: notes/measured_trials.md has the table.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, NamedTuple

from supple.errors import SolverError
from supple.kinds.kind import Kind
from supple.kinds.validators import SHARE
from supple.model.system import System
from supple.solvers.solver import Solver

# [ms] of a substep of XPBD: at all, for 1000 tets, for each of several bodies, for joints; see above.
_SUBSTEP, _SUBSTEP_TETS, _SUBSTEP_BODY, _SUBSTEP_JOINTS = 0.15, 0.08, 0.07, 1.0
# [ms] of an iteration of Newton's method: at all, for 1000 tets.
_ITERATION, _ITERATION_TETS = 1.2, 2.1
# Iterations of a frame: of one body, with joints or welds, of several bodies.
_ALONE, _JOINED, _SEVERAL = 4, 9, 12
# Iterations that a frame costs beside those that are asked for.
_OTHER_ITERATIONS = 0.6


class Counts(NamedTuple):
    """What the choice depends on.

    Attributes
    ----------
    substeps : that XPBD takes in a frame where nothing moves fast; body : that needs them, or ""
    joined : whether there are joints or welds
    """

    substeps: int
    body: str
    tets: int
    bodies: int = 1
    joined: bool = False

    @classmethod
    def of(cls, system: System, dt: float, accuracy: float) -> Counts:
        """Those of a system in frames of dt [s], with the accuracy of XPBD."""
        from supple.solvers.xpbd.assessment.softening import Softening
        from supple.solvers.xpbd.substeps import FEWEST

        count, body = Softening(system).substeps(dt, accuracy, None)
        substeps, stiff = (count, body) if count > FEWEST else (FEWEST, "")
        joined = bool(system.scene.joints or system.scene.welds)
        return cls(substeps, stiff, len(system.tets), len(system.bodies), joined)

    @property
    def xpbd(self) -> float:
        """What a frame costs [ms]."""
        bodies = self.bodies if self.bodies > 1 else 0
        each = _SUBSTEP + _SUBSTEP_TETS * self.tets / 1000 + _SUBSTEP_BODY * bodies
        return self.substeps * (each + _SUBSTEP_JOINTS * self.joined)

    @property
    def implicit(self) -> float:
        """What a frame costs [ms]."""
        return self._newton(_JOINED if self.joined else _SEVERAL if self.bodies > 1 else _ALONE)

    def linearized(self, iterations: int) -> float:
        """What a frame costs of `Implicit(max_iterations=1)` to 3 [ms]."""
        return self._newton(iterations + _OTHER_ITERATIONS)

    def _newton(self, iterations: float) -> float:
        return iterations * (_ITERATION + _ITERATION_TETS * self.tets / 1000)

    def __str__(self) -> str:
        why = f" for the stiffness of body {self.body!r}" if self.body else ""
        return f"XPBD needs {self.substeps:,} substeps a frame{why}"


@dataclass(frozen=True)
class Auto(Kind):
    """The solver that suits the scene, `XPBD` or `Implicit`: by the substeps that XPBD needs, tets, bodies and joints.

    The answer depends on the scene and dt alone, not on the machine. `because` of the chosen solver gives the reason.

    Parameters
    ----------
    accuracy : of `XPBD`: the share of its stiffness that a body may lack. A larger one needs fewer substeps.
    """

    kind: ClassVar[str] = "auto"
    error = SolverError

    accuracy: Annotated[float, SHARE] = 0.02

    def both(self) -> tuple[Solver, Solver]:
        """`XPBD` and `Implicit`, as this class chooses them."""
        from supple.solvers.implicit.solver import Implicit
        from supple.solvers.xpbd.solver import XPBD

        return XPBD(accuracy=self.accuracy), Implicit()

    def choices(self, system: System, dt: float) -> Sequence[Solver]:
        """The solvers that can simulate the system in frames of dt [s], the one that suits it first.

        Raises
        ------
        SolverError : where none of them can; the text is that of `XPBD`.
        """
        refused: list[SolverError] = []
        able: list[Solver] = []
        for solver in self.both():
            try:
                solver.refuse(system)
                able.append(solver)
            except SolverError as error:
                refused.append(error)
        if not able:
            raise refused[0]
        if refused:
            return [able[0].chosen(str(refused[0]))]
        counts = Counts.of(system, dt, self.accuracy)
        first, other = able if suits_xpbd(counts) else reversed(able)
        return [first.chosen(str(counts)), other]


def suits_xpbd(counts: Counts) -> bool:
    """Whether XPBD suits a scene that it can simulate: it is cheaper, and may take as many substeps as it needs."""
    from supple.solvers.xpbd.solver import XPBD

    return counts.substeps <= XPBD.max_substeps and counts.xpbd <= counts.implicit


def cost_of_frame(solver: Solver, system: System, dt: float) -> float:
    """What a frame of dt [s] costs by counts [ms]; infinite where the solver cannot simulate the system."""
    from supple.solvers.implicit.solver import Implicit
    from supple.solvers.xpbd.solver import XPBD

    try:
        solver.refuse(system)
    except SolverError:
        return math.inf
    counts = Counts.of(system, dt, solver.accuracy if isinstance(solver, XPBD) else XPBD.accuracy)
    if isinstance(solver, XPBD):
        used = min(counts.substeps, solver.max_substeps) if solver.substeps == "auto" else solver.substeps
        return counts._replace(substeps=used).xpbd
    if isinstance(solver, Implicit) and solver.max_iterations <= 3:
        return counts.linearized(solver.max_iterations)
    return counts.implicit


def solver_for(solver: Solver | Auto, system: System, dt: float) -> Solver:
    """The solver; of `Auto`, the one that suits the system in frames of dt [s]."""
    return solver.choices(system, dt)[0] if isinstance(solver, Auto) else solver
