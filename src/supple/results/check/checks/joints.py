"""The checks of joints and welds: they hold; coordinates and rates stay in their limits, motors in their force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from supple.results.check.frame_check import FrameCheck
from supple.results.check.trajectory import Snapshot, Trajectory
from supple.scene.joints.joint import Function
from supple.scene.joints.placed import PlacedJoint

# Largest violations, as a share of the joint's size: of `Implicit`, and of solvers that correct positions step by step.
_IMPLICIT, _OTHERS = 1e-6, 1e-3
_TURN = 2.0 * np.pi


class Joints(FrameCheck):
    """How far each joint is from holding, from the places of its two sides alone.

    Lengths are divided by the diameter of gyration of the smaller body. Angles, in radians, count as they are.
    """

    name = "joints"
    needs = frozenset({"recording"})
    good = "hold within {worst} of the size of what they join"
    bad = "a joint is off by {worst} of the size of what it joins"

    def begin(self) -> None:
        if not self.of.joints:
            self.why_not = "the scene has no joint"
        forms = {one.form for joint in self.of.joints for one in joint.conditions.functions}
        if forms - FORMS.keys():
            self.why_not = f"what a joint holds is not known here: {', '.join(sorted(forms - FORMS.keys()))}"
        given = self.settings.max_joint_error
        self._most = given if given is not None else _IMPLICIT if self.of.implicit else _OTHERS
        self._before: dict[str, tuple[float, float]] = {}
        self._frames = [_Frame.of(self.of, joint) for joint in self.of.joints]

    def see(self, at: Snapshot) -> None:
        for joint, (effort, rate), frame in zip(self.of.joints, self.of.joint_limits, self._frames, strict=True):
            recorded = at.details.joint_coordinates.get(joint.name)
            error, coordinate, strain = frame.error(at, recorded)
            where = joint.name
            before, last = self._before.get(joint.name, (at.time, coordinate))
            self._before[joint.name] = at.time, coordinate
            if np.isfinite(rate):
                too_far = (abs(coordinate - last) - rate * (at.time - before)) / frame.unit
                error, where = (too_far, f"{joint.name}, its rate") if too_far > error else (error, where)
            differs = 0.0 if recorded is None else abs(coordinate - recorded) / frame.unit
            # Where a body is not quite rigid, an angle depends on the material that it is taken from.
            if differs > max(error, self._most, strain):
                error, where = differs, f"{joint.name}, its recorded coordinate"
            beyond = not abs(at.details.motor_forces.get(joint.name, 0.0)) <= effort * (1.0 + 1e-9)
            where = f"{joint.name}, its motor exceeds its largest effort" if beyond else where
            self.tally.see(at, error, beyond or not error <= self._most, where)


@dataclass(frozen=True, eq=False)
class _Frame:
    """A joint's point and axes in the coordinates of its two sides.

    Attributes
    ----------
    points : (2, 3); axes : (2, 3, 3) rows, the axis first, right-handed and perpendicular
    size : diameter of gyration of the smaller body [m]; unit : of the coordinate, `size` or one radian
    """

    trajectory: Trajectory
    joint: PlacedJoint
    points: NDArray[np.float64]
    axes: NDArray[np.float64]
    size: float
    unit: float

    @classmethod
    def of(cls, trajectory: Trajectory, joint: PlacedJoint) -> _Frame:
        R, t = joint.placed[:, :, :3], joint.placed[:, :, 3]
        bodies, sizes = trajectory.bodies, []
        for side in joint.sides:
            if side is not None and side < len(bodies):
                control = trajectory.rest_positions[bodies[side].vertices]
                sizes.append(2.0 * np.linalg.norm(control - control.mean(axis=0)) / np.sqrt(len(control)))
        size = float(min(sizes))
        points = np.einsum("sji,sj->si", R, joint.point - t)
        measure = joint.conditions.coordinate
        unit = size if measure is not None and measure.is_length else 1.0
        return cls(trajectory, joint, points, (joint.axes @ R).astype(np.float64), size, unit)

    def error(self, at: Snapshot, near: float | None) -> tuple[float, float, float]:
        """The error, the coordinate, and the larger |F^T F - 1| of the two sides.

        Of an angle, the coordinate is the one nearest to `near`, or to the middle of the limits.
        """
        (F, p), (G, q) = (self._side(at, k) for k in (0, 1))
        first, second, holds = self.axes[0] @ F.T, self.axes[1] @ G.T, self.joint.conditions
        vectors = {"apart": p - q} | {
            f"{side}.{k}": e for side, rows in (("first", first), ("second", second)) for k, e in enumerate(rows)
        }
        errors = [float(np.linalg.norm(p - q)) / self.size] if holds.together else [0.0]
        errors += [float(np.linalg.norm(first[k] - second[k])) for k in holds.parallel]
        coordinate = 0.0
        for one in holds.functions:
            value = FORMS[one.form]([vectors[name] for name in one.vectors], second @ first.T)
            value = _near(value, one, near) if one.form == "angle" else value
            unit, (low, high) = self.size if one.is_length else 1.0, one.limits
            errors.append(abs(value) / unit if one.vanishes else max(low - value, value - high, 0.0) / unit)
            coordinate = value if one is holds.coordinate else coordinate
        strain = max(float(np.linalg.norm(side.T @ side - np.eye(3))) for side in (F, G))
        return max(errors), coordinate, strain

    def _side(self, at: Snapshot, k: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The linear part (3, 3) of the motion of a side from its own coordinates, and where the joint's point is."""
        side, bodies = self.joint.sides[k], self.trajectory.bodies
        if side is None:
            return np.eye(3), self.points[k]
        if side >= len(bodies):
            pose = at.poses[side - len(bodies)]
            return pose[:, :3], pose[:, :3] @ self.points[k] + pose[:, 3]
        rows = bodies[side].vertices
        rest = self.trajectory.rest_positions[rows]
        affine = np.linalg.solve(np.column_stack([rest, np.ones(4)]), at.positions[rows]).astype(np.float64)
        return affine[:3].T, self.points[k] @ affine[:3] + affine[3]


def _near(angle: float, one: Function, near: float | None) -> float:
    """The angle over all turns that is nearest to `near`, or to the middle of the limits."""
    ends = [end for end in one.limits if np.isfinite(end)]
    middle = sum(ends) / len(ends) if near is None and ends else near or 0.0
    return angle + _TURN * round((middle - angle) / _TURN)


def _twist(R: NDArray[np.float64]) -> float:
    about, _, _, w = Rotation.from_matrix(R).as_quat()
    twist = 2.0 * np.arctan2(about, w)
    return float(twist - _TURN * np.round(twist / _TURN))


Vectors = list[NDArray[np.float64]]
# The values of functions, by their form; R : (3, 3) the rotation of the first side against the second, in the axes.
FORMS: dict[str, Callable[[Vectors, NDArray[np.float64]], float]] = {
    "product": lambda v, R: float(v[0] @ v[1]),
    "cosine": lambda v, R: float(np.arccos(np.clip(v[0] @ v[1], -1.0, 1.0))),
    "angle": lambda v, R: float(np.arctan2(v[0] @ v[2], v[0] @ v[1])),
    "twist": lambda v, R: _twist(R),
}


class Welds(FrameCheck):
    """How far welded vertices are from where the affine motion of the rigid body since the first frame puts them."""

    name = "welds"
    needs = frozenset({"recording"})
    good = "welded vertices stay in place within {worst} of the rigid body's size"
    bad = "a welded vertex is off by {worst} of the rigid body's size"

    def begin(self) -> None:
        if not self.of.welds:
            self.why_not = "the scene has no weld"

    def see(self, at: Snapshot) -> None:
        first = self.first or at
        for weld in self.of.welds:
            control = self.of.bodies[weld.rigid].vertices
            # About centers: far from the origin, a fit with a translation loses digits.
            before, now = (of.positions - of.positions[control].mean(axis=0) for of in (first, at))
            motion = np.linalg.lstsq(before[control], now[control], rcond=None)[0]
            there = before[weld.vertices] @ motion
            size = float(np.linalg.norm(np.ptp(before[control], axis=0)))
            off = np.linalg.norm(now[weld.vertices] - there, axis=1) / size
            worst = int(off.argmax())
            failed = not off[worst] <= self.settings.max_weld_error
            self.tally.see(at, float(off[worst]), failed, self.of.name("vertex", int(weld.vertices[worst])))
