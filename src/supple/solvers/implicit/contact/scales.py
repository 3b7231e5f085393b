"""The lengths, pressures and velocities of contact, from the scene where the user gives none.

All defaults are proportional to the bodies' sizes and moduli: the same scene in millimetres gives the same shapes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.model.system import BodyRange, System
from supple.scene.rigid.rigid_body import RigidBody
from supple.solvers.implicit.contact.settings import IPCContact

_DHAT_SHARE = 1e-3  # of the smallest body's diagonal
_EDGE_SHARE = 0.25  # of the short surface edges: a surface at rest then has no contacts with itself
_SHORT_EDGES = 2.0  # [%] percentile of the edge lengths that counts as short
_SMALLEST_SHARE = 1e-5  # of the diagonal: gaps at the start do not reduce dhat below it
_STIFFNESS_SHARE = 1.0  # of the softest body's modulus
_RIGID_SHARE = 0.04  # of the stiffness of a rigid body: ten times the stress that makes an error of 1e-3
_SLOW_SHARE = 1e-3  # of the diagonal, per second


@dataclass(frozen=True)
class Scales:
    """Parameters of contact in SI units.

    Attributes
    ----------
    dhat : [m]; stiffness : [Pa]; friction_velocity : [m/s]
    adaptive : whether the stiffness may be raised
    """

    dhat: float
    stiffness: float
    friction_velocity: float
    adaptive: bool


def scales_of(settings: IPCContact, system: System, shear_moduli: NDArray[np.float64], gap: float) -> Scales:
    """Complete the settings.

    Parameters
    ----------
    shear_moduli : (m,) of the tets [Pa]; gap : smallest distance at the start [m], or infinity
    """
    smallest = smallest_diagonal(system)
    moduli = [_modulus(part, shear_moduli[part.tets]) for part in system.bodies]
    dhat = settings.dhat
    if dhat is None:
        dhat = min(largest_dhat(system), max(gap, _SMALLEST_SHARE * smallest))
    adaptive = settings.stiffness == "adaptive"
    stiffness = _STIFFNESS_SHARE * min(moduli) if adaptive else float(settings.stiffness)
    slow = settings.friction_velocity
    return Scales(dhat, stiffness, _SLOW_SHARE * smallest if slow is None else slow, adaptive)


def _modulus(part: BodyRange, shear_moduli: NDArray[np.float64]) -> float:
    """Of one body [Pa]; of a rigid body, ten times the stress that its default stiffness is made for."""
    if isinstance(part.body, RigidBody):
        return _RIGID_SHARE * part.body.kappa
    return 3.0 * float(np.mean(shear_moduli))


def smallest_diagonal(system: System) -> float:
    """The diagonal of the smallest body's bounding box at rest [m]."""
    return min(float(np.linalg.norm(np.ptp(system.rest_points[part.points], axis=0))) for part in system.bodies)


def largest_dhat(system: System) -> float:
    """The default of dhat where no surfaces are near each other at the start [m]."""
    a, b, c = system.rest_points[system.triangles].transpose(1, 0, 2)
    edges = np.concatenate(
        [np.linalg.norm(b - a, axis=1), np.linalg.norm(c - b, axis=1), np.linalg.norm(a - c, axis=1)]
    )
    return min(_DHAT_SHARE * smallest_diagonal(system), _EDGE_SHARE * float(np.percentile(edges, _SHORT_EDGES)))
