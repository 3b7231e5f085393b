"""What a recording keeps of joints: what they hold, and where the scene places their sides."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.results.recording.checked_hdf5 import CheckedFile
from supple.scene.joints.conditions import FORMS, Conditions, Function
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rotation import rotation_matrix


@dataclass(frozen=True, eq=False)
class RecordedJoint:
    """One joint.

    Attributes
    ----------
    name : of the joint; kind : as scene files write it
    sides : numbers of what it joins: bodies, then obstacles; None for the world
    placed : (2, 3, 4) rotations and translations of the sides where the scene places everything, where the coordinate
        of the joint is zero
    point : (3,) there, in the world [m]; axes : (3, 3) unit vectors there (rows), which `conditions` numbers
    conditions : what it holds and measures
    max_force : of its motor [N m] or [N]; max_velocity : of its coordinate [rad/s] or [m/s]; infinite where there is
        none
    """

    name: str
    kind: str
    sides: tuple[int, int | None]
    placed: NDArray[np.float64]
    point: NDArray[np.float64]
    axes: NDArray[np.float64]
    conditions: Conditions
    max_force: float
    max_velocity: float

    def described(self) -> dict[str, Any]:
        """As the header has it."""
        arrays = {key: getattr(self, key).tolist() for key in ("placed", "point", "axes")}
        most = {key: _or_none(getattr(self, key)) for key in ("max_force", "max_velocity")}
        functions = [
            [one.form, one.vectors, [*map(_or_none, one.limits)], one.vanishes] for one in self.conditions.functions
        ]
        conditions = asdict(self.conditions) | {"functions": functions}
        return {"name": self.name, "kind": self.kind, "sides": self.sides, "conditions": conditions, **arrays, **most}


def joints_of(system: System) -> tuple[RecordedJoint, ...]:
    """The joints of a scene."""
    bodies = {body.name: body for body in system.scene.bodies}
    obstacles = {str(obstacle.name): obstacle for obstacle in system.obstacles}
    number: dict[str | None, int] = {name: k for k, name in enumerate([*bodies, *obstacles])}
    joints = []
    for joint in system.scene.joints:
        placed = []
        for name in (joint.first, joint.second):
            R, t = np.eye(3), np.zeros(3)
            if name in bodies:
                R, t = rotation_matrix(bodies[name].rotation), np.asarray(bodies[name].position)
            elif name in obstacles:
                R, t = obstacles[name].pose(0.0)
            placed.append(np.column_stack([R, t]))
        first = bodies[joint.first]
        assert isinstance(first, RigidBody)
        most = [getattr(getattr(joint, "motor", None), "max_force", None), getattr(joint, "max_velocity", None)]
        sides = number[joint.first], number.get(joint.second)
        where = np.array(placed), np.asarray(joint.place(first), dtype=np.float64), joint.axes()
        ends = [np.inf if end is None else float(end) for end in most]
        joints.append(RecordedJoint(str(joint.name), joint.kind, sides, *where, joint.conditions(), *ends))
    return tuple(joints)


def read_joints(file: CheckedFile, header: dict[str, Any]) -> tuple[RecordedJoint, ...]:
    """The joints of a recording.

    Raises
    ------
    OutputError : where one is not described as it should be, or joins what does not exist or is soft.
    """
    jointed = [body.get("rigid") is True for body in header["bodies"]] + [True] * len(header["obstacles"])
    joints = []
    try:
        for given in header["physics"]["joints"]:
            first, second = int(given["sides"][0]), given["sides"][1]
            shapes = {"placed": (2, 3, 4), "point": (3,), "axes": (3, 3)}
            arrays = {key: np.array(given[key], dtype=np.float64).reshape(shape) for key, shape in shapes.items()}
            most = [_end(given[key], np.inf) for key in ("max_force", "max_velocity")]
            sides = first, None if second is None else int(second)
            holds = _conditions(given["conditions"])
            joints.append(
                RecordedJoint(
                    str(given["name"]),
                    str(given["kind"]),
                    sides,
                    **arrays,
                    conditions=holds,
                    max_force=most[0],
                    max_velocity=most[1],
                )
            )
            numbers = np.concatenate([array.ravel() for array in arrays.values()])
            ends = [end for end in sides if end is not None]
            there = first < len(header["bodies"]) and min(ends) >= 0 and all(jointed[end] for end in ends)
            upright = np.allclose(arrays["axes"] @ arrays["axes"].T, np.eye(3), atol=1e-6)
            if not np.isfinite(numbers).all() or not upright or not there:
                raise ValueError
    except (KeyError, TypeError, ValueError, IndexError, OverflowError):
        raise file.broken("its joints are not described as they should be") from None
    return tuple(joints)


_VECTORS = {"apart", *(f"{side}.{k}" for side in ("first", "second") for k in range(3))}


def _conditions(given: dict[str, Any]) -> Conditions:
    functions = []
    for form, vectors, (low, high), vanishes in given["functions"]:
        if form not in FORMS or len(vectors) != {"angle": 3, "twist": 4}.get(form, 2):
            raise ValueError
        functions.append(Function(form, tuple(vectors), (_end(low, -np.inf), _end(high, np.inf)), bool(vanishes)))
    lines, parallel = tuple(given["lines"]), tuple(map(int, given["parallel"]))
    named = {*lines, *(name for one in functions for name in one.vectors)}
    if not named <= _VECTORS or "apart" in lines or not {*parallel} <= {0, 1, 2}:
        raise ValueError
    return Conditions(bool(given["together"]), parallel, tuple(functions), lines)


def _or_none(end: float) -> float | None:
    return float(end) if np.isfinite(end) else None


def _end(given: object, otherwise: float) -> float:
    return otherwise if given is None else float(given)  # pyright: ignore[reportArgumentType]
