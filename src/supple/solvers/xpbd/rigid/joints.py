"""The joints of a system in the frames of `XPBD`: what kernels take, and what is reported; see `joint_rows`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.model.joints.at_state import coordinates_at, initial_joint_details, refuse_apart, reported
from supple.model.joints.functions import ANGLE, PRODUCT, TWIST, evaluated, turns
from supple.model.joints.geometry import JointGeometry
from supple.model.joints.laws import Laws, condition, laws_of
from supple.model.state import State
from supple.model.system import System
from supple.solvers.xpbd.moment import Substep
from supple.solvers.xpbd.rigid.bodies import RigidBodies
from supple.solvers.xpbd.rigid.joint_rows import FUNCTION, JOINT, ROW, Joints, end_substep
from supple.solvers.xpbd.sweeps.ordering import Layout

Floats = NDArray[np.float64]

# Of the joint's size: what motors may lack in a frame, because of errors that contact leaves in substeps.
_STALLED = 1e-3
# Of the size of a joint: by how much it may be off in a frame that has converged.
MOST_APART = 1e-3


class JointProjection:
    """The joints of a system, in the solver's numbering.

    Attributes
    ----------
    record : of the frame, as kernels take it; substep : number of the present one, or of the next
    at_once : whether kernels know all functions
    """

    def __init__(self, system: System, layout: Layout, rigid: RigidBodies) -> None:
        self._scene = JointGeometry.of(system)
        self.geometry = g = replace(self._scene, corners=layout.new_from_old[self._scene.corners])
        self._rigid, self.substep = rigid, 0
        self._bodies = np.where(g.alone[:, None] & [False, True], -1, rigid.of_vertex[g.corners[:, [0, 4]]])
        moving = {obstacle.name for obstacle in system.obstacles if obstacle.motion is not None}
        joints = np.zeros(len(g.joints), dtype=JOINT)
        joints["corners"], joints["center"] = g.corners, g.centers.coefficients
        joints["driven"] = [joint.second in moving for joint in g.joints]
        # A difference of the two sides is three products with the axes of the world.
        apart, s = np.repeat(g.differences.joint, 3), len(g.functions)
        functions = np.zeros(s + len(apart), dtype=FUNCTION)
        functions["form"] = np.concatenate([g.functions, np.full(len(apart), PRODUCT)])
        functions["joint"] = np.concatenate([g.arguments.joint, apart])
        functions["unit"] = np.concatenate([g.units, g.sizes[apart]])
        functions["turns"] = turns(functions["form"])
        functions["coefficients"][:s] = g.arguments.coefficients
        functions["coefficients"][s:, 0] = g.differences.coefficients.repeat(3, axis=0)
        self.at_once = bool((functions["form"] <= TWIST).all())
        none = np.zeros((0, 0))
        self.record = Joints(joints, functions, np.zeros(0, dtype=ROW), np.zeros((0, 0, 4, 3)), none, none)

    def __len__(self) -> int:
        return len(self.geometry.joints)

    def check(self, state: State) -> None:
        """Raise `SceneError` where a joint does not hold at a start; see `refuse_apart`."""
        if len(self):
            refuse_apart(self._scene, state)

    def begin_frame(self, state: State, asleep: NDArray[np.bool_], origin: Floats, times: Floats) -> None:
        """Begin a frame from a state of the scene.

        Parameters
        ----------
        asleep : (b,) bodies that do not move; origin : (3,) of places [m]
        times : (t + 1,) begins of the substeps, and the end of the last [s]
        """
        if not len(self):
            return
        joints, functions, *_ = self.record
        g, s = self.geometry, len(self.geometry.functions)
        laws = [condition(row, 1.0) for row in range(s, len(functions))]
        laws += laws_of(g, np.ones(len(self)), times, moving=True)
        rows = np.zeros(len(laws), dtype=ROW)
        rows["law"], step, given = Laws.of(laws, len(times) - 1)
        function = rows["law"]["function"]
        rows["is_difference"], rows["joint"] = function >= s, functions["joint"][function]
        rows["size"] = functions["unit"][function]
        free = np.append(~(asleep[self._rigid.numbers] | self._rigid.held), False)
        rows["bodies"] = np.where(free[self._bodies], self._bodies, -1)[rows["joint"]]
        functions["begun"][:s] = coordinates_at(self._scene, state)
        for name in ("total", "effort", "lacking", "way"):
            joints[name] = 0.0
        self.record, self.substep = Joints(joints, functions, rows, self._offsets(origin, times), step, given), 0

    def _offsets(self, origin: Floats, times: Floats) -> Floats:
        """(t + 1, s, 4, 3) as of `Joints`."""
        g, moved, s = self.geometry, self.record.joints["driven"].any(), len(self.geometry.functions)
        out = np.zeros((len(times), len(self.record.functions), 4, 3))
        for k, time in enumerate(times if moved else times[:1]):
            poses = g.poses(float(time))
            for vectors, rows in ((g.arguments, out[k, :s]), (g.differences, out[k, s::3, 0])):
                rows[:] = vectors.offsets(poses) + vectors.coefficients.sum(axis=-1)[..., None] * origin
        out[:, s + 1 :: 3, 0] = out[:, s + 2 :: 3, 0] = out[:, s::3, 0]
        for i in range(3):
            out[:, s + i :: 3, 1, i] = 1.0
        if not moved:
            out[1:] = out[0]
        return out

    def evaluate_others(self, x: Floats) -> None:
        """Evaluate the functions that kernels do not know, at places x (N, >= 3) at the end of the substep."""
        if not self.at_once:
            joints, functions, _, offsets, *_ = self.record
            corners = x[joints["corners"][functions["joint"]], :3]
            vectors = np.einsum("sak,ski->sai", functions["coefficients"], corners) + offsets[self.substep + 1]
            functions["given"], functions["given_gradient"], _ = evaluated(functions["form"], vectors, second=False)

    def end_substep(self, points: Floats, previous: Floats, h: float) -> float:
        """Follow the angles of hinges over all turns; returns the work on the bodies in the substep of h [J]."""
        self.evaluate_others(points)
        self.substep += 1
        return end_substep(*self.record[:3], self.record.offsets[self.substep], points, previous, h)

    def add_forces(self, at: Substep, out: Floats) -> None:
        """Add the forces of the substep on control points to `out` (n, 3) [N]."""
        np.add.at(out, self.geometry.corners, self.record.joints["on_corners"])

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
        means, efforts = (self.record.joints[name] / max(self.substep, 1) for name in ("total", "effort"))
        driven = [(k, name) for k, name in enumerate(names) if getattr(self.geometry.joints[k], "motor", None)]
        return {
            "joint_forces": dict(zip(names, means[:, :3].copy(), strict=True)),
            "joint_torques": dict(zip(names, means[:, 3:].copy(), strict=True)),
            "joint_coordinates": reported(self.geometry, self._g),
            "motor_forces": {name: float(efforts[k]) for k, name in driven},
            "joint_violations": dict(zip(names, map(float, self.violations(x, time)), strict=True)),
        }

    def initial_fields(self, state: State) -> Mapping[str, Any]:
        """Those of a start, before any step."""
        return initial_joint_details(self._scene if len(self) else None, state)

    def violations(self, x: Floats, time: float) -> Floats:
        """(j,) how far each joint is from holding, as a share of its size, at world positions x (n, 3)."""
        g, out = self.geometry, np.zeros(len(self))
        apart = np.linalg.norm(g.at(g.differences, x, g.differences.offsets(g.poses(time))), axis=1)
        np.maximum.at(out, g.differences.joint, apart / g.sizes[g.differences.joint])
        joint = g.arguments.joint
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
        joints = self.record.joints
        found = zip(*(np.abs(joints[name]).tolist() for name in ("lacking", "way")), self.geometry.joints, strict=True)
        return [
            (lacks / max(way, _STALLED), joint.label)
            for lacks, way, joint in found
            if lacks > _STALLED and lacks > accuracy * max(way, _STALLED)
        ]

    @property
    def _g(self) -> Floats:
        """(s,) values of the geometry's functions, angles over all turns."""
        return self.record.functions["begun"][: len(self.geometry.functions)]
