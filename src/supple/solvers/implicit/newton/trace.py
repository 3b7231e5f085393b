"""One row of numbers for every Newton iteration."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class NewtonRow:
    """One iteration.

    Attributes
    ----------
    iteration : from 0; extension iterations, which bring pins to their places, count separately
    energy : of the objective after the step [J]; force : largest component of the gradient before it [N]
    direction : largest component of the Newton direction [m]
    linear_solver : "pcg", "direct" or "none"; linear_iterations : of CG; linear_tolerance : required of CG
    filter : largest step that inversion and contact allow, at most 1; step : taken, as a share of the direction;
        above 1 where it was made longer
    cuts : how often the line search halved the step
    limit : what made the step shorter: a tet or a pair in contact, "energy" where it was halved; "" for a whole step
    projected : whether the Hessian was that of the convex model
    kind : "newton", or "extension" where pins were moved
    substep : number of the substep within the step
    """

    iteration: int
    energy: float
    force: float
    direction: float
    linear_solver: str
    linear_iterations: int
    linear_tolerance: float
    filter: float
    step: float
    cuts: int
    limit: str = ""
    projected: bool = True
    kind: str = "newton"
    substep: int = 0
