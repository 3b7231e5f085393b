"""Derivatives by fields with an entry for every tet or vertex, in one pass over the elements of each substep.

The product of forces l with the gradient of a tet's energy W is the derivative of W along l. Energies of elastic tets,
and of their damping, are proportional to the moduli of the tet; by rest shapes they have derivatives in closed form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.gradients.adjoint import StepAdjoint
from supple.gradients.kept import Kept, Replay
from supple.model.loads.applied import MassLoad
from supple.model.system import BodyRange, System
from supple.scene.motion import Keyframes, Motion
from supple.scene.rigid.rigid_body import RigidBody
from supple.solvers.implicit.contact.settings import IPCContact
from supple.solvers.implicit.energies.damping import Damping
from supple.solvers.implicit.energies.elasticity import Elasticity, elasticity_of
from supple.solvers.implicit.energies.quadratic.term import OfQuadraticTets
from supple.solvers.implicit.solver import Implicit
from supple.solvers.implicit.stepping.workspace import Workspace

Floats = NDArray[np.float64]

# Of the smallest body: how far a difference of energies goes.
_ALONG = 1e-5


def by_moduli(replay: Replay, forces: Floats, contact: IPCContact | None) -> Floats:
    """(m,) derivatives by the logarithm of all moduli of each tet, of forces (n, 3) on a substep's equations."""
    out = np.zeros(len(replay.workspace.system.tets))
    for term in replay.posed.base.terms:
        if isinstance(term, OfQuadraticTets):
            raise SolverError("gradient: damped quadratic tets have no derivative by their moduli; use linear ones")
        if isinstance(term, Elasticity | Damping):
            out += _along(term, replay, forces)
    model = replay.workspace.contact
    if model is not None and contact is not None and contact.stiffness == "adaptive":
        # The barrier is as stiff as the softest body.
        mu, bodies = replay.workspace.elasticity.material.mu, replay.workspace.system.bodies
        soft = [part for part in bodies if not isinstance(part.body, RigidBody)]
        softest = min(soft, key=lambda part: float(np.mean(mu[part.tets])), default=None)
        if softest is not None and 3.0 * float(np.mean(mu[softest.tets])) == model.scales.stiffness:
            share, of_barrier = mu[softest.tets] / mu[softest.tets].sum(), np.zeros_like(forces)
            if replay.barrier is not None:
                replay.barrier.add_gradient(replay.x, of_barrier)
            out[softest.tets] += share * float(np.einsum("ij,ij->", of_barrier, forces))
    return out


def _along(term: Elasticity | Damping, replay: Replay, forces: Floats) -> Floats:
    """(m,) the derivatives of a term's energies along forces (n, 3)."""
    most = float(np.abs(forces).max(initial=0.0))
    if most == 0.0:
        return np.zeros(len(replay.workspace.system.tets))
    e = _ALONG * replay.workspace.diagonal / most
    return (term.energies(replay.x + e * forces) - term.energies(replay.x - e * forces)) / (2.0 * e)


class RestShapes:
    """The tets of a system, apart from each other, so that the forces of each are known.

    An energy E = V W(F) has the derivative E B_a - F^T f_a by the rest position of corner a = 1, 2, 3, with the rows
    B_a of B = Dm^-1 and the forces f_a = dE/dx_a; that of corner 0 makes their sum zero.

    Source: Eshelby, "The elastic energy-momentum tensor" (1975).

    Raises
    ------
    SolverError : where tets are quadratic, or damped, as far as these are refused.
    """

    def __init__(self, system: System) -> None:
        if system.quadratic is not None or system.laws.material.damping.any() or system.laws.material.flowing_laws:
            raise SolverError(
                "gradient: rest shapes of tets that are quadratic, damped or flow have no derivative here"
            )
        apart = np.arange(system.tets.size, dtype=np.int32).reshape(-1, 4)
        self.system, self.B = system, system.rest_shape_inverse
        self.elasticity = elasticity_of(replace(system, tets=apart, rest_positions=np.zeros((system.tets.size, 3))))

    def forces(self, x: Floats) -> Floats:
        """(m, 3, 3) derivatives of energies by rest positions of corners 1 to 3, at positions x (n, 3)."""
        corners = x[self.system.tets]
        own, pulls = np.ascontiguousarray(corners.reshape(-1, 3)), np.zeros((self.system.tets.size, 3))
        self.elasticity.add_gradient(own, pulls)
        F = np.einsum("mai,maj->mij", corners[:, 1:] - corners[:, :1], self.B)
        by_forces = np.einsum("mij,mai->maj", F, pulls.reshape(-1, 4, 3)[:, 1:])
        return self.elasticity.energies(own)[:, None, None] * self.B - by_forces

    def derivatives(self, replay: Replay, forces: Floats) -> Floats:
        """(n, 3) by the rest positions of vertices, of forces (n, 3) on a substep's equations."""
        system, plan, out = self.system, replay.plan, np.zeros_like(forces)
        most = float(np.abs(forces).max(initial=0.0))
        if most == 0.0:
            return out
        pulls = np.tile(system.gravity, (len(forces), 1))
        for load in system.loads:
            if isinstance(load, MassLoad):
                own = np.zeros_like(forces)
                load.add_forces(replay.kept.before.positions[: len(own)], replay.posed.middle, own)
                pulls += own / system.masses[:, None]
        lags = 0.0 if plan.scale is None else (replay.x[: len(pulls)] - plan.predicted[: len(pulls)]) / plan.scale
        per_mass = np.einsum("ij,ij->i", forces[: len(pulls)], lags - pulls)[system.tets].sum(axis=1)
        densities = np.concatenate([_densities(part) for part in system.bodies])
        e = _ALONG * replay.workspace.diagonal / most
        by_corner = (self.forces(replay.x + e * forces) - self.forces(replay.x - e * forces)) / (2.0 * e)
        by_corner += (0.25 * densities * system.rest_volumes * per_mass)[:, None, None] * self.B
        np.add.at(out, system.tets[:, 1:], by_corner)
        np.subtract.at(out, system.tets[:, 0], by_corner.sum(axis=1))
        return out


def _densities(part: BodyRange) -> Floats:
    count = part.tets.stop - part.tets.start
    return np.zeros(count) if part.rigid else np.broadcast_to(np.asarray(part.body.material.density, float), count)


def fields_of(
    workspace: Workspace, steps: Sequence[tuple[Kept, StepAdjoint]], solver: Implicit, *, moduli: bool, rest: bool
) -> tuple[Floats, Floats]:
    """(m,) by the logarithm of the moduli of each tet, and (n, 3) by rest positions without what starts there; zero
    where they are not asked for."""
    system = workspace.system
    by_tet, by_vertex = np.zeros(len(system.tets)), np.zeros_like(system.rest_positions)
    shapes = RestShapes(system) if rest else None
    for kept, adjoint in steps if moduli or rest else ():
        replay = Replay.of(kept, workspace)
        if moduli:
            by_tet += by_moduli(replay, adjoint.forces, solver.contact)
        if shapes is not None:
            by_vertex += shapes.derivatives(replay, adjoint.forces)
    return by_tet, by_vertex


def by_anchors(system: System, steps: Sequence[tuple[Kept, StepAdjoint]], begin: Floats) -> Floats:
    """(n, 3) derivatives by where vertices start: those by the start of the first step, and by where pins and soft
    targets hold them."""
    out, first = begin.copy(), 0
    for pin in system.pins:
        rows = slice(first, first := first + len(pin.vertices))
        for kept, adjoint in steps:
            out[pin.vertices] += adjoint.anchors[rows] @ _turn(pin.motion, kept.end)
    for part in system.soft_targets:
        for kept, adjoint in steps:
            pulls = -np.asarray(part.target.stiffness) * adjoint.forces[part.vertices]
            np.add.at(out, part.vertices, pulls @ _turn(part.target.motion, kept.end))
    return out


def _turn(motion: Motion, time: float) -> Floats:
    return motion.pose(time)[0] if isinstance(motion, Keyframes) else np.eye(3)
