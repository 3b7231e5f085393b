"""Rigid bodies: four control points each, which move as one solid.

A rigid body is a tetrahedron of equal masses (see `supple.scene.rigid.rigid_body`). Within a substep the places x_n
of its beginning are rigid, and everything that acts on the body changes the velocities v of its control points, whose
momenta determine the end: see `motion`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.rigid.motion import advance, spins

# Relative difference of squares of distances that a motion of a body may make without being corrected.
_RIGID = 1e-13


class Welds(NamedTuple):
    """Welded vertices as kernels take them.

    Attributes
    ----------
    vertices : (s,); control : (s, 4) control points of their bodies; weights : (s, 4)
    shares : (s, 4) how an impulse that moves a vertex changes their velocities
    placed : (s, 3) places where the bodies had the vertices last [m]
    """

    vertices: NDArray[np.int32]
    control: NDArray[np.int32]
    weights: NDArray[np.float64]
    shares: NDArray[np.float64]
    placed: NDArray[np.float64]


class RigidBodies:
    """The b rigid bodies of a system, in the solver's numbering.

    Attributes
    ----------
    control : (b, 4) their control points; masses : (b,) [kg]
    numbers : (b,) of the bodies in the scene
    of_vertex : (n,) the rigid body of each vertex, or -1
    held : (b,) those that pins hold or move; joined : (b,) those with joints
    welding : vertices of soft bodies that are points of these; welded_to : (n,) their rigid body, -1 for others
    """

    def __init__(self, system: System) -> None:
        parts = system.rigid_bodies
        self.control = np.array([np.arange(part.vertices.start, part.vertices.stop) for part in parts], dtype=np.int32)
        self.control = self.control.reshape(-1, 4)
        self.masses = 4.0 * system.masses[self.control[:, 0]]
        self.numbers = np.array([k for k, part in enumerate(system.bodies) if part.rigid], dtype=np.int64)
        self.of_vertex = np.full(len(system.masses), -1, dtype=np.int32)
        self.of_vertex[self.control] = np.arange(len(parts), dtype=np.int32)[:, None]
        rest = system.rest_positions[self.control]
        self._rest = rest - rest.mean(axis=1, keepdims=True)
        sides = rest[:, 1:] - rest[:, :1]
        self._products, self._volumes = sides @ sides.transpose(0, 2, 1), np.linalg.det(sides)
        self.held = system.inverse_masses[self.control[:, 0]] == 0.0
        self.names = [part.name for part in parts]
        ends = {name for joint in system.scene.joints for name in (joint.first, joint.second)}
        self.joined = np.array([name in ends for name in self.names], dtype=np.bool_)
        self.welding = system.welding
        self.welded_to = np.full(len(system.masses), -1, dtype=np.int32)
        self.welded_to[self.welding.vertices] = self.of_vertex[self.welding.control[:, 0]]
        w = system.inverse_masses[self.welding.vertices]
        shares = np.where(w > 0.0, 1.0, 0.0) / np.where(w > 0.0, w, 1.0)
        shares = shares[:, None] * self.welding.weights / system.masses[self.welding.control]
        self._impulses, self._begun = np.zeros((len(self.welding), 3)), np.zeros((len(self.welding), 3))
        welding = self.welding
        self.welds = Welds(welding.vertices, welding.control, welding.weights, shares, np.zeros_like(self._begun))
        self._joined_masses = system.masses[self.welding.control[:, 0]]

    def __len__(self) -> int:
        return len(self.control)

    def place(self, x: NDArray[np.float64]) -> None:
        """Move the control points of x (n, 3) to the nearest rigid places, in place [m]."""
        if not len(self):
            return
        corners = x[self.control]
        sides = corners[:, 1:] - corners[:, :1]
        error = np.abs(sides @ sides.transpose(0, 2, 1) - self._products).max(axis=(1, 2))
        # What is rigid up to round-off remains bit for bit, so that what is known of its places remains known.
        mirrored = np.linalg.det(sides) * self._volumes <= 0.0
        off = np.flatnonzero(mirrored | ~(error <= _RIGID * self._products.max(axis=(1, 2))))
        if len(off):
            centers = corners[off].mean(axis=1, keepdims=True)
            U, _, Vt = np.linalg.svd(np.einsum("bki,bkj->bij", corners[off] - centers, self._rest[off]))
            U[:, :, 2] *= np.sign(np.linalg.det(U) * np.linalg.det(Vt))[:, None]
            x[self.control[off]] = np.einsum("bij,bkj->bki", U @ Vt, self._rest[off]) + centers
        self.welding.follow(x)

    def begin_frame(self, velocities: NDArray[np.float64]) -> None:
        """Begin to add up the impulses on welded vertices, which have the velocities (n, 3) of all."""
        self._impulses[:], self._begun = 0.0, velocities[self.welding.vertices]

    def follow(self, points: NDArray[np.float64], velocities: NDArray[np.float64]) -> None:
        """Put welded vertices where their bodies are, in place: points (n, 4), velocities (n, 3)."""
        if len(self.welding):
            follow_welds(self.welds, points, velocities)

    def gather(self, points: NDArray[np.float64], velocities: NDArray[np.float64], h: float) -> None:
        """Change the velocities of bodies by the impulses that moved their welded vertices since `follow`, in place.

        An impulse J at a vertex acts on the control points as w_k J, so that its moment is that at the vertex.
        """
        if len(self.welding):
            gather_welds(self.welds, points, velocities, h, self._joined_masses, self._impulses)

    def welded_impulses(self, masses: NDArray[np.float64], velocities: NDArray[np.float64]) -> NDArray[np.float64]:
        """(s, 3) what the bodies gave in the frame to their welded vertices of masses (s,) [kg m/s].

        These need it to move as they do, and pass on what constraints gave to them.
        """
        return masses[:, None] * (velocities[self.welding.vertices] - self._begun) - self._impulses

    def move(
        self, points: NDArray[np.float64], previous: NDArray[np.float64], velocities: NDArray[np.float64], h: float
    ) -> None:
        """`gather`, then `advance`."""
        self.gather(points, velocities, h)
        self.advance(points, previous, velocities, h)

    def advance(
        self,
        points: NDArray[np.float64],
        previous: NDArray[np.float64],
        velocities: NDArray[np.float64],
        h: float,
    ) -> None:
        """Move every body from its places at the beginning of the substep as its momenta determine, in place.

        Parameters
        ----------
        points : (n, 4) out: places at the end of the substep [m]; in: inverse masses [1/kg], zero where a body is held
        previous : (n, 3) rigid places at its beginning [m]
        velocities : (n, 3) in: they have the momenta; out: (x - x_n) / h [m/s]
        h : length of the substep [s]
        """
        if len(self):
            advance(points, previous, velocities, self.control, h)
            self.follow(points, velocities)

    def spins(self, x: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
        """(b,) how fast the bodies turn at positions x and velocities v (n, 3) [rad/s]."""
        return spins(x, v, self.control) if len(self) else np.zeros(0)


@njit(cache=True)
def follow_welds(welds, points, velocities):
    """See `RigidBodies.follow`; points (N, >= 3)."""
    for k in range(len(welds.vertices)):
        i = welds.vertices[k]
        for j in range(3):
            x = v = 0.0
            for c in range(4):
                x += welds.weights[k, c] * points[welds.control[k, c], j]
                v += welds.weights[k, c] * velocities[welds.control[k, c], j]
            points[i, j], velocities[i, j], welds.placed[k, j] = x, v, x


@njit(cache=True)
def gather_welds(welds, points, velocities, h, masses, impulses):
    """See `RigidBodies.gather`; masses (s,) of a control point, impulses (s, 3) so far, in place."""
    for k in range(len(welds.vertices)):
        i = welds.vertices[k]
        for j in range(3):
            moved = (points[i, j] - welds.placed[k, j]) / h
            for c in range(4):
                change = welds.shares[k, c] * moved
                velocities[welds.control[k, c], j] += change
                impulses[k, j] += masses[k] * change
            welds.placed[k, j] = points[i, j]
