"""Rigid bodies with the masses of what is welded to them, and with the points that something is stitched to.

A welded vertex moves with its rigid body, so that its mass belongs to that body: mass, center and inertia of the
body are those of both. The solver works with control points of these bodies, which are affine combinations of those of
the scene's bodies; states are converted at both ends of a frame.

Constraints still move welded vertices one by one, and the impulses that this takes act on the body afterwards (see
`RigidBodies.gather`). If each vertex answered with the inverse mass of the body there, s vertices would move the body
s times as far. So each has the share 1 / s of the mass with which the body answers at its place, at least:

    1 / m' = s * largest eigenvalue of (1 / M + [r]^T I^-1 [r]).

Stitched points are welded vertices without mass, see `supple.model.stitched_points`.

Source: Tonge, Benevolenski, Voroshilov, "Mass Splitting for Jitter-Free Parallel Rigid Body Simulation" (2012).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from supple.model.state import State
from supple.model.stitched_points import stitched_state, with_stitched_points
from supple.model.system import BodyRange, PinRange, System, rebuilt_system
from supple.scene.rigid.mass_properties import MassProperties
from supple.scene.rigid.rigid_body import RigidBody
from supple.solvers.xpbd.memory import ControlMemory, XPBDMemory
from supple.solvers.xpbd.rigid.bodies import RigidBodies


class WeldedMasses:
    """A system whose rigid bodies have the masses of what is welded to them, and stitched points as vertices.

    Attributes
    ----------
    system : that system; where nothing is welded or stitched to a rigid body, the given one
    """

    def __init__(self, system: System) -> None:
        self._count = len(system.masses)
        # The control points, those of the solver as combinations of those of the scene, and back.
        self._rows = np.zeros(0, dtype=np.int64)
        self.system = self._built(system)
        # Stitched points, which come last, have none.
        masses = system.masses[system.welding.vertices]
        self._masses = np.pad(masses, (0, len(self.system.welding) - len(masses)))

    def _built(self, system: System) -> System:
        if not len(system.welding) and not len(system.stitching.apart):
            return system
        built = with_stitched_points(self._with_masses(system) if len(system.welding) else system)
        masses, seen = built.masses.copy(), built.masses.copy()
        masses[built.welding.vertices] = 0.0
        for part in built.rigid_bodies:
            _split(built, part, seen)
        return replace(built, masses=masses, effective_masses=seen)

    def _with_masses(self, system: System) -> System:
        heavy = {part.name: _with_welded_masses(system, part) for part in system.rigid_bodies}
        pairs = [(part.body, heavy[part.name]) for part in system.rigid_bodies if isinstance(part.body, RigidBody)]
        self._rows = np.concatenate(
            [np.arange(part.vertices.start, part.vertices.stop) for part in system.rigid_bodies]
        )
        self._into = np.asarray(block_diag(*(own.weights_of(other.mesh.vertices) for own, other in pairs)))
        self._back = np.asarray(block_diag(*(other.weights_of(own.mesh.vertices) for own, other in pairs)))
        # Joints without a point are at the centers of mass of the scene's bodies.
        places = {own.name: own for own, _ in pairs}
        joints = [replace(joint, point=joint.place(places[joint.first])) for joint in system.scene.joints]
        bodies = [heavy.get(part.name, part.body) for part in system.bodies]
        scene = replace(system.scene, bodies=bodies, joints=joints)
        anchors = [self._anchors(pin) for pin in system.pins]
        built = rebuilt_system(scene, tuple(self._heavy(state) for state in system.start_states), anchors)
        return replace(built, stitching=system.stitching)

    def inner(self, state: State) -> State:
        """A state of the scene as one of the solver."""
        return stitched_state(self.system, self._heavy(state))

    def _heavy(self, state: State) -> State:
        if not len(self._rows):
            return state
        memory = state.memory.control if isinstance(state.memory, XPBDMemory) else None
        if memory is not None and memory.belongs_to(state, self._rows):
            return self._with(state, memory.inner)
        return self._with(state, [self._into @ values[self._rows] for values in (state.positions, state.velocities)])

    def outer(self, state: State) -> State:
        """A state of the solver as one of the scene."""
        if len(state.positions) > self._count:
            rows = slice(self._count)
            state = replace(state, positions=state.positions[rows].copy(), velocities=state.velocities[rows].copy())
        if not isinstance(state.memory, XPBDMemory) or not len(self._rows):
            return state
        inner = np.stack([state.positions[self._rows], state.velocities[self._rows]])
        outer = np.stack([self._back @ values for values in inner])
        memory = replace(state.memory, control=ControlMemory(inner, outer))
        return replace(self._with(state, outer), memory=memory)

    def _with(self, state: State, control: Sequence[NDArray[np.float64]] | NDArray[np.float64]) -> State:
        x, v = state.positions.copy(), state.velocities.copy()
        x[self._rows], v[self._rows] = control
        return replace(state, positions=x, velocities=v)

    @property
    def names(self) -> list[str]:
        """Of the welds."""
        return [str(weld.name) for weld in self.system.scene.welds]

    def forces(
        self, rigid: RigidBodies, velocities: NDArray[np.float64], on_held: NDArray[np.float64], dt: float
    ) -> dict[str, NDArray[np.float64]]:
        """By name of the weld, the mean forces (3,) of rigid bodies on what is welded to them, over a frame [N].

        Parameters
        ----------
        rigid : these bodies, at the end of the frame; velocities : (n, 3) then, in their numbering; dt : its length [s]
        on_held : (n, 3) impulses of all forces in the frame on vertices that are welded to held bodies [N s]
        """
        impulses = rigid.welded_impulses(self._masses, velocities) - on_held[rigid.welding.vertices]
        impulses -= dt * self._masses[:, None] * self.system.gravity
        weld = self.system.welding.weld
        return {name: impulses[weld == k].sum(axis=0) / dt for k, name in enumerate(self.names)}

    def _anchors(self, pin: PinRange) -> NDArray[np.float64]:
        """(k, 3) those of a pin; of a rigid body, its control points."""
        mine = np.searchsorted(self._rows, pin.vertices[0])
        if mine == len(self._rows) or self._rows[mine] != pin.vertices[0]:
            return pin.anchors
        return self._into[mine : mine + 4, mine : mine + 4] @ pin.anchors


def _welded_to(system: System, part: BodyRange) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """The vertices (k,) that are welded to a rigid body, and their places (k, 3) in its own coordinates [m]."""
    welding = system.welding
    mine = welding.control[:, 0] == part.vertices.start
    return welding.vertices[mine], welding.weights[mine] @ part.body.mesh.vertices


def _with_welded_masses(system: System, part: BodyRange) -> RigidBody:
    body = part.body
    assert isinstance(body, RigidBody)
    vertices, places = _welded_to(system, part)
    own, masses = body.properties, system.masses[vertices]
    mass = own.mass + float(masses.sum())
    center = (own.mass * own.center + masses @ places) / mass
    arms, arm = places - center, own.center - center
    moment = own.second_moment + own.mass * np.outer(arm, arm) + np.einsum("k,ki,kj->ij", masses, arms, arms)
    inertia = MassProperties(mass, own.volume, center, moment).inertia
    return replace(body, density=None, mass=mass, inertia=inertia, center=center, stiffness=body.kappa)


def _split(system: System, part: BodyRange, out: NDArray[np.float64]) -> None:
    """Set the masses (n,) with which constraints see the vertices that are welded to a body; inf where it is held."""
    vertices, places = _welded_to(system, part)
    if not len(vertices):
        return
    if np.isin(part.vertices.start, system.pinned_vertices):
        out[vertices] = np.inf
        return
    body = part.body
    assert isinstance(body, RigidBody)
    inverse = np.linalg.inv(body.properties.inertia)
    for vertex, r in zip(vertices, places - body.properties.center, strict=True):
        across = np.cross(np.eye(3), r)
        answer = np.eye(3) / body.properties.mass + across @ inverse @ across.T
        out[vertex] = 1.0 / (len(vertices) * np.linalg.eigvalsh(answer)[-1])
