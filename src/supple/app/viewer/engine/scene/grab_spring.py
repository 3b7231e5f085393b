"""Grabs: springs that pull at the surface of a body."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.commands import Grab
from supple.app.viewer.protocol.snapshots import GrabState
from supple.errors import CommandError
from supple.model.loads.build import applied_force
from supple.model.state import State
from supple.model.system import BodyRange, SoftTargetRange, System
from supple.scene.forces import Force, SoftTarget
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.scene import Scene
from supple.solvers.solver import Solver
from supple.solvers.xpbd.workspace import XPBDWorkspace

# A body that hangs on one spring oscillates at this frequency [Hz], or faster where it would sag by more than SAG of
# its diagonal.
FREQUENCY, SAG = 4.0, 0.05
# Radius of the patch, as a share of the diagonal of the body. A single vertex would be pulled out as a spike.
PATCH = 0.06
# How far the target of a patch goes in a step, relative to the body, in radii of the patch. Faster than the body can
# follow, it would fold the surface around the patch.
SHARE = 0.5


@dataclass(eq=False)
class GrabSpring(ABC):
    """One grab: a spring from the point p = sum w_i x_i of a body to a target, which the page moves.

    Attributes
    ----------
    command : the command that created it; target : (3,) its current target [m]
    stiffness : k [N/m]; longest : largest distance over which it pulls [m]
    load : what it is in the scene
    """

    command: Grab
    stiffness: float
    longest: float
    target: NDArray[np.float64]
    load: SoftTarget | Force = field(init=False)

    @abstractmethod
    def begin_step(self, system: System, state: State, dt: float, anchors: NDArray[np.float64] | None) -> None:
        """Set the load for the next step of dt [s].

        Parameters
        ----------
        anchors : (k, 3) where the load is a soft target, its own in the system [m]
        """

    def point(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """(3,) the point to which the spring is attached, or its velocity, from those of its body's points (n, 3)."""
        return np.asarray(self.command.weights) @ points[list(self.command.vertices)]

    def displacement(self, points: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
        """(3,) from the point to a target, as far as it pulls [m]."""
        displacement = target - self.point(points)
        length = float(np.linalg.norm(displacement))
        return displacement * (self.longest / length) if length > self.longest else displacement

    def drawn(self, points: NDArray[np.float64]) -> GrabState:
        """The spring to draw, with the points (n, 3) of the body [m]."""
        point, target = self.point(points).tolist(), self.target.tolist()
        return GrabState(self.command.grab, self.command.body, tuple(point), tuple(target))


@dataclass(eq=False)
class SoftGrab(GrabSpring):
    """Pulls with k |target - p| at a patch of a soft body, (k,) `patch` of its vertices, equally.

    In every step each vertex of the patch is pulled towards x_i + (target - p), with x_i and p at the start of the
    step. So the force causes no torque about p, and the motion of the patch is slightly damped, as by a dashpot k dt.

    The patch weighs little and follows the target at once. So the target goes from there to its place over the rest of
    the step, not in a jump, and by at most `farthest` [m] more than the center of mass moves: otherwise the patch would
    go into the surface beside it.
    """

    patch: NDArray[np.int32]
    farthest: float
    _points: NDArray[np.float64] = field(init=False)  # of the body, at the start of the step
    _rest: NDArray[np.float64] = field(init=False)  # of the patch's targets
    _ends: tuple[NDArray[np.float64], NDArray[np.float64]] = field(init=False)  # of the displacement of the target
    _times: tuple[float, float] = (0.0, 0.0)  # at these ends
    _begun: bool = False
    _asked: float = 0.0  # the latest time for which the displacements were asked

    def __post_init__(self) -> None:
        self._ends = self.target.copy(), self.target.copy()
        self.load = SoftTarget(
            self.command.body,
            self.patch,
            self.stiffness / len(self.patch),
            self._displacements,
            name=f"grab {self.command.grab}",
        )

    def begin_step(self, system: System, state: State, dt: float, anchors: NDArray[np.float64] | None) -> None:
        assert anchors is not None
        self._points, self._rest = system.split(state.positions)[self.command.body], anchors
        end = state.time + dt
        now = self._asked if state.time < self._asked <= end else state.time
        place = self._place(now) if self._begun else self.point(self._points)
        rows = next(part.vertices for part in system.bodies if part.name == self.command.body)
        mean = np.average(state.velocities[rows], axis=0, weights=system.masses[rows])
        farthest = (end - now) * (self.farthest / dt + float(np.linalg.norm(mean)))
        displacement = self.target - place
        length = float(np.linalg.norm(displacement))
        if length > farthest:
            displacement *= farthest / length
        self._ends, self._times, self._begun = (place, place + displacement), (now, end), True

    def _place(self, time: float) -> NDArray[np.float64]:
        """(3,) of the target on its way [m]."""
        (first, last), (begin, end) = self._ends, self._times
        share = min(1.0, max(0.0, (time - begin) / (end - begin))) if end > begin else 1.0
        return first + share * (last - first)

    def _displacements(self, time: float) -> NDArray[np.float64]:
        self._asked = time
        return self._points[self.patch] + self.displacement(self._points, self._place(time)) - self._rest


@dataclass(eq=False)
class RigidGrab(GrabSpring):
    """Pulls at a point of the surface of a rigid body, with the force of a spring at the end of the step.

    With the mass m that the point has as part of the free body, 1 / m = sum c_j^2 / m_j over the control points, and
    its velocity v, a step of backward Euler gives k (target - p - h v) / (1 + k h^2 / m): stable for every h, and
    damped as by a dashpot k h.
    """

    _forces: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        self._forces = np.zeros((len(self.command.vertices), 3))
        self.load = Force(
            self.command.body, self.command.vertices, lambda time: self._forces, name=f"grab {self.command.grab}"
        )

    def begin_step(self, system: System, state: State, dt: float, anchors: NDArray[np.float64] | None) -> None:
        part = next(part for part in system.rigid_bodies if part.name == self.command.body)
        x, v = (system.split(values)[part.name] for values in (state.positions, state.velocities))
        assert isinstance(part.body, RigidBody)
        inverse = float(self.point(part.body.weights) ** 2 @ (1.0 / system.masses[part.vertices]))
        force = (
            self.stiffness
            * (self.displacement(x, self.target) - dt * self.point(v))
            / (1.0 + self.stiffness * dt * dt * inverse)
        )
        self._forces = np.outer(self.command.weights, force)


def make_spring(
    command: Grab, scene: Scene, part: BodyRange, masses: NDArray[np.float64], positions: NDArray[np.float64]
) -> GrabSpring:
    """The spring of a grab.

    Parameters
    ----------
    part : rows of the body; masses : (n,) [kg] and positions : (n, 3) [m] of the whole system

    Raises
    ------
    CommandError : where the body has no such vertex.
    """
    rest = part.body.points
    if max(command.vertices) >= len(rest):
        raise CommandError(f"body {part.name!r} has no vertex {max(command.vertices)}; it has {len(rest)}")
    diagonal = float(np.linalg.norm(np.ptp(rest, axis=0)))
    g = float(np.linalg.norm(np.asarray(scene.gravity)))
    squared = max((2.0 * math.pi * FREQUENCY) ** 2, g / (SAG * diagonal))
    stiffness = command.stiffness * float(masses[part.vertices].sum()) * squared
    size = float(np.linalg.norm(np.ptp(positions, axis=0)))
    values = command, stiffness, limits.LONGEST_GRAB * size, np.array(command.target)
    if part.rigid:
        return RigidGrab(*values)
    center = np.asarray(command.weights) @ rest[list(command.vertices)]
    skin = np.unique(part.body.mesh.surface.triangles)
    near = skin[np.linalg.norm(rest[skin] - center, axis=1) <= PATCH * diagonal]
    return SoftGrab(*values, np.union1d(near, command.vertices).astype(np.int32), SHARE * PATCH * diagonal)


def grabbed(system: System, scene: Scene, grabs: Mapping[int, GrabSpring]) -> System:
    """The System of a scene that differs from that of `system` only by its grabs.

    Parameters
    ----------
    scene : with the loads of `grabs` and of no other grab
    """
    loads = dict(zip(system.scene.forces, system.loads, strict=False))
    targets = {part.target: part for part in system.soft_targets}
    for spring in grabs.values():
        part = next(part for part in system.bodies if part.name == spring.command.body)
        placed = part.body.place(part.body.points)
        rows = spring.load.select(placed)
        if isinstance(spring.load, Force):
            loads.setdefault(spring.load, applied_force(spring.load, part.body, part.vertices.start, rows))
        elif isinstance(spring.load, SoftTarget):
            vertices = (rows + part.vertices.start).astype(np.int32)
            targets.setdefault(spring.load, SoftTargetRange(spring.load, vertices, placed[rows]))
    made = replace(
        system,
        scene=scene,
        loads=(*(loads[force] for force in scene.forces), *system.loads[len(system.scene.forces) :]),
        soft_targets=tuple(targets[target] for target in scene.soft_targets),
    )
    # What a System computes when it is asked for depends neither on forces nor on soft targets.
    own = {field.name for field in fields(system)}
    vars(made).update({name: value for name, value in vars(system).items() if name not in own})
    return made


def workspace_for(solver: Solver, system: System, before: Any) -> Any:
    """The workspace of a solver for a system that `grabbed` made, from that for the system before."""
    return before.with_loads(system) if isinstance(before, XPBDWorkspace) else solver.prepare(system)
