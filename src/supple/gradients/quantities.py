"""What frames read, with derivatives by positions, velocities and forces of pins: each is defined once, as a matrix.

A reading that is a function of positions has them from its definition: angles of vertices by the derivative of the
polar decomposition, coordinates of joints, cavities and cables by the Jacobians that solvers use.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, eye_array, kron

from supple.errors import SceneError
from supple.kinds.suggestion import suggestion
from supple.mesh.skin import Embedding
from supple.model.joints.at_state import coordinates_at, reported
from supple.model.joints.functions import COSINE, derivatives
from supple.model.joints.geometry import JointGeometry
from supple.model.loads.actuators.laws import GivenValue
from supple.model.pin_reactions import pin_labels
from supple.model.state import State
from supple.model.system import BodyRange, System
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.results.frame import Frame
from supple.results.readings.sensor_readings import angle_of
from supple.scene.loads.points import point_corners
from supple.scene.rigid.pose import rotation_of
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.sensors import AngleSensor, DistanceSensor
from supple.solvers.implicit.details import ImplicitDetails
from supple.solvers.implicit.energies.joints import JointPotential

Floats = NDArray[np.float64]


# What is asked for: a `Misfit`.
Asked = Any


class Reading(NamedTuple):
    """Values, (), (3,) or (k, 3), and their derivatives (r, 3 n) by what the quantity is a function of."""

    values: Floats
    matrix: Any


class Quantity(NamedTuple):
    """A quantity of a state.

    Attributes
    ----------
    axes : how many a reading has: 0 of a number, 1 of a vector, 2 of vectors
    by : what it is a function of: "x", "v", or forces of a step: "pins", those of pins and obstacles, "contact", and
        "held", those of actuators with a given coordinate
    read : what is asked, system, state -> reading; None of forces, which the report of a step has
    """

    axes: int
    by: str
    read: Callable[[Asked, System, State], Reading] | None


def _chosen(name: str, known: Sequence[str], label: str, what: str) -> int:
    if name not in known:
        raise SceneError(f"{label}: {what} {name!r} does not exist; {suggestion(name, list(known))}")
    return known.index(name)


def _points_of(asked: Asked, system: System) -> Any:
    """(3 k, 3 n) the matrix that takes positions of vertices to those of what is asked for."""
    part = system.bodies[_chosen(asked.of, [part.name for part in system.bodies], asked.label, "body")]
    if asked.points is None:
        return points_of(system, part, asked.vertices, asked.label)
    corners, weights = _embedded(part.body, asked.points.tobytes())
    return _matrix(EmbeddedPoints.in_rows(corners + np.int32(part.vertices.start), weights), system)


@lru_cache(maxsize=16)
def _embedded(body: Any, points: bytes) -> tuple[NDArray[np.int32], Floats]:
    """Vertices of a body and their weights (k, w), of points in its own coordinates; a run asks in every frame."""
    places = np.frombuffer(points).reshape(-1, 3)
    if isinstance(body, RigidBody):
        return np.tile(np.arange(4, dtype=np.int32), (len(places), 1)), body.weights_of(places)
    held = Embedding.of(body.mesh, places)
    return held.corners.astype(np.int32), np.asarray(held.weights)


def points_of(system: System, part: BodyRange, rows: NDArray[np.int64] | None, label: str) -> Any:
    """(3 k, 3 n) the matrix that takes positions of vertices to those of points of a body, all or some `rows`."""
    own = part.points if part.rigid else part.vertices
    count = own.stop - own.start
    if rows is not None and len(rows) and not 0 <= rows.min() <= rows.max() < count:
        raise SceneError(f"{label}: the body has vertices 0 to {count - 1}")
    chosen = np.arange(own.start, own.stop, dtype=np.int32)
    chosen = chosen if rows is None else chosen[rows]
    points = system.points.taken(chosen) if part.rigid else EmbeddedPoints.at_vertices(chosen)
    return _matrix(points, system)


def _matrix(points: EmbeddedPoints, system: System) -> Any:
    shape = len(points), len(system.rest_positions)
    return csr_array(kron(csr_array((points.weights, points.vertices, points.start), shape=shape), eye_array(3)))


def _points(asked: Asked, system: System, state: State) -> Reading:
    matrix, values = _points_of(asked, system), state.velocities if asked.quantity == "velocities" else state.positions
    return Reading((matrix @ values.ravel()).reshape(-1, 3), matrix)


def _center(asked: Asked, system: System, state: State) -> Reading:
    of_points = _points_of(asked, system)
    k = of_points.shape[0] // 3
    matrix = csr_array(kron(np.full((1, k), 1.0 / k), eye_array(3))) @ of_points
    return Reading(matrix @ state.positions.ravel(), matrix)


def _sensor(asked: Asked, system: System, state: State) -> Reading:
    sensors, x = system.scene.sensors, state.positions
    sensor = sensors[_chosen(asked.of, [one.name for one in sensors], asked.label, "sensor")]
    out = np.zeros_like(x)
    if isinstance(sensor, DistanceSensor):
        ends = []
        for point in (sensor.first, sensor.second):
            name, corners, weights, place = point_corners(point, system.scene.bodies, sensor.label)
            if name is not None:
                corners = corners + next(part.vertices.start for part in system.bodies if part.name == name)
                place = weights @ x[corners]
            ends.append((corners, weights, place))
        apart = ends[1][2] - ends[0][2]
        distance = float(np.linalg.norm(apart))
        for (corners, weights, _), sign in zip(ends, (-1.0, 1.0), strict=True):
            np.add.at(out, corners, sign * weights[:, None] * apart / (distance or 1.0))
        return _number(distance, out)
    if isinstance(sensor, AngleSensor):
        part = next(part for part in system.bodies if part.name == sensor.body)
        start = part.body.place(part.body.points)
        rows = np.arange(len(start))[sensor.select(start)]
        of_points = points_of(system, part, rows, sensor.label)
        angle, by = _angle(sensor, start[rows], (of_points @ x.ravel()).reshape(-1, 3))
        return Reading(np.array(angle), csr_array(by.reshape(1, -1)) @ of_points)
    raise SceneError(
        f"{asked.label}: a {type(sensor).title} feels parts of surfaces, whose shares of forces have no derivative; "
        "give the 'reaction' of what it touches"
    )


def _angle(sensor: AngleSensor, rest: Floats, x: Floats) -> tuple[float, Floats]:
    """The angle, and its derivative (k, 3) by x (k, 3).

    With A = sum x X^T = R S, a turn of R to R exp([w]) obeys (tr S - S) w = sum X x (R^T dx).
    """
    arms, R = rest - rest.mean(axis=0), rotation_of(rest, x)
    S = R.T @ (x - x.mean(axis=0)).T @ arms
    angle, by_turn = angle_of(sensor, R)
    return angle, np.cross(np.linalg.solve(np.trace(S) * np.eye(3) - S, by_turn), arms) @ R.T


def _joint(asked: Asked, system: System, state: State) -> Reading:
    names = [str(joint.name) for joint in system.scene.joints]
    j, out = _chosen(asked.of, names, asked.label, "joint"), np.zeros_like(state.positions)
    geometry = JointGeometry.of(system)
    row = geometry.along[j]
    if row < 0:
        raise SceneError(f"{asked.label}: {system.scene.joints[j].label} has no coordinate")
    vectors = geometry.arguments
    at = derivatives(
        geometry.functions, geometry.at(vectors, state.positions, vectors.offsets(geometry.poses(state.time)))
    )
    by = np.zeros_like(at.gradient)
    by[row] = at.gradient[row]
    if geometry.functions[row] == COSINE:
        by[row] /= -np.sqrt(max(1.0 - at.value[row] ** 2, np.finfo(float).tiny))
    JointPotential.add_by_vectors(geometry, by, out)
    return _number(reported(geometry, coordinates_at(geometry, state))[asked.of], out)


def _actuator(asked: Asked, system: System, state: State) -> Reading:
    """The coordinate of a cavity or cable, or the force that its law has there."""
    kind = "cable" if asked.quantity == "length" else "cavity"
    known = [one for one in system.actuators if one.kind == kind]
    one = known[_chosen(asked.of, [one.name for one in known], asked.label, kind)]
    out, own = np.zeros_like(state.positions), state.positions[one.coordinate.vertices]
    out[one.coordinate.vertices] = one.coordinate.gradient(own)
    s, law = one.coordinate.value(own), one.law.at(state.time, 0.0)
    return _number(law.force(s), -law.stiffness(s) * out) if asked.quantity == "pressure" else _number(s, out)


def _number(value: float, by: Floats) -> Reading:
    return Reading(np.array(value), csr_array(by.reshape(1, -1)))


def driver_of(asked: Asked, system: System) -> int:
    """The number among the pins and, after them, the obstacles."""
    pins = zip(pin_labels(system), system.pins, strict=True)
    known = [(pin.pin.name, label, f"{pin.pin.body}.pin") for label, pin in pins]
    known += [(str(obstacle.name),) for obstacle in system.obstacles]
    for k, names in enumerate(known):
        if asked.of in names:
            return k
    names = [next(filter(None, names)) for names in known]
    raise SceneError(f"{asked.label}: pin or obstacle {asked.of!r} does not exist; {suggestion(asked.of, names)}")


def sum_of(vertices: NDArray[np.integer], n: int) -> Any:
    """(3, 3 n) the matrix that takes forces on all vertices to their sum over some."""
    row = csr_array((np.ones(len(vertices)), (np.zeros(len(vertices), int), vertices)), shape=(1, n))
    return csr_array(kron(row, eye_array(3)))


def quantity_of(asked: Asked, system: System) -> Quantity:
    """What a system has of the quantity that is asked for: the pressure of a given volume is a force of the step."""
    quantity = QUANTITIES[asked.quantity]
    of_cavity = [one for one in system.actuators if one.kind == "cavity" and one.name == asked.of]
    if asked.quantity == "pressure" and any(one.name in _held(system) for one in of_cavity):
        return Quantity(0, "held", None)
    return quantity


def _held(system: System) -> list[str]:
    return [one.name for one in system.actuators if isinstance(one.law, GivenValue)]


def forces_matrix(asked: Asked, system: System, whole: System) -> Any:
    """The matrix that takes forces of a step to what is asked for; whole : the system with obstacles' vertices"""
    by, n = quantity_of(asked, system).by, len(whole.rest_positions)
    if by == "held":
        return csr_array(np.eye(len(_held(system)))[[_held(system).index(asked.of)]])
    if by == "pins":
        return sum_of(whole.pins[driver_of(asked, system)].vertices, n)
    part = system.bodies[_chosen(asked.of, [part.name for part in system.bodies], asked.label, "body")]
    return -sum_of(np.arange(part.vertices.start, part.vertices.stop), n)


def force_of(asked: Asked, frame: Frame) -> Floats:
    """What the report of a step has of forces: (3,) [N], or a pressure."""
    system, details = frame.system, frame.report.details
    by = quantity_of(asked, system).by
    if by == "held":
        return np.array(details.cavity_pressure[asked.of])
    name, sign = asked.of, 1.0
    if by == "pins":
        k, labels = driver_of(asked, system), pin_labels(system)
        if k < len(labels):
            return details.reaction_forces[labels[k]]
        name, sign = str(system.obstacles[k - len(labels)].name), -1.0
    else:
        _chosen(name, [part.name for part in system.bodies], asked.label, "body")
    assert isinstance(details, ImplicitDetails)
    both = (of.get(name, np.zeros(3)) for of in (details.contact_forces, details.friction_forces))
    return sign * sum(both, start=np.zeros(3))


QUANTITIES = {
    "positions": Quantity(2, "x", _points),
    "velocities": Quantity(2, "v", _points),
    "center": Quantity(1, "x", _center),
    "sensor": Quantity(0, "x", _sensor),
    "joint": Quantity(0, "x", _joint),
    "volume": Quantity(0, "x", _actuator),
    "pressure": Quantity(0, "x", _actuator),
    "length": Quantity(0, "x", _actuator),
    "reaction": Quantity(1, "pins", None),
    "contact": Quantity(1, "contact", None),
}
