"""From the loads of a scene to loads on the vertices of a system."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.materials.elastic_tets.active import GROWTH, MUSCLE, ActiveTets
from supple.model.loads.applied import AppliedLoad, DeadLoad, MassLoad, UniformLoad
from supple.model.loads.growth import GrownTets
from supple.model.loads.muscles import FibreTension
from supple.model.loads.pressure import FollowerPressure, area_vectors
from supple.model.loads.springs import PointSpring
from supple.scene.actuators.muscle import Muscle, check_activation
from supple.scene.body import PlacedBody
from supple.scene.forces import Force
from supple.scene.loads.body_force import BodyForce
from supple.scene.loads.growth import STRETCHES, Growth
from supple.scene.loads.load import Load
from supple.scene.loads.over_time import OverTime, magnitude_at, value_at
from supple.scene.loads.spring import Spring
from supple.scene.loads.surface_loads import Pressure, Traction


def applied(
    load: Load,
    bodies: Sequence[PlacedBody],
    begins: dict[str, int],
    masses: NDArray[np.float64],
    x: NDArray[np.float64],
) -> list[AppliedLoad]:
    """A load of a scene on the vertices of all bodies, as one or several.

    Parameters
    ----------
    begins : by body name, the number of its first vertex; masses : (n,) of all vertices [kg]
    x : (n, 3) where the simulation begins [m]

    Raises
    ------
    SceneError : where the load is of an unknown kind.
    """
    named = {body.name: body for body in bodies}
    if isinstance(load, Traction):
        body = named[load.body]
        shares, parts = np.zeros(len(body.points)), _weighted_triangles(body, load.triangles(body))
        for triangles, weight in parts:
            areas = weight * np.linalg.norm(area_vectors(body.points, triangles), axis=1) / 3.0
            shares += np.bincount(triangles.ravel(), np.repeat(areas, 3), len(body.points))
        touched = np.unique(np.concatenate([triangles for triangles, _ in parts]))
        at = _over_time(load.traction, f"{load.label}: traction", (3,))
        vertices, weights = _vertices_of(body, begins[load.body], touched)
        on_points = shares[touched]
        own = on_points if weights is None else weights.T @ on_points
        return [UniformLoad.of(vertices, own, at, "tractions")]
    if isinstance(load, Pressure):
        body = named[load.body]
        at, begin = _over_time(load.pressure, f"{load.label}: pressure", ()), begins[load.body]
        return [
            FollowerPressure((triangles + begin).astype(np.int32), lambda time, weight=weight: weight * float(at(time)))
            for triangles, weight in _weighted_triangles(body, load.triangles(body))
        ]
    if isinstance(load, BodyForce):
        chosen = bodies if load.body is None else [named[load.body]]
        parts = [np.arange(len(body.mesh.vertices)) + begins[body.name] for body in chosen]
        vertices = np.concatenate(parts).astype(np.int32)
        return [MassLoad(load, vertices, masses[vertices])]
    if isinstance(load, Spring):
        return [_spring(load, bodies, begins, x)]
    if isinstance(load, Muscle):
        return [_muscle(load, named[load.body], begins[load.body], _first_tet(load.body, bodies))]
    if isinstance(load, Growth):
        return [_growth(load, named[load.body], begins[load.body], _first_tet(load.body, bodies))]
    raise SceneError(f"{load.label}: a {type(load).__name__} is not a load that solvers know")


def _weighted_triangles(body: PlacedBody, rows: NDArray[np.int64]) -> list[tuple[NDArray[np.int32], float]]:
    """The triangles (t, 3) that a load per area acts on, and the weight of each group.

    The forces on the four triangles of a quadratic facet are those of shape functions that are linear in each of them.
    4/3 of them, without 1/3 of the forces on the triangle between the corners, are those of the quadratic ones: exact
    for a plane facet with straight sides, and to fourth order for a curved one.
    """
    triangles = body.triangles
    if body.mesh.order == 1:
        return [(triangles[rows], 1.0)]
    whole = np.bincount(rows // 4, minlength=len(triangles) // 4) == 4
    some, facets = ~whole[rows // 4], np.flatnonzero(whole)
    corners = np.column_stack([triangles[4 * facets + k, k] for k in range(3)])
    parts = [(triangles[rows[some]], 1.0), (triangles[rows[~some]], 4.0 / 3.0), (corners, -1.0 / 3.0)]
    return [part for part in parts if len(part[0])]


def applied_force(force: Force, body: PlacedBody, begin: int, rows: NDArray[np.integer]) -> DeadLoad:
    """A force on some of its body's points (k,); begin : the number of the body's first vertex."""
    count = len(rows)
    vertices, weights = _vertices_of(body, begin, rows)
    if force.is_total:
        shares = np.full(count, 1.0 / count)
        own = shares if weights is None else weights.T @ shares
        return UniformLoad.of(vertices, own, force.total, "forces")

    def forces(time: float) -> NDArray[np.float64]:
        given = force.per_vertex(time, count)
        return given if weights is None else weights.T @ given

    return DeadLoad(vertices, forces, "forces")


def _vertices_of(
    body: PlacedBody, begin: int, rows: NDArray[np.integer]
) -> tuple[NDArray[np.int32], NDArray[np.float64] | None]:
    """The vertices (v,) that carry points (k,) of a body, and their weights (k, v); None where points are vertices."""
    points = body.embedded.taken(rows)
    if points.are_vertices:
        return (points.vertices + begin).astype(np.int32), None
    vertices, column = np.unique(points.vertices, return_inverse=True)
    weights = np.zeros((len(rows), len(vertices)))
    np.add.at(weights, (np.repeat(np.arange(len(rows)), np.diff(points.start)), column.ravel()), points.weights)
    return (vertices + begin).astype(np.int32), weights


def _first_tet(name: str, bodies: Sequence[PlacedBody]) -> int:
    """The number of a body's first tet among those of all bodies."""
    return sum(len(body.mesh.tets) for body in bodies[: [body.name for body in bodies].index(name)])


def _growth(growth: Growth, body: PlacedBody, begin: int, first: int) -> GrownTets:
    rows, directions = growth.growing(body)
    vertices = np.unique(body.mesh.nodes[rows]) + begin
    stretch = partial(magnitude_at, growth.stretch, what=f"{growth.label}: stretch", zero=False, limits=STRETCHES)
    return GrownTets(ActiveTets(GROWTH, rows + first, directions), vertices, stretch)


def _muscle(muscle: Muscle, body: PlacedBody, begin: int, first: int) -> FibreTension:
    rows, directions = muscle.fibres(body)
    inner = np.einsum("mki,mi->mk", body.mesh.rest_shape_inverse[rows], directions)
    coefficients = np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)
    what = f"{muscle.label}: activation"

    def activation(time: float) -> float:
        value = magnitude_at(muscle.activation, time, what)
        check_activation(value, f"{what}({time:g})")
        return value

    stretches, values = muscle.force_length or ([1.0], [1.0])
    curve = np.array([stretches, values], dtype=np.float64)
    return FibreTension(
        ActiveTets(MUSCLE, rows + first, np.ascontiguousarray(directions), 0.0, muscle.strength, curve.T),
        (body.mesh.tets[rows] + begin).astype(np.int32),
        coefficients,
        muscle.strength * body.mesh.volumes[rows],
        activation,
        (curve[0], curve[1]),
    )


def _spring(
    spring: Spring, bodies: Sequence[PlacedBody], begins: dict[str, int], x: NDArray[np.float64]
) -> PointSpring:
    vertices, coefficients, offset = [], [], np.zeros(3)
    for key, sign in (("first", 1.0), ("second", -1.0)):
        name, corners, weights, fixed = spring.corners(key, bodies)
        offset = offset + sign * fixed
        if name is not None:
            vertices.append(corners + begins[name])
            coefficients.append(sign * weights)
    together, number = np.unique(np.concatenate(vertices), return_inverse=True)
    sums = np.bincount(number.ravel(), np.concatenate(coefficients)).astype(np.float64)
    used = sums != 0.0
    given, what = spring.rest_length, f"{spring.label}: rest_length"
    made = PointSpring(together[used].astype(np.int32), sums[used], offset, spring.stiffness, lambda time: 0.0)
    if given is None:
        length = made.length(x)[0]
        return PointSpring(made.vertices, made.coefficients, offset, spring.stiffness, lambda time: length)
    rest_length = partial(magnitude_at, given, what=what)
    return PointSpring(made.vertices, made.coefficients, offset, spring.stiffness, rest_length)


def _over_time(value: OverTime, what: str, shape: tuple[int, ...]) -> Callable[[float], NDArray[np.float64]]:
    return lambda time: value_at(value, time, what, shape)
