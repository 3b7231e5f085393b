"""Joints and rigid bodies in a step of the midpoint rule: conditions at its end, with forces in its middle.

Conditions g hold at the end of a step, and their forces act along their gradients in the middle (Betsch, Steinmann,
"Constrained integration of rigid body dynamics", 2001). Where g is at most quadratic, as of all conditions that always
hold, these forces do no work, and they keep both momenta:

    grad g((x_n + x) / 2) . (x - x_n) = g(x) - g(x_n) = 0.

The method of multipliers finds them with the energy lambda . g in the middle, and k |g|^2 / 2 at the end, which
vanishes where the conditions hold. Motors that are springs, damping and given efforts act in the middle.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.model.joints.at_state import coordinates_at
from supple.model.joints.geometry import JointGeometry
from supple.model.joints.laws import Laws, laws_of
from supple.model.state import State
from supple.solvers.implicit.energies.midpoint import ActingWithin
from supple.solvers.implicit.energies.potential import Potential
from supple.solvers.implicit.joints.impacts import agree, stop_at_laws
from supple.solvers.implicit.joints.joint_step import INERTIA, JointStep
from supple.solvers.implicit.joints.potential import JointPotential
from supple.solvers.implicit.joints.rigidity import Rigidity
from supple.solvers.implicit.newton.direction import Tools

# The stiffness of rigidity in multiples of that of inertia. A joint far outside of a thin body adds a few hundred times
# the body's own inertia to a stretch across it.
_RIGID = 1e4


@dataclass(eq=False, kw_only=True)
class MidpointJoints(JointStep):
    """As `JointStep`, whose `potential` is that of conditions, limits, friction and velocities at the end of the step.

    Attributes
    ----------
    rigidity : of the bodies at the end; start : (n, 3) x_n [m]
    begin : of the step [s]; place, middle : where forces act, as a share of the step, and when [s]
    others : laws whose multipliers (l,) stay, in the middle
    impact : whose forces at the end have the impulses of an impact, see `impacts`
    """

    held: ClassVar[float] = 1e-9

    rigidity: Rigidity
    start: NDArray[np.float64]
    begin: float
    place: float
    middle: float
    others: tuple[Laws, NDArray[np.float64]]
    impact: JointPotential | None = None

    @property
    def terms(self) -> list[Potential]:
        """What vanishes at the end of the step where all holds, and what acts in the middle."""
        conditions = self.potential
        changing, _ = conditions.laws.parts(conditions.law_multipliers)
        zeros = np.zeros_like(conditions.multipliers), np.zeros_like(conditions.law_multipliers)
        ends = replace(conditions, laws=changing, multipliers=zeros[0], law_multipliers=zeros[1])
        penalty, pull = self.rigidity.parts()
        within = (ActingWithin(term, self.start, self.place) for term in (self._acting, pull))
        return [ends, penalty, *within]

    @property
    def _acting(self) -> JointPotential:
        conditions = self.potential
        _, constant = conditions.laws.parts(conditions.law_multipliers)
        laws, multipliers = self.others
        return replace(
            conditions,
            time=self.middle,
            stiffness=np.zeros_like(conditions.stiffness),
            laws=constant.and_those(laws),
            law_multipliers=np.concatenate([conditions.law_multipliers, multipliers]),
            weight=1.0,
        )

    def renew(self, x: NDArray[np.float64]) -> None:
        super().renew(x)
        self.rigidity = replace(self.rigidity, multipliers=self.rigidity.forces(x))

    def largest_violation(self, x: NDArray[np.float64]) -> float:
        return max(super().largest_violation(x), self.rigidity.violation(x))

    def acting(self, x: NDArray[np.float64]) -> list[tuple[JointPotential, NDArray[np.float64]]]:
        in_the_middle = self._renewed(x)._acting, self.start + self.place * (x - self.start)
        return [in_the_middle] if self.impact is None else [in_the_middle, (self.impact, x)]

    def finish(
        self, x: NDArray[np.float64], velocities: NDArray[np.float64], residual: NDArray[np.float64], tools: Tools
    ) -> float:
        """Give the bodies their velocities (n, 3) at the end x (n, 3) of a step, in place.

        They are those of the balance of momentum with all forces in the middle, those of the penalties too, and of the
        laws that act. The residual (n, 3) [N] of the step is zero on the bodies afterwards. Returned is the work of an
        impact [J].
        """
        before, latest = np.zeros_like(x), self._renewed(x)
        for term in self.terms:
            term.add_gradient(x, before)
        after = np.zeros_like(x)
        for term in latest.terms[2:]:
            term.add_gradient(x, after)
        residual += self.place * (after - before)
        h = self.potential.time - self.begin
        reduction = tools.linear_solver.reduction
        if reduction is not None:
            reduction.reduce(residual)
        self.rigidity.settle(residual, velocities, h)
        stopped = stop_at_laws(latest.potential, self.rigidity, x, velocities, self.begin)
        if reduction is not None:
            reduction.welding.follow(velocities)
        if stopped is None:
            return 0.0
        self.impact, work = stopped
        return work

    def _renewed(self, x: NDArray[np.float64]) -> MidpointJoints:
        """With the multipliers that balance the forces at x (n, 3)."""
        latest = replace(self)
        latest.renew(x)
        return latest


def agreeing(geometry: JointGeometry, rigidity: Rigidity, start: State, h: float) -> State:
    """The state with the nearest velocities that agree with its joints, before a step of h [s]."""
    if not len(rigidity.corners):
        return start
    laws, multipliers = Laws.of([])
    joints, rows = np.zeros(len(geometry.joints)), np.zeros((len(geometry.differences.joint), 3))
    g = coordinates_at(geometry, start)
    potential = JointPotential(geometry, start.time, joints, laws, g, rows, multipliers)
    velocities = start.velocities.copy()
    pieces = np.unique(geometry.system.joined_components)
    agree(potential, rigidity, start.positions, velocities, start.time - h, {}, pieces)
    geometry.system.welding.follow(velocities)
    return replace(start, velocities=velocities)


def joints_in_step(
    geometry: JointGeometry | None,
    rigidity: Rigidity | None,
    start: State,
    times: tuple[float, float],
    scale: float | None,
    place: float,
) -> JointStep | None:
    """The joints of a step between two times [s] from a state, None where there are none.

    Parameters
    ----------
    rigidity : of bodies that have no energy which keeps them rigid, or None
    scale : s of the inertia term [s^2], or None; place : where forces act, see `Plan`
    """
    if geometry is None:
        return None
    if rigidity is None or scale is None:
        return JointStep.of(geometry, start, times, scale, 1.0 / place)
    weight = 1.0 / place
    stiffness = INERTIA * geometry.masses / (weight * scale)
    g = coordinates_at(geometry, start)
    middle = times[0] + place * (times[1] - times[0])
    laws, multipliers = laws_of(geometry, stiffness, g, times, moving=True, mean=middle)
    at_middle, constants = laws_of(geometry, stiffness, g, (times[0], middle), moving=True)
    zero = np.zeros((len(geometry.differences.joint), 3))
    conditions = laws.selected(laws.adapts), multipliers[laws.adapts]
    return MidpointJoints(
        geometry,
        JointPotential(geometry, times[1], stiffness, conditions[0], g, zero, conditions[1], weight),
        rigidity=replace(rigidity, k=_RIGID / (weight * scale) * rigidity.k, weight=weight),
        start=start.positions,
        begin=times[0],
        place=place,
        middle=middle,
        others=(at_middle.selected(~at_middle.adapts), constants[~at_middle.adapts]),
    )
