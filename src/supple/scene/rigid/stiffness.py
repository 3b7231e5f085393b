"""The default stiffness of rigid bodies, from the heaviest load of their scene.

Forces f at points x strain an affine body by their mean stress sum f x^T / V. With the energy kappa V |F^T F - 1|^2, a
stress p makes the orthogonality error |F^T F - 1| = p / (4 kappa). Kappa is such that the heaviest load makes an error
of `ERROR`. The load is the sum of

    g L M / V     the weight of everything in the scene, of mass M, on two opposite ends of the body of diagonal L;
    rho v^2       for impacts and spin, with v^2 the largest square of a velocity at the start plus that of a fall from
                  `_FALL` diagonals, taken `_IMPACT` times, since an impact takes a short time;
    `_SOFT` E     of the stiffest soft body, which can be pressed against it;
    F L / V       of the springs, F the sum of their forces at the start, on two opposite ends.

Without gravity, that of the earth is assumed. These are scales, not bounds: a solver reports the error.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from supple.scene.body import PlacedBody
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rod import Rod
from supple.scene.shell import Shell

ERROR = 1e-3
_FALL = 10.0
_IMPACT = 10.0
_SOFT = 0.1
_EARTH = 9.81


def with_stiffness(
    bodies: Sequence[PlacedBody], gravity: NDArray[np.float64], pull: float = 0.0
) -> tuple[PlacedBody, ...]:
    """The bodies, of which rigid ones without a stiffness of their own have the scene's.

    pull : sum of the forces of springs [N]
    """
    if not any(isinstance(body, RigidBody) and body.stiffness is None for body in bodies):
        return tuple(bodies)
    g = float(np.linalg.norm(gravity)) or _EARTH
    total = sum(_mass(body) for body in bodies)
    squared = max(_squared_speed(body) for body in bodies)
    soft = max((_modulus(body) for body in bodies if not isinstance(body, RigidBody)), default=0.0)
    made = []
    for body in bodies:
        if isinstance(body, RigidBody) and body.stiffness is None:
            length, volume = _diagonal(body), body.properties.volume
            impact = _IMPACT * body.properties.mass / volume * (squared + 2.0 * g * _FALL * length)
            body = body.with_stiffness(((g * total + pull) * length / volume + impact + _SOFT * soft) / (4.0 * ERROR))
        made.append(body)
    return tuple(made)


def _mass(body: PlacedBody) -> float:
    if not len(body.mesh.tets):
        return float(body.lumped_masses().sum())
    densities = np.broadcast_to(np.asarray(body.material.density, dtype=np.float64), len(body.mesh.tets))
    return float(densities @ body.mesh.volumes)


def _diagonal(body: PlacedBody) -> float:
    return float(np.linalg.norm(np.ptp(body.points, axis=0)))


def _squared_speed(body: PlacedBody) -> float:
    spin = float(np.linalg.norm(np.asarray(body.angular_velocity)))
    return (float(np.linalg.norm(np.asarray(body.velocity))) + 0.5 * spin * _diagonal(body)) ** 2


def _modulus(body: PlacedBody) -> float:
    """The largest 3 mu of a soft body's tets, or that of a shell [Pa]."""
    if isinstance(body, Rod):
        return body.material.youngs
    if isinstance(body, Shell):
        return 3.0 * body.material.mu
    return 3.0 * float(body.material.per_tet(len(body.mesh.tets)).mu.max())
