"""The conditions under which a minimization has converged."""

from __future__ import annotations

from dataclasses import dataclass

# Of the largest coordinate: shorter directions are lost in rounding (45 units of 2^-52), and so is the force that they
# would balance.
_ROUNDED = 1e-14


@dataclass(frozen=True)
class Convergence:
    """The conditions.

    Attributes
    ----------
    step : largest component of a Newton direction at the minimum [m]
    force : where surfaces touch, the norm of the forces left over, relative to that of contact's forces: contact is so
        stiff that a short step can change large forces
    """

    step: float
    force: float

    def is_short(self, length: float) -> bool:
        """Whether a direction with this largest component [m] is the last one."""
        return length <= self.step

    def is_reached(self, length: float, extent: float, residual: float, contact: float | None) -> bool:
        """Whether the end of a step along such a direction is the minimum.

        Parameters
        ----------
        length : largest component of the direction [m]; extent : largest coordinate [m]
        residual, contact : norms of all forces on free vertices and of contact's [N]; None where nothing touches
        """
        if not self.is_short(length):
            return False
        return contact is None or length <= _ROUNDED * extent or residual <= self.force * contact
