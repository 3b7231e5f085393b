"""What joints are at a state: their coordinates, whether they and welds hold, and what is reported before any step."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.model.joints.functions import COSINE, TWIST, turns, values
from supple.model.joints.geometry import JointGeometry
from supple.model.joints.laws import followed
from supple.model.state import State
from supple.model.system import System
from supple.scene.joints.axis_joint import AxisJoint

# At the start, the sides of a joint are placed up to round-off in what a user computed. A share of the joint's size.
_APART = 1e-3
# The same for welded vertices, as a share of the rigid body's size.
_OFF = 1e-6


def initial_joint_details(geometry: JointGeometry | None, start: State) -> dict[str, Any]:
    """The entries of `SolverDetails` at a start: no forces."""
    if geometry is None:
        return {}
    names = [str(joint.name) for joint in geometry.joints]
    driven = [str(one.name) for one in geometry.joints if isinstance(one, AxisJoint) and one.motor is not None]
    return {
        "joint_forces": {name: np.zeros(3) for name in names},
        "joint_torques": {name: np.zeros(3) for name in names},
        "joint_coordinates": reported(geometry, coordinates_at(geometry, start)),
        "motor_forces": dict.fromkeys(driven, 0.0),
        "joint_violations": dict.fromkeys(names, 0.0),
    }


def reported(geometry: JointGeometry, g: NDArray[np.float64]) -> dict[str, float]:
    """The coordinates of joints that have one, by name, of values g (s,) of the functions."""
    g = np.where(geometry.functions == COSINE, np.arccos(np.clip(g, -1.0, 1.0)), g)
    rows = zip(geometry.joints, geometry.along, strict=True)
    return {str(joint.name): float(g[row]) for joint, row in rows if row >= 0}


def coordinates_at(geometry: JointGeometry, state: State) -> NDArray[np.float64]:
    """(s,) the functions' values at a state, angles over all turns."""
    vectors = geometry.arguments
    arguments = geometry.at(vectors, state.positions, vectors.offsets(geometry.poses(state.time)))
    return followed(geometry, values(geometry.functions, arguments), state.hinge_angles, _APART)


def refuse_apart(geometry: JointGeometry, state: State) -> None:
    """Check that the joints hold where a simulation starts.

    Raises
    ------
    SceneError : where the two sides of one are apart, or its coordinate is outside of its limits; the text names it.
    """
    g = coordinates_at(geometry, state)
    vectors = geometry.differences
    q = geometry.at(vectors, state.positions, vectors.offsets(geometry.poses(state.time)))
    off = np.zeros(len(geometry.joints))
    np.maximum.at(off, vectors.joint, np.linalg.norm(q, axis=1))
    across = geometry.across
    joint = geometry.arguments.joint[across]
    np.maximum.at(off, joint, np.abs(g[across]) * geometry.sizes[joint] / geometry.units[across])
    for j, joint in enumerate(geometry.joints):
        if off[j] > _APART * geometry.sizes[j]:
            raise SceneError(
                f"{joint.label}: at the start it is off by {off[j]:.3g} m; start both sides where the joint holds"
            )
        for row in geometry.limited(j):
            (low, high), here = geometry.limits[row], float(g[row])
            slack = _APART * geometry.units[row]
            if low - slack <= here <= high + slack:
                continue
            if geometry.functions[row] == COSINE:
                here, low, high = np.arccos(np.clip(here, -1.0, 1.0)), 0.0, np.arccos(low)
            what = "its twist is" if geometry.functions[row] == TWIST else "it is at"
            unit = "rad" if geometry.functions[row] == COSINE or turns(geometry.functions)[row] else "m"
            raise SceneError(
                f"{joint.label}: at the start {what} {here:.4g} {unit}, outside of its limits ({low:g}, {high:g}); "
                "give limits that contain it"
            )


def refuse_moved_welds(system: System, state: State) -> None:
    """Check that welded vertices are in their places on the rigid bodies where a simulation starts.

    Raises
    ------
    SceneError : where one is not; the text names the weld and the vertex.
    """
    welding, x = system.welding, state.positions
    if not len(welding):
        return
    there = np.einsum("sk,ski->si", welding.weights, x[welding.control])
    sizes = np.linalg.norm(np.ptp(x[welding.control], axis=1), axis=1)
    off = np.linalg.norm(x[welding.vertices] - there, axis=1)
    worst = int((off / sizes).argmax())
    if off[worst] > _OFF * sizes[worst]:
        weld = system.scene.welds[welding.weld[worst]]
        begin = next(part.vertices.start for part in system.bodies if part.name == weld.body)
        raise SceneError(
            f"{weld.label}: at the start vertex {welding.vertices[worst] - begin} is {off[worst]:.3g} m off its place "
            f"on body {weld.rigid!r}; move both bodies together"
        )
