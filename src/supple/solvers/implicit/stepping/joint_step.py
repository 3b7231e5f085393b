"""The joints in one step: their energy, the update of the multipliers, and what is measured at the end."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from supple.model.joints.at_state import coordinates_at, reported
from supple.model.joints.functions import ANGLE
from supple.model.joints.geometry import JointGeometry
from supple.model.joints.laws import Laws, begin_step, laws_of
from supple.model.state import State, Status
from supple.solvers.implicit.details import ImplicitDetails
from supple.solvers.implicit.energies.joints import JointPotential
from supple.solvers.implicit.newton.minimize import Outcome

# The stiffness of a joint in multiples of that of its bodies against strain, and of inertia in a step. Each update of
# the multipliers divides the violation by about the latter.
_BODIES = 100.0
_INERTIA = 100.0

# A joint holds where its violation is below this share of its size.
_HELD = 1e-7
_MOST_UPDATES = 12
# An update that does not reduce the largest violation below this share of it is the last one.
_GAIN = 0.9


@dataclass(eq=False)
class JointStep:
    """The joints of one step; `potential` is their energy now.

    Attributes
    ----------
    updates : of the multipliers; last : the largest violation before the latest update, in sizes of the joint [-]
    """

    geometry: JointGeometry
    potential: JointPotential
    updates: int = 0
    last: float = field(default=np.inf)

    @classmethod
    def of(cls, geometry: JointGeometry, start: State, times: tuple[float, float], scale: float | None) -> JointStep:
        """A step between two times [s] from a state.

        Parameters
        ----------
        scale : s of the inertia term [s^2], or None
        """
        stiffness = _BODIES * geometry.stiffness
        if scale is not None:
            stiffness = stiffness + _INERTIA * geometry.masses / scale
        g = coordinates_at(geometry, start)
        laws = Laws.of(laws_of(geometry, stiffness, np.array(times), moving=scale is not None))
        begin_step(laws.table, laws.step[0], laws.given[0], g)
        zero = np.zeros((len(geometry.differences.joint), 3))
        multipliers = laws.table["multiplier"].copy()
        return cls(geometry, JointPotential(geometry, times[1], stiffness, laws, g, zero, multipliers))

    def update(self, x: NDArray[np.float64]) -> bool:
        """Whether to continue from x (n, 3) with the multipliers that this call has found there."""
        violation = self.largest_violation(x)
        stuck = violation > _GAIN * self.last and self.updates > 1
        if violation <= _HELD or self.updates == _MOST_UPDATES or stuck:
            return False
        self.updates, self.last = self.updates + 1, violation
        self.renew(x)
        return True

    def renew(self, x: NDArray[np.float64]) -> None:
        """Set the multipliers to what balances the forces at x (n, 3)."""
        multipliers, law_multipliers = self.potential.renewed(x)
        self.potential = replace(self.potential, multipliers=multipliers, law_multipliers=law_multipliers)

    def largest_violation(self, x: NDArray[np.float64]) -> float:
        """Of all conditions at x (n, 3), as a share of sizes."""
        return float(self.violations(x).max(initial=0.0))

    def verified(self, outcome: Outcome) -> Outcome:
        """The outcome, or one that names a joint that does not hold."""
        violations = self.violations(outcome.end.positions)
        if outcome.status is not Status.CONVERGED or not violations.max(initial=0.0) > _HELD:
            return outcome
        j = int(violations.argmax())
        apart = violations[j] * self.geometry.sizes[j]
        text = (
            f"{self.geometry.joints[j].label} is off by {apart:.2e} m: a pin, a script, a limit or another joint "
            "contradicts it"
        )
        return replace(outcome, status=Status.ITERATION_LIMIT, message=text)

    def violations(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(j,) how far the conditions of each joint are from holding, as a share of its size.

        Of a condition that has a largest effort or one direction: the change of effort that is missing, over k.
        """
        geometry, potential = self.geometry, self.potential
        out = np.zeros(len(geometry.joints))
        lengths = np.linalg.norm(potential.differences(x), axis=1)
        np.maximum.at(out, geometry.differences.joint, lengths / geometry.sizes[geometry.differences.joint])
        laws = potential.laws.table
        adapts = laws["adapts"]
        if adapts.any():
            missing = np.abs(potential.efforts(x) - potential.law_multipliers)[adapts] / laws["k"][adapts]
            function = laws["function"][adapts]
            np.maximum.at(out, geometry.arguments.joint[function], missing / geometry.units[function])
        return out

    def measured(self, details: ImplicitDetails, x: NDArray[np.float64]) -> ImplicitDetails:
        """The details of a step that ended at x (n, 3), with what the joints do there."""
        geometry = self.geometry
        forces, torques = self.potential.actions(x)
        efforts, laws = self.potential.efforts(x), self.potential.laws.table
        motors = {int(laws["function"][k]): -float(efforts[k]) for k in np.flatnonzero(laws["is_motor"])}
        names = [str(joint.name) for joint in geometry.joints]
        along = {name: int(row) for name, row in zip(names, geometry.along, strict=True) if row >= 0}
        return replace(
            details,
            joint_forces=dict(zip(names, forces, strict=True)),
            joint_torques=dict(zip(names, torques, strict=True)),
            joint_coordinates=reported(geometry, self.potential.coordinates(x)),
            motor_forces={name: motors[row] for name, row in along.items() if row in motors},
            joint_violations=dict(zip(names, map(float, self.violations(x)), strict=True)),
        )

    def hinge_angles(self, x: NDArray[np.float64]) -> dict[str, float]:
        """As of `State`, of positions x (n, 3)."""
        g, geometry = self.potential.coordinates(x), self.geometry
        rows = zip(geometry.joints, geometry.along, strict=True)
        return {str(joint.name): float(g[row]) for joint, row in rows if row >= 0 and geometry.functions[row] == ANGLE}
