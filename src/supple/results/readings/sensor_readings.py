"""What sensors feel: the contact forces on parts of surfaces.

The contact force of a vertex acts on those of its triangles that it pushes, in proportion to their areas projected
along the normal force (`contact_pressures` divides by these areas). Where it pushes none of them, as the mean over a
frame in which the body turned far may, it acts on all, in proportion to their areas; on edges of rods, to their
lengths. Each corner of each triangle so
has a part of the force. The parts of all triangles add up to the whole force, and a part of a surface has those of its
triangles.
"""

from __future__ import annotations

from functools import singledispatch
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from supple.errors import SceneError
from supple.mesh.topology import are_edges
from supple.model.state import ContactPoints
from supple.model.system import BodyRange, System
from supple.results.readings.reading import (
    AngleReading,
    DistanceReading,
    ForceReading,
    Reading,
    TaxelReading,
)
from supple.scene.loads.points import Point, point_corners
from supple.scene.rigid.pose import rotation_of
from supple.scene.sensors import AngleSensor, DistanceSensor, ForceSensor, Sensor, SurfaceSensor, Taxels


class Touched(NamedTuple):
    """Triangles (t, 3) and the parts of the contact force at their corners, (t, 3, 3) [N]; normals : (t, 3) now."""

    triangles: NDArray[np.int32]
    forces: NDArray[np.float64]
    normals: NDArray[np.float64]


class Felt:
    """What sensors can feel in one state: where everything is, and the contacts.

    Attributes
    ----------
    x : (n, 3) vertices [m]; points, rest : (k, 3) points of surfaces, and where they are at rest [m]
    """

    def __init__(self, system: System, x: NDArray[np.float64], contacts: ContactPoints | None) -> None:
        self.system, self.x, self._contacts = system, x, contacts
        self.points, self.rest = system.points.positions(x), system.points.positions(system.rest_positions)
        self._touched: dict[tuple[str, str] | None, Touched] = {}  # by the pair of things whose contacts are felt

    def part(self, body: str) -> BodyRange:
        """The rows of a body."""
        return next(part for part in self.system.bodies if part.name == body)

    def touched(self, sensor: SurfaceSensor, by: str | None = None) -> Touched:
        """The contact forces on the triangles of a sensor; of those with one other thing, where it is given."""
        pair = None if by is None else (sensor.body, by)
        if pair not in self._touched:
            contacts = self._contacts
            between = contacts if pair is None or contacts is None else contacts.of_pair(*pair)
            self._touched[pair] = _touched(self.system.triangles, self.points, between)
        felt = self._touched[pair]
        rows = self.part(sensor.body).triangles.start + sensor.triangles(self.system.scene.bodies)
        return Touched(felt.triangles[rows], felt.forces[rows], felt.normals[rows])

    def place(self, point: Point) -> NDArray[np.float64]:
        """(3,) where a point of a body, or of the world, is [m]."""
        name, corners, weights, offset = point_corners(point, self.system.scene.bodies, "")
        return offset if name is None else weights @ self.x[self.part(name).vertices][corners]


def sensor_readings(system: System, x: NDArray[np.float64], contacts: ContactPoints | None) -> dict[str, Reading]:
    """By name, what the scene's sensors feel where the vertices are at x (n, 3) [m]."""
    sensors = system.scene.sensors
    felt = Felt(system, x, contacts) if sensors else None
    return {sensor.name: reading_of(sensor, felt) for sensor in sensors}


@singledispatch
def reading_of(sensor: Sensor, felt: Felt) -> Reading:
    """What one sensor feels; a new kind registers its own, and its class of readings in `READINGS`.

    Raises
    ------
    SceneError : where the sensor is of an unknown kind.
    """
    raise SceneError(f"{sensor.label}: a {type(sensor).__name__} is not a sensor that has readings")


@reading_of.register
def _(sensor: ForceSensor, felt: Felt) -> Reading:
    return _force(felt.touched(sensor, sensor.by), felt.points)


@reading_of.register
def _(sensor: Taxels, felt: Felt) -> Reading:
    return _taxels(sensor, felt.touched(sensor), felt.points, felt.rest)


@reading_of.register
def _(sensor: DistanceSensor, felt: Felt) -> Reading:
    return DistanceReading(float(np.linalg.norm(felt.place(sensor.second) - felt.place(sensor.first))))


@reading_of.register
def _(sensor: AngleSensor, felt: Felt) -> Reading:
    return AngleReading(_angle(sensor, felt.part(sensor.body), felt.x))


def _angle(sensor: AngleSensor, part: BodyRange, x: NDArray[np.float64]) -> float:
    body = part.body
    start = body.place(body.points)
    rows = sensor.select(start)
    return angle_of(sensor, rotation_of(start[rows], body.embedded.positions(x[part.vertices])[rows]))[0]


def angle_of(sensor: AngleSensor, R: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
    """The angle of a rotation (3, 3) [rad], and its derivative (3,) by a turn w of R to R exp([w]).

    About an axis, it is that of the part of the rotation about it: swing and twist (Dobrowolski, "Swing-twist
    decomposition in Clifford algebra", 2015).
    """
    *vector, s = Rotation.from_matrix(R).as_quat(canonical=True)
    v = np.array(vector)
    axis = v / (float(np.linalg.norm(v)) or 1.0) if sensor.axis is None else np.asarray(sensor.axis)
    along = float(axis @ v)
    # The quaternion (v, s) changes by half of (s w + v x w, -v . w).
    by_turn = (s * (s * axis + np.cross(axis, v)) + along * v) / (s**2 + along**2)
    return 2.0 * float(np.arctan2(along, s)), by_turn


def _touched(triangles: NDArray[np.int32], x: NDArray[np.float64], contacts: ContactPoints | None) -> Touched:
    a, b, c = x[triangles].transpose(1, 0, 2)
    areas = np.cross(b - a, c - a)
    lengths = np.linalg.norm(areas, axis=1)[:, None]
    normals = areas / np.where(lengths > 0.0, lengths, 1.0)
    if contacts is None or not len(contacts):
        return Touched(triangles, np.zeros((len(triangles), 3, 3)), normals)
    of_rod = are_edges(triangles)
    edges = np.linalg.norm(b - a, axis=1)[:, None] * np.array([1.0, 0.5, 0.5])  # their second end is two corners
    pushes = contacts.on_vertices(contacts.forces, len(x))
    total = contacts.on_vertices(contacts.forces + contacts.friction, len(x))
    facing = np.maximum(-np.einsum("ti,tci->tc", areas, pushes[triangles]), 0.0)
    pushed = np.bincount(triangles.ravel(), facing.ravel(), len(x)) > 0.0
    facing = np.where(pushed[triangles], facing, np.where(of_rod[:, None], edges, lengths))
    sums = np.bincount(triangles.ravel(), facing.ravel(), len(x))
    shares = facing / np.where(sums > 0.0, sums, 1.0)[triangles]
    if of_rod.any():  # they are pushed from where they are pushed
        along = np.einsum("tc,tci->ti", shares, pushes[triangles])[of_rod]
        normals[of_rod] = -along / np.maximum(np.linalg.norm(along, axis=1), np.finfo(np.float64).tiny)[:, None]
    return Touched(triangles, shares[:, :, None] * total[triangles], normals)


def _force(touched: Touched, x: NDArray[np.float64]) -> ForceReading:
    pushes = -np.einsum("ti,tci->tc", touched.normals, touched.forces)
    normal = float(pushes.sum())
    center = np.full(3, np.nan)
    if normal > 0.0:
        center = np.einsum("tc,tci->i", pushes, x[touched.triangles]) / normal
    return ForceReading(touched.forces.sum(axis=(0, 1)), normal, center)


def _taxels(sensor: Taxels, touched: Touched, x: NDArray[np.float64], rest: NDArray[np.float64]) -> TaxelReading:
    first, second = np.asarray(sensor.first), np.asarray(sensor.second)
    corners = rest[touched.triangles]
    # The center of the third of a triangle that belongs to a corner (bounded by the medians).
    places = (15.0 * corners + 7.0 * corners.sum(axis=1, keepdims=True)) / 36.0
    # Coordinates in the grid, projected along its normal.
    axes = np.linalg.pinv(np.column_stack([first, second]))
    counts = np.array(sensor.cells)
    cell = np.floor((places - np.asarray(sensor.corner)) @ axes.T * counts).astype(np.int64)
    inside = ((cell >= 0) & (cell < counts)).all(axis=2)
    number = np.ravel_multi_index(tuple(np.where(inside, cell[:, :, k], 0) for k in (0, 1)), sensor.cells)
    along, across = _directions(touched, x, corners, first, second)
    values = []
    for direction in (-touched.normals, along, across):
        parts = np.where(inside, np.einsum("ti,tci->tc", direction, touched.forces), 0.0)
        sums = np.bincount(number.ravel(), parts.ravel(), int(counts.prod()))
        values.append(sums.reshape(sensor.cells))
    return TaxelReading(values[0], np.stack(values[1:], axis=2))


def _directions(
    touched: Touched,
    x: NDArray[np.float64],
    corners: NDArray[np.float64],
    first: NDArray[np.float64],
    second: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(t, 3) each: where the grid's first side points now in every triangle, and the direction across it."""
    sides = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    now = x[touched.triangles]
    moved = np.stack([now[:, 1] - now[:, 0], now[:, 2] - now[:, 0]], axis=2)
    along = np.einsum("tij,tj->ti", moved, np.linalg.pinv(sides) @ first)
    lengths = np.linalg.norm(along, axis=1)[:, None]
    along = along / np.where(lengths > 0.0, lengths, 1.0)
    at_rest = np.cross(sides[:, :, 0], sides[:, :, 1])
    side = np.sign(np.einsum("ti,i->t", np.cross(at_rest, first), second))
    return along, side[:, None] * np.cross(touched.normals, along)
