"""Joints as functions of the control points.

What a joint compares are points and directions that are fixed on its two sides. On a rigid body they are combinations
of its four control points, with weights that sum to 1 for a point and to 0 for a direction; on an obstacle or in the
world they are known at every time. So each is an affine function of eight control points,

    q = sum c_k x_k + R(t) X + w t(t),    w = 1 for a point, 0 for a direction,

with the pose R, t of the obstacle. The differences of two of them, first side minus second, vanish:

    fixed    the point, and three directions
    ball     the point
    hinge    the point, and the direction of the axis
    slider   three directions

They are linear, so that no turn of the bodies changes their derivatives. The remaining conditions, and the coordinates,
are functions of two to four such vectors, a, b, d and f. Every kind of joint says which (`Joint.conditions`):

    slider   r . e = 0 for the two directions e of the second across the axis, with the difference r of the points;
             its travel is r . e for the axis e of the second
    hinge    its angle is atan2(a . d, a . b), with a direction a of the first across the axis, which was b of the
             second at angle zero, and d = axis x b of the second
    ball     with limits, the cosine a . b of its swing, with the axes a of the first and b of the second; and its
             twist atan2(a . d - f . b, a . b + f . d) about the axis, with the directions a and f of the first across
             the axis, which were b and d of the second at twist zero
    universal  a . b = 0 for the axes a of the first and b of the second

The rotation R of the first against the second, in axes of which the first is the joint's, has the twist atan2(R_21 -
R_12, R_11 + R_22) = 2 atan2(q_0, w) with its quaternion (w, q): R is this turn about the axis, and then one about a
line across it (Dobrowolski, "Swing-twist decomposition in Clifford algebra", 2015).

Source: Lan et al., "Affine Body Dynamics" (2022), section 5, for joints that are linear in affine coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.model.joints.functions import FORMS
from supple.model.system import System
from supple.scene.joints.joint import Joint
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rotation import rotation_matrix


@dataclass(frozen=True, eq=False)
class Vectors:
    """Points and directions, or differences of such, in an array of any shape for each of the f rows.

    Attributes
    ----------
    joint : (f,) the number of the joint
    coefficients : (f, ..., 8) of the joint's control points
    world : (f, ..., 3) X; is_point : (f, ...) w, of what the second side does not move with control points
    """

    joint: NDArray[np.int64]
    coefficients: NDArray[np.float64]
    world: NDArray[np.float64]
    is_point: NDArray[np.float64]

    @classmethod
    def of(cls, joint: Sequence[int], vectors: Sequence[_Vector], *shape: int) -> Vectors:
        """The vectors, of this shape for each of the rows with the numbers of their joints."""
        rows = (len(joint), *shape)
        return cls(
            np.array(joint, dtype=np.int64),
            np.array([one.coefficients for one in vectors], dtype=np.float64).reshape(*rows, 8),
            np.array([one.world for one in vectors], dtype=np.float64).reshape(*rows, 3),
            np.array([one.is_point for one in vectors], dtype=np.float64).reshape(rows),
        )

    def offsets(self, poses: tuple[NDArray[np.float64], NDArray[np.float64]]) -> NDArray[np.float64]:
        """(f, ..., 3) R X + w t, with the poses (j, 3, 3), (j, 3) of the joints' second sides [m]."""
        R, t = poses
        turned = np.einsum("fij,f...j->f...i", R[self.joint], self.world)
        return turned + np.einsum("f...,fi->f...i", self.is_point, t[self.joint])


@dataclass(frozen=True, eq=False)
class JointGeometry:
    """The joints of a system, in the scene's order.

    Attributes
    ----------
    corners : (j, 8) control points of the first side, then of the second; the latter repeat the first's, with
        coefficients of zero, where the second is not a body
    alone : (j,) whether the second is not a body
    sizes : (j,) diameter of gyration of the smaller body [m], by which directions are multiplied in `differences`
    stiffness : (j,) of the smaller body against strain [N/m]; masses : (j,) of the lighter one [kg]
    centers : where forces are reduced to, the joint's points
    differences : of the two sides, all of which vanish
    functions : (s,) places in `FORMS`; arguments : (s, 4) their vectors a, b, d and f
    units : (s,) changes of the functions that count as much as a motion by the joint's size
    across, along : rows of `functions` that vanish; and the one that gives each joint's coordinate, or -1
    limits : (s, 2) of the functions, infinite where there are none
    """

    joints: tuple[Joint, ...]
    system: System
    corners: NDArray[np.int32]
    alone: NDArray[np.bool_]
    sizes: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    masses: NDArray[np.float64]
    centers: Vectors
    differences: Vectors
    functions: NDArray[np.int64]
    arguments: Vectors
    units: NDArray[np.float64]
    across: NDArray[np.int64]
    along: NDArray[np.int64]
    limits: NDArray[np.float64]

    @classmethod
    def of(cls, system: System) -> JointGeometry:
        """The joints of the system's scene."""
        sides = [(_Side(system, one, one.first, 0), _Side(system, one, one.second, 4)) for one in system.scene.joints]
        centers, apart, functions, arguments = [], [], [], []
        of_apart, of_function = [], []
        limits: list[tuple[float, float]] = []
        units, across, along = [], [], np.full(len(sides), -1)
        for j, (joint, (first, second)) in enumerate(zip(system.scene.joints, sides, strict=True)):
            body = system.scene.body(joint.first)
            assert isinstance(body, RigidBody)
            place, axes, holds = joint.place(body), joint.axes(), joint.conditions()
            size = min(side.size for side in (first, second))
            R, shift = joint.motion_to_start()
            point = first.point(R @ place + shift)
            vectors = {"apart": point - second.point(place)}
            for k, e in enumerate(axes):
                vectors[f"first.{k}"], vectors[f"second.{k}"] = first.direction(R @ e), second.direction(e)
            centers.append(point)
            apart += [vectors["apart"]] if holds.together else []
            apart += [size * (vectors[f"first.{k}"] - vectors[f"second.{k}"]) for k in holds.parallel]
            of_apart += [j] * (len(apart) - len(of_apart))
            for one in holds.functions:
                if one.vanishes:
                    across.append(len(functions))
                elif along[j] < 0:
                    along[j] = len(functions)
                functions.append(list(FORMS).index(one.form))
                units.append(size if one.is_length else 1.0)
                limits.append(one.limits)
                if one.form == "cosine":  # of an angle that is at most the second limit
                    units[-1], limits[-1] = np.sin(one.limits[1]), (np.cos(one.limits[1]), np.inf)
                given = [vectors[name] for name in one.vectors]
                # A product has no third vector, and only a twist has a fourth.
                given += [given[1] if len(given) == 2 and column == 2 else _NOTHING for column in range(len(given), 4)]
                arguments += given
                of_function.append(j)
        return cls(
            joints=tuple(system.scene.joints),
            system=system,
            corners=np.array([_corners(*pair) for pair in sides], dtype=np.int32).reshape(-1, 8),
            alone=np.array([second.body is None for _, second in sides], dtype=np.bool_),
            sizes=np.array([min(side.size for side in pair) for pair in sides]),
            stiffness=np.array([min(side.stiffness for side in pair) for pair in sides]),
            masses=np.array([min(side.mass for side in pair) for pair in sides]),
            centers=Vectors.of(range(len(sides)), centers),
            differences=Vectors.of(of_apart, apart),
            functions=np.array(functions, dtype=np.int64),
            arguments=Vectors.of(of_function, arguments, 4),
            units=np.array(units, dtype=np.float64),
            across=np.array(across, dtype=np.int64),
            along=along,
            limits=np.array(limits, dtype=np.float64).reshape(-1, 2),
        )

    def limited(self, joint: int) -> NDArray[np.int64]:
        """The functions of a joint that have limits."""
        return np.flatnonzero((self.arguments.joint == joint) & np.isfinite(self.limits).any(axis=1))

    def at(self, vectors: Vectors, x: NDArray[np.float64], offsets: NDArray[np.float64]) -> NDArray[np.float64]:
        """(f, ..., 3) some vectors at positions x (n, 3), with their `offsets`."""
        return np.einsum("f...k,fki->f...i", vectors.coefficients, x[self.corners[vectors.joint]]) + offsets

    def poses(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rotations (j, 3, 3) and translations (j, 3) [m] of the second sides that are obstacles, at `time` [s]."""
        R, t = np.tile(np.eye(3), (len(self.joints), 1, 1)), np.zeros((len(self.joints), 3))
        obstacles = {obstacle.name: obstacle for obstacle in self.system.obstacles}
        for j, joint in enumerate(self.joints):
            if joint.second in obstacles:
                R[j], t[j] = obstacles[joint.second].pose(time)
        return R, t


@dataclass(frozen=True, eq=False)
class _Vector:
    coefficients: NDArray[np.float64]
    world: NDArray[np.float64]
    is_point: float

    def __sub__(self, other: _Vector) -> _Vector:
        return _Vector(self.coefficients - other.coefficients, self.world - other.world, self.is_point - other.is_point)

    def __rmul__(self, factor: float) -> _Vector:
        return _Vector(factor * self.coefficients, factor * self.world, factor * self.is_point)


_NOTHING = _Vector(np.zeros(8), np.zeros(3), 0.0)


class _Side:
    """One side of a joint: a rigid body, whose control points have the places `begin`, ... of the eight, or not."""

    def __init__(self, system: System, joint: Joint, name: str | None, begin: int) -> None:
        self.begin = begin
        self.body: RigidBody | None = None
        self.mass = self.size = self.stiffness = np.inf
        for part in system.bodies:
            if part.name == name and isinstance(part.body, RigidBody):
                self.body, self.vertices = part.body, np.arange(part.vertices.start, part.vertices.stop)
                properties = part.body.properties
                self.mass = properties.mass
                self.size = 2.0 * float(np.sqrt(np.trace(properties.second_moment) / properties.mass))
                self.stiffness = part.body.kappa * properties.volume / (0.5 * self.size) ** 2
        # Where an obstacle is when the scene places the bodies, at time 0.
        self.R, self.t = np.eye(3), np.zeros(3)
        for obstacle in system.obstacles:
            if obstacle.name == name:
                self.R, self.t = obstacle.pose(0.0)

    def point(self, place: NDArray[np.float64]) -> _Vector:
        """A point that is at `place` (3,) where the scene places everything."""
        if self.body is None:
            return _Vector(np.zeros(8), self.R.T @ (place - self.t), 1.0)
        return _Vector(self._weights(place), np.zeros(3), 0.0)

    def direction(self, along: NDArray[np.float64]) -> _Vector:
        """A direction (3,) that turns with this side."""
        if self.body is None:
            return _Vector(np.zeros(8), self.R.T @ along, 0.0)
        start = self.body.place(self.body.properties.center)
        return _Vector(self._weights(start + along) - self._weights(start), np.zeros(3), 0.0)

    def _weights(self, place: NDArray[np.float64]) -> NDArray[np.float64]:
        assert self.body is not None
        R = rotation_matrix(self.body.rotation)
        out = np.zeros(8)
        out[self.begin : self.begin + 4] = self.body.weights_of(((place - np.asarray(self.body.position)) @ R)[None])[0]
        return out


def _corners(first: _Side, second: _Side) -> NDArray[np.int64]:
    return np.concatenate([first.vertices, first.vertices if second.body is None else second.vertices])
