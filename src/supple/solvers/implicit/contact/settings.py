"""The user's settings for contact in the implicit solver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.kinds.kind import Kind
from supple.kinds.validators import COUNT, POSITIVE, Union
from supple.model.system import BodyRange, System
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rod import Rod
from supple.scene.shell import Shell


@dataclass(frozen=True)
class IPCContact(Kind):
    """Incremental potential contact. All defaults scale with the scene.

    Parameters
    ----------
    dhat : distance below which surfaces repel each other [m]. None: a thousandth of the smallest body's diagonal, or
        less where surface edges or the gaps at the start are shorter than that.
    stiffness : pressure scale of the barrier [Pa]: surfaces half of `dhat` apart press on each other with several
        times as much. "adaptive": from the bodies' moduli (of shells alone, times thickness
        over diagonal), and raised within a step where surfaces come very close.
    friction_velocity : relative velocity below which friction is static [m/s]: a sticking contact creeps with a part of
        it. None: a thousandth of the smallest body's diagonal per second.
    friction_iterations : how often in a step the normal forces of friction are computed. 1: only at the beginning of
        the step. None: until they change by less than a tenth, at most five times.

    Raises
    ------
    SolverError : where a value is of the wrong kind or out of range.

    Source: Li et al., "Incremental Potential Contact: Intersection- and Inversion-free, Large-Deformation Dynamics"
    (2020), sections 3 to 5.
    """

    kind: ClassVar[str] = "ipc_contact"
    title: ClassVar[str] = "IPCContact"
    error = SolverError

    dhat: Annotated[float | None, POSITIVE] = None
    stiffness: Annotated[float | str, Union(POSITIVE, "adaptive")] = "adaptive"
    friction_velocity: Annotated[float | None, POSITIVE] = None
    friction_iterations: Annotated[int | None, COUNT] = None


# The lengths, pressures and velocities of contact, from the scene where the user gives none.
#
# All defaults are proportional to the bodies' sizes and moduli: the same scene in millimetres gives the same shapes.


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
    moduli = [_modulus(system, part, shear_moduli[part.tets]) for part in system.bodies]
    dhat = settings.dhat
    if dhat is None:
        dhat = min(largest_dhat(system), max(gap, _SMALLEST_SHARE * smallest))
    adaptive = settings.stiffness == "adaptive"
    stiffness = _STIFFNESS_SHARE * min(moduli) if adaptive else float(settings.stiffness)
    slow = settings.friction_velocity
    return Scales(dhat, stiffness, _SLOW_SHARE * smallest if slow is None else slow, adaptive)


def _modulus(system: System, part: BodyRange, shear_moduli: NDArray[np.float64]) -> float:
    """Pressure that strains one body by about one [Pa]; of a rigid body, ten times the stress that its default
    stiffness is made for."""
    if isinstance(part.body, RigidBody):
        return _RIGID_SHARE * part.body.kappa
    if isinstance(part.body, Rod):
        return part.body.material.youngs
    if isinstance(part.body, Shell):
        modulus = 3.0 * part.body.material.mu
        if not all(isinstance(other.body, Shell) for other in system.bodies):
            return modulus  # solids press on each other and on shells with more than shells alone
        size = float(np.linalg.norm(np.ptp(system.rest_points[part.points], axis=0)))
        return modulus * part.body.material.thickness / size  # a balloon's tension over its radius
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
    edges = edges[edges > 0.0]  # an edge of a rod is a triangle with a corner twice
    return min(_DHAT_SHARE * smallest_diagonal(system), _EDGE_SHARE * float(np.percentile(edges, _SHORT_EDGES)))
