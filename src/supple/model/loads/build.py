"""From the loads of a scene to loads on the vertices of a system."""

from __future__ import annotations

from dataclasses import replace
from functools import singledispatch

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.materials.elastic_tets.active import GROWTH, MUSCLE, ActiveTets
from supple.mesh.closed_surfaces import is_closed
from supple.model.loads.applied import AppliedLoad, DeadLoad, MassLoad, Setting
from supple.model.loads.growth import GrownTets
from supple.model.loads.muscles import FibreTension
from supple.model.loads.pressure import FollowerPressure, area_vectors, wind_drag
from supple.model.loads.springs import PointSpring
from supple.scene.body import PlacedBody
from supple.scene.forces import Force
from supple.scene.inputs import is_steady
from supple.scene.loads.body_force import BodyForce
from supple.scene.loads.growth import Growth
from supple.scene.loads.load import Load
from supple.scene.loads.muscle import Muscle
from supple.scene.loads.over_time import script_of
from supple.scene.loads.spring import Spring
from supple.scene.loads.surface_loads import Pressure, Traction, Wind
from supple.scene.shell import Shell


@singledispatch
def applied(load: Load, setting: Setting) -> list[AppliedLoad]:
    """A load of a scene on the vertices of all bodies, as one or several; a new kind registers its own.

    Raises
    ------
    SceneError : where the load is of an unknown kind.
    """
    raise SceneError(f"{load.label}: a {type(load).__name__} is not a load that solvers know")


applied.register(Wind, wind_drag)


@applied.register
def _(load: Traction, setting: Setting) -> list[AppliedLoad]:
    body = setting.body(load.body)
    shares, parts = np.zeros(len(body.points)), _weighted_triangles(body, load.triangles(body))
    for triangles, weight in parts:
        areas = weight * np.linalg.norm(area_vectors(body.points, triangles), axis=1) / 3.0
        shares += np.bincount(triangles.ravel(), np.repeat(areas, 3), len(body.points))
    touched = np.unique(np.concatenate([triangles for triangles, _ in parts]))
    vertices, weights = _vertices_of(body, setting.begins[load.body], touched)
    on_points = shares[touched]
    own = on_points if weights is None else weights.T @ on_points
    return [DeadLoad.shared(vertices, own, script_of(load, "traction"), "tractions", is_steady(load.traction))]


@applied.register
def _(load: Pressure, setting: Setting) -> list[AppliedLoad]:
    body, at, begin = setting.body(load.body), script_of(load, "pressure"), setting.begins[load.body]
    return [
        FollowerPressure(
            (triangles + begin).astype(np.int32),
            lambda time, weight=weight: weight * float(at(time)),
            isinstance(body, Shell) and is_closed(triangles),
        )
        for triangles, weight in _weighted_triangles(body, load.triangles(body))
    ]


@applied.register
def _(load: BodyForce, setting: Setting) -> list[AppliedLoad]:
    chosen = setting.bodies if load.body is None else [setting.body(load.body)]
    parts = [np.arange(len(body.mesh.vertices)) + setting.begins[body.name] for body in chosen]
    vertices = np.concatenate(parts).astype(np.int32)
    return [MassLoad(load, vertices, setting.masses[vertices])]


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
        return DeadLoad.shared(vertices, own, force.total, "forces", is_steady(force.force))

    def forces(time: float) -> NDArray[np.float64]:
        given = force.per_vertex(time, count)
        return given if weights is None else weights.T @ given

    return DeadLoad(vertices, forces, "forces", is_steady(force.force))


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


@applied.register
def _(load: Growth, setting: Setting) -> list[AppliedLoad]:
    body = setting.body(load.body)
    rows, directions = load.growing(body)
    vertices, stretch = np.unique(body.mesh.nodes[rows]) + setting.begins[load.body], script_of(load, "stretch")
    tets = ActiveTets(GROWTH, rows + setting.first_tet(load.body), directions)
    return [GrownTets(tets, vertices, lambda time: float(stretch(time)))]


@applied.register
def _(load: Muscle, setting: Setting) -> list[AppliedLoad]:
    body, activation = setting.body(load.body), script_of(load, "activation")
    rows, directions = load.fibres(body)
    inner = np.einsum("mki,mi->mk", body.mesh.rest_shape_inverse[rows], directions)
    coefficients = np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)
    stretches, values = load.force_length or ([1.0], [1.0])
    curve = np.array([stretches, values], dtype=np.float64)
    first = setting.first_tet(load.body)
    tension = FibreTension(
        ActiveTets(MUSCLE, rows + first, np.ascontiguousarray(directions), 0.0, load.strength, curve.T),
        (body.mesh.tets[rows] + setting.begins[load.body]).astype(np.int32),
        coefficients,
        load.strength * body.mesh.volumes[rows],
        lambda time: float(activation(time)),
        (curve[0], curve[1]),
    )
    return [tension]


@applied.register
def _(load: Spring, setting: Setting) -> list[AppliedLoad]:
    vertices, coefficients, offset = [], [], np.zeros(3)
    for key, sign in (("first", 1.0), ("second", -1.0)):
        name, corners, weights, fixed = load.corners(key, setting.bodies)
        offset = offset + sign * fixed
        if name is not None:
            vertices.append(corners + setting.begins[name])
            coefficients.append(sign * weights)
    together, number = np.unique(np.concatenate(vertices), return_inverse=True)
    sums = np.bincount(number.ravel(), np.concatenate(coefficients)).astype(np.float64)
    used = sums != 0.0
    made = PointSpring(together[used].astype(np.int32), sums[used], offset, load.stiffness, lambda time: 0.0)
    if load.rest_length is None:
        length = made.length(setting.x)[0]
        return [replace(made, rest_length=lambda time: length)]
    rest_length = script_of(load, "rest_length")
    return [replace(made, rest_length=lambda time: float(rest_length(time)))]
