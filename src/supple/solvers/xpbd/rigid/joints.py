"""Joints between rigid bodies: rows over the control points of two bodies each, which impulses keep.

A row is a number g of the control points (see `supple.model.joints.geometry`) with the gradient G. An impulse p of it
[kg m] has on a body the force sum G_k and the moment sum r_k x G_k about the center, with the arms r_k of the
beginning of the substep, and moves the body by its inverse mass and inertia. A condition has g = g0. Limits, friction
and motors are laws p = -h^2 clip(lambda + k (g - g0), low, high) (see `supple.model.joints.laws`); where k is that of
a condition, it is infinite here. Sweeps solve these equations, together with those of contacts; multipliers begin at
zero in each substep.

Where the two sides of a joint are apart, its forces have a moment. It is taken away from both bodies alike, so that
two free bodies keep their angular momentum.

Source: Müller, Macklin, Chentanez, Jeschke, Kim, "Detailed Rigid Body Simulation with Extended Position Based Dynamics"
(2020), section 3.3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.model.joints.at_state import coordinates_at, initial_joint_details, refuse_apart, reported
from supple.model.joints.functions import ANGLE, derivatives, turns, values
from supple.model.joints.geometry import JointGeometry, Vectors
from supple.model.joints.laws import Laws, laws_of, wrapped
from supple.model.state import State
from supple.model.system import System
from supple.numerics.cross_rows import cross_rows
from supple.solvers.xpbd.moment import Substep
from supple.solvers.xpbd.rigid.bodies import RigidBodies
from supple.solvers.xpbd.rigid.joint_rows import JointRows
from supple.solvers.xpbd.sweeps.ordering import Layout

Floats = NDArray[np.float64]

# Of the largest inverse mass of the joint's rows: rows that move less follow from the others.
_IDLE = 1e-5
# Of the joint's size: what motors may lack in a frame, because of errors that contact leaves in substeps.
_STALLED = 1e-3
# Of the size of a joint: by how much it may be off in a frame that has converged.
MOST_APART = 1e-3


class JointProjection:
    """The joints of a system in the substeps of a frame.

    Points are (n, 4) about origins (n, 3) [m], in the solver's numbering; times of ends of substeps in [s].

    Parameters
    ----------
    system : in the scene's numbering; layout : the solver's numbering; rigid : bodies in that
    """

    def __init__(self, system: System, layout: Layout, rigid: RigidBodies) -> None:
        self._scene = JointGeometry.of(system)
        self.geometry = g = replace(self._scene, corners=layout.new_from_old[self._scene.corners])
        self._rigid = rigid
        bodies = rigid.of_vertex[g.corners[:, [0, 4]]].astype(np.int64)
        bodies[g.alone, 1] = -1
        self._bodies = bodies
        self._free = np.zeros((len(rigid) + 1, 1), dtype=np.bool_)
        self._angles = turns(g.functions)
        self._g = np.zeros(len(g.functions))
        self._total = np.zeros((len(g.joints), 6))
        self._motors = np.zeros(len(g.joints))
        moving = {obstacle.name for obstacle in system.obstacles if obstacle.motion is not None}
        self._driven = np.array([joint.second in moving for joint in g.joints], dtype=np.bool_)
        # The gradients of the rows by control points, and the forces of the substep on these.
        self._gradients, self._on_corners = np.zeros((0, 8, 3)), np.zeros((len(g.joints), 8, 3))
        self._substeps = 0
        # The laws of the substep, their multipliers, values at its beginning, and impulses so far.
        self._laws, self._multipliers = Laws.of([])
        self._begun, self._impulses = np.zeros(0), np.zeros(0)
        # What velocity motors that did not reach their largest effort lack in the frame, and their way.
        self._lacking = np.zeros((len(g.joints), 2))

    def __len__(self) -> int:
        return len(self.geometry.joints)

    def check(self, state: State) -> None:
        """Raise `SceneError` where a joint does not hold at a start; see `refuse_apart`."""
        if len(self):
            refuse_apart(self._scene, state)

    def begin_frame(self, state: State, asleep: NDArray[np.bool_]) -> None:
        """Begin a frame from a state of the scene, in which some bodies (b,) sleep."""
        if len(self):
            self._g = coordinates_at(self._scene, state)
            self._free[:-1, 0] = ~(asleep[self._rigid.numbers] | self._rigid.held)
            self._total[:], self._motors[:], self._lacking[:], self._substeps = 0.0, 0.0, 0.0, 0

    def begin_substep(self, previous: Floats, origins: Floats, end: float, h: float) -> None:
        """Find the laws of the substep of h [s] that ends at `end` [s]; previous : (n, 3) places at its beginning."""
        begun = self._functions(previous + origins, end - h)
        self._laws, self._multipliers = laws_of(self.geometry, np.ones(len(self)), begun, (end - h, end), moving=True)
        self._begun, self._impulses = begun[self._laws.function], np.zeros(len(self._laws.k))
        self._on_corners[:] = 0.0
        self._substeps += 1

    def rows(
        self, points: Floats, previous: Floats, origins: Floats, end: float, h: float, inertia: Floats
    ) -> JointRows:
        """The rows at positions that may have changed since those before.

        Laws take back what they have pushed too much: only their impulse in total has ends. Otherwise a push of a
        contact that sweeps reduce later would leave energy.

        inertia : (b, 3, 3) inverse tensors of the bodies at `previous`
        """
        rows, first = self._rows(points[:, :3] + origins, previous + origins, end, h, inertia)
        rows.missing[first:] += rows.compliance[first:] * self._impulses
        rows.low[first:] -= self._impulses
        rows.high[first:] -= self._impulses
        return rows

    def note(self, rows: JointRows, impulses: Floats, x: Floats, h: float) -> None:
        """Note the impulses (r,) of rows that have been solved [kg m]; x (n, 3) are positions in the world."""
        first = len(impulses) - len(self._impulses)
        self._impulses += impulses[first:]
        self._note(rows, impulses / h**2, first, x)

    def add_forces(self, at: Substep, out: Floats) -> None:
        """Add the forces of the substep on control points to `out` (n, 3) [N]."""
        np.add.at(out, self.geometry.corners, self._on_corners)

    def end_substep(self, points: Floats, previous: Floats, origins: Floats, end: float, h: float) -> float:
        """Follow the angles of hinges over all turns; returns the work on the bodies in the substep of h [J].

        Conditions between bodies do none: what one side gives, the other takes.
        """
        if not len(self):
            return 0.0
        self._g = self._functions(points[:, :3] + origins, end)
        laws, efforts = self._laws, -self._impulses / h**2
        motors = laws.is_motor & laws.adapts & (efforts > laws.low) & (efforts < laws.high)
        rows = laws.function[motors]
        ways = np.column_stack([laws.start[motors] - self._g[rows], laws.start[motors] - self._begun[motors]])
        np.add.at(self._lacking, self.geometry.arguments[0].joint[rows], ways / self.geometry.units[rows, None])
        of_laws = self._impulses * (self._g[laws.function] - self._begun) / h**2
        corners = self.geometry.corners[self._driven]
        moved = points[corners, :3] - previous[corners]
        driven = float(np.einsum("jci,jci->", self._on_corners[self._driven], moved))
        return driven + float(of_laws[~self._driven[self.geometry.arguments[0].joint[laws.function]]].sum())

    def hinge_angles(self) -> dict[str, float]:
        """As of `State`."""
        g = self.geometry
        along = zip(g.joints, g.along, strict=True)
        return {str(joint.name): float(self._g[row]) for joint, row in along if row >= 0 and g.functions[row] == ANGLE}

    def fields(self, x: Floats, time: float) -> Mapping[str, Any]:
        """What the details of a frame that ended at world positions x (n, 3) have; forces are means over it."""
        if not len(self):
            return {}
        names = [str(joint.name) for joint in self.geometry.joints]
        means = self._total / max(self._substeps, 1)
        driven = [(k, name) for k, name in enumerate(names) if getattr(self.geometry.joints[k], "motor", None)]
        return {
            "joint_forces": dict(zip(names, means[:, :3].copy(), strict=True)),
            "joint_torques": dict(zip(names, means[:, 3:].copy(), strict=True)),
            "joint_coordinates": reported(self.geometry, self._g),
            "motor_forces": {name: float(self._motors[k]) / max(self._substeps, 1) for k, name in driven},
            "joint_violations": dict(zip(names, map(float, self.violations(x, time)), strict=True)),
        }

    def initial_fields(self, state: State) -> Mapping[str, Any]:
        """Those of a start, before any step."""
        return initial_joint_details(self._scene if len(self) else None, state)

    def violations(self, x: Floats, time: float) -> Floats:
        """(j,) how far each joint is from holding, as a share of its size, at world positions x (n, 3)."""
        g, out = self.geometry, np.zeros(len(self))
        apart = np.linalg.norm(_at(g, g.differences, x, g.poses(time)), axis=1)
        np.maximum.at(out, g.differences.joint, apart / g.sizes[g.differences.joint])
        joint = g.arguments[0].joint
        np.maximum.at(out, joint[g.across], np.abs(self._g[g.across]) / g.units[g.across])
        low, high = g.limits.T
        beyond = np.maximum(np.maximum(low - self._g, self._g - high), 0.0)
        np.maximum.at(out, joint, beyond / g.units)
        return out

    def apart(self, x: Floats, time: float, accuracy: float) -> list[tuple[float, str]]:
        """The violations of joints that do not hold, as shares of their sizes, with the joints' labels."""
        if not len(self):
            return []
        found = zip(self.violations(x, time).tolist(), self.geometry.joints, strict=True)
        return [(share, joint.label) for share, joint in found if share > min(accuracy, MOST_APART)]

    def stalled(self, accuracy: float) -> list[tuple[float, str]]:
        """What velocity motors lack of their way in the frame without their largest effort, with the joints' labels."""
        found = zip(*np.abs(self._lacking).T.tolist(), self.geometry.joints, strict=True)
        return [
            (lacks / max(way, _STALLED), joint.label)
            for lacks, way, joint in found
            if lacks > _STALLED and lacks > accuracy * max(way, _STALLED)
        ]

    def _functions(self, x: Floats, time: float) -> Floats:
        """(s,) values of the functions, with angles near the last ones."""
        g = self.geometry
        if not len(g.functions):
            return np.zeros(0)
        poses = g.poses(time)
        found = values(g.functions, np.stack([_at(g, column, x, poses) for column in g.arguments], axis=1))
        return np.where(self._angles, self._g + wrapped(found - self._g), found)

    def _rows(self, x: Floats, x_prev: Floats, time: float, h: float, inertia: Floats) -> tuple[JointRows, int]:
        """All rows, conditions first; and the first row of the laws."""
        laws, multipliers = self._laws, self._multipliers
        g, poses = self.geometry, self.geometry.poses(time)
        corners = x_prev[g.corners]
        centers = np.stack([corners[:, :4].mean(axis=1), corners[:, 4:].mean(axis=1)], axis=1)
        arms = corners - np.repeat(centers, 4, axis=1)
        # Differences: three rows each, along the axes of the world.
        apart = _at(g, g.differences, x, poses)
        gradients = [np.einsum("fk,ij->fikj", g.differences.coefficients, np.eye(3)).reshape(-1, 8, 3)]
        joint, missing = [np.repeat(g.differences.joint, 3)], [apart.ravel()]
        sizes = [g.sizes[joint[0]]]
        count = len(missing[0])
        low, high = [np.full(count, -np.inf)], [np.full(count, np.inf)]
        compliance = [np.zeros(count)]
        if len(g.functions):
            at = derivatives(g.functions, np.stack([_at(g, column, x, poses) for column in g.arguments], axis=1))
            now = np.where(self._angles, self._g + wrapped(at.value - self._g), at.value)
            C = np.stack([column.coefficients for column in g.arguments], axis=1)
            by_corner = np.einsum("sap,sai->spi", C, at.gradient)
            gradients.append(by_corner[laws.function])
            joint.append(g.arguments[0].joint[laws.function])
            soft = ~laws.adapts & (laws.k > 0.0)
            k = np.where(soft, laws.k, 1.0)
            missing.append(now[laws.function] - laws.start + np.where(soft, multipliers / k, 0.0))
            compliance.append(np.where(soft, 1.0 / (h * h * k), 0.0))
            given = ~laws.adapts & (laws.k == 0.0)
            low.append(-h * h * np.where(given, multipliers, laws.high))
            high.append(-h * h * np.where(given, multipliers, laws.low))
            sizes.append(g.units[laws.function])
        G, j = np.concatenate(gradients), np.concatenate(joint)
        self._gradients = G
        forces = np.stack([G[:, :4].sum(axis=1), G[:, 4:].sum(axis=1)], axis=1)
        turns = cross_rows(arms[j], G)
        moments = np.stack([turns[:, :4].sum(axis=1), turns[:, 4:].sum(axis=1)], axis=1)
        bodies = self._bodies[j]
        free = self._free[bodies, 0]
        both = free.all(axis=1)
        excess = (cross_rows(centers[j], forces) + moments).sum(axis=1)
        moments[both] -= 0.5 * excess[both, None]
        actions = np.concatenate([forces, moments], axis=2)
        w = np.where(free, 1.0 / self._rigid.masses[bodies], 0.0)
        turned = np.where(free[..., None], np.einsum("rbij,rbj->rbi", inertia[bodies], moments), 0.0)
        answers = np.concatenate([w[:, :, None] * forces, turned], axis=2)
        total = np.einsum("rbi,rbi->r", actions, answers)
        largest = np.zeros(len(self))
        np.maximum.at(largest, j, total)
        total[total <= _IDLE * largest[j]] = 0.0
        parts = (np.concatenate(each) for each in (missing, compliance, low, high, sizes))
        return JointRows(np.where(free, bodies, -1), actions, answers, total, *parts), count

    def _note(self, rows: JointRows, forces: Floats, first_law: int, x: Floats) -> None:
        """Add the forces (r,) of a substep to those of the frame, about the joints' points."""
        g, laws = self.geometry, self._laws
        joint = np.concatenate([np.repeat(g.differences.joint, 3), g.arguments[0].joint[laws.function]])
        actions = np.zeros((len(self), 6))
        np.add.at(actions, joint, forces[:, None] * rows.actions[:, 0])
        places = _at(g, g.centers, x, g.poses(0.0))
        arms = places - x[g.corners[:, :4]].mean(axis=1)
        actions[:, 3:] -= cross_rows(arms, actions[:, :3])
        self._total += actions
        np.add.at(self._on_corners, joint, forces[:, None, None] * self._gradients)
        np.add.at(self._motors, joint[first_law:][laws.is_motor], forces[first_law:][laws.is_motor])


def _at(geometry: JointGeometry, vectors: Vectors, x: Floats, poses: tuple[Floats, Floats]) -> Floats:
    """(f, 3) points, directions or differences at world positions x (n, 3)."""
    corners = x[geometry.corners[vectors.joint]]
    return np.einsum("fk,fki->fi", vectors.coefficients, corners) + vectors.offsets(poses)
