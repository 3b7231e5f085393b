"""The forces of what a scene declares, computed again from a frame: loads, muscles, cavities and cables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from supple.results.check.geometry.vectors import area_vectors, edge_vectors, enclosed_volume
from supple.results.check.known import Floats, Forces, Frame, Known
from supple.scene.body import PlacedBody
from supple.scene.forces import Force
from supple.scene.loads.body_force import BodyForce
from supple.scene.loads.muscle import Muscle
from supple.scene.loads.over_time import script_of
from supple.scene.loads.spring import Spring
from supple.scene.loads.surface_loads import Pressure, Traction, Wind
from supple.scene.rows import BodyRows
from supple.scene.shell import Shell

Work = tuple[str, Forces | str]
"""The name of a work, and the forces that do it, or why they are not known."""


@singledispatch
def forces_of(load: Any, of: Known) -> Work:
    """What a load does; a new kind registers its own."""
    return load.kind, "its forces are not known here"


@forces_of.register(Force)
def _(load: Force, of: Known) -> Work:
    body = of.rows[load.body].body
    rows = load.select(body.place(body.points))
    spread = csr_array(points_of(of.rows[load.body], len(of.masses)).T)[:, rows]
    return "forces", lambda time, x, v: spread @ load.per_vertex(time, len(rows))


@forces_of.register(Traction)
def _(load: Traction, of: Known) -> Work:
    body, traction = of.rows[load.body].body, script_of(load, "traction")
    shares = np.zeros(len(body.points))
    for triangles, weight in _weighted(body, load.triangles(body)):
        areas = weight / 3.0 * np.linalg.norm(area_vectors(body.points, triangles), axis=1)
        np.add.at(shares, triangles, areas[:, None])
    spread = points_of(of.rows[load.body], len(of.masses)).T @ shares
    return "tractions", lambda time, x, v: spread[:, None] * traction(time)


@forces_of.register(Pressure)
def _(load: Pressure, of: Known) -> Work:
    body, pressure, begin = of.rows[load.body].body, script_of(load, "pressure"), of.rows[load.body].vertices.start
    parts = [(triangles + begin, weight) for triangles, weight in _weighted(body, load.triangles(body))]

    def forces(time: float, x: Floats, v: Floats) -> Floats:
        out = np.zeros_like(x)
        for triangles, weight in parts:
            np.add.at(out, triangles, (-weight * pressure(time) / 3.0 * area_vectors(x, triangles))[:, None])
        return out

    return "pressures", forces


@forces_of.register(Wind)
def _(load: Wind, of: Known) -> Work:
    """On each corner of a triangle that faces the flow, a sixth of density drag |A . u| times the flow's velocity
    against the corner, u that of the triangle against the flow."""
    body, velocity = of.rows[load.body].body, script_of(load, "velocity")
    triangles = body.triangles[load.triangles(body)] + of.rows[load.body].vertices.start

    def forces(time: float, x: Floats, v: Floats) -> Floats:
        out, against = np.zeros_like(x), velocity(time) - v[triangles]
        facing = -np.einsum("ti,ti->t", area_vectors(x, triangles), against.mean(axis=1))
        # A shell has two sides, one of which faces the flow.
        facing = np.abs(facing) if isinstance(body, Shell) else np.where(facing > 0.0, facing, 0.0)
        share = load.density * load.drag / 6.0 * facing
        np.add.at(out, triangles, share[:, None, None] * against)
        return out

    return "wind", forces


@forces_of.register(BodyForce)
def _(load: BodyForce, of: Known) -> Work:
    if not load.is_uniform:
        return "body_forces", "a force per mass that depends on the place is not recorded"
    masses = np.zeros_like(of.masses) if load.body else of.masses
    if load.body:
        masses[of.rows[load.body].vertices] = of.masses[of.rows[load.body].vertices]
    return "body_forces", lambda time, x, v: masses[:, None] * load.at(np.zeros((1, 3)), time)


@forces_of.register(Spring)
def _(load: Spring, of: Known) -> Work:
    if load.rest_length is None and of.times[0] != 0.0:
        return "springs", "a length at the start is not in a recording that begins later"
    points, offsets = combined(
        [load.corners(key, [part.body for part in of.rows.values()]) for key in ("first", "second")], of
    )
    weights, offset = points[[0]] - points[[1]], offsets[0] - offsets[1]

    def distance(x: Floats) -> tuple[float, Floats]:
        r = (weights @ x)[0] + offset
        length = float(np.linalg.norm(r))
        return length, r / length if length > 0.0 else np.zeros(3)

    at_start = distance(of.snapshot(0).positions)[0]
    rest = script_of(load, "rest_length") if load.rest_length is not None else lambda time: at_start

    def forces(time: float, x: Floats, v: Floats) -> Floats:
        length, along = distance(x)
        return weights.T @ (-load.stiffness * (length - rest(time)) * along)[None]

    return "springs", forces


@forces_of.register(Muscle)
def _(load: Muscle, of: Known) -> Work:
    """Those of the stress a S f(s) (F d / s) d^T, s = |F d|."""
    rows, d = load.fibres(of.rows[load.body].body)
    rows, activation = rows + of.rows[load.body].tets.start, script_of(load, "activation")
    if np.isin(rows, of.quadratic[0]).any():
        return "muscles", "they act in quadratic tets"
    # b . d of the shape gradients b: rows of Dm^-1, and minus their sum.
    inner = np.einsum("mki,mi->mk", of.rest_inverse[rows], d)
    inner = np.column_stack([-inner.sum(axis=1), inner])
    stretches, shares = (np.asarray(values, dtype=np.float64) for values in load.force_length or ([1.0], [1.0]))

    def forces(time: float, x: Floats, v: Floats) -> Floats:
        out, Fd = np.zeros_like(x), np.einsum("mik,mk->mi", edge_vectors(x, of.tets[rows]), inner[:, 1:])
        s = np.linalg.norm(Fd, axis=1)
        pull = (
            activation(time)
            * load.strength
            * of.rest_volumes[rows]
            * np.interp(s, stretches, shares)
            / np.where(s > 0.0, s, np.inf)
        )
        np.add.at(out, of.tets[rows], -inner[:, :, None] * (pull[:, None] * Fd)[:, None])
        return out

    return "muscles", forces


def _weighted(body: PlacedBody, rows: NDArray[np.int64]) -> Iterator[tuple[NDArray[np.int32], float]]:
    """Triangles (t, 3), and with which factor a load per area acts on them: on whole sides of quadratic tets by the
    extrapolation 4/3 of four triangles without 1/3 of the one between the corners."""
    triangles = body.triangles
    if body.mesh.order == 1:
        yield triangles[rows], 1.0
        return
    whole = np.flatnonzero(np.bincount(rows // 4, minlength=len(triangles) // 4) == 4)
    inside = np.isin(rows // 4, whole)
    yield triangles[rows[~inside]], 1.0
    yield triangles[rows[inside]], 4.0 / 3.0
    yield np.column_stack([triangles[4 * whole + k, k] for k in range(3)]), -1.0 / 3.0


def points_of(part: BodyRows, count: int) -> csr_array:
    """(k, n) the points of a body as combinations of all vertices."""
    points = part.body.embedded
    return csr_array((points.weights, points.vertices + part.vertices.start, points.start), (len(points), count))


def combined(corners: Sequence[Any], of: Known) -> tuple[csr_array, Floats]:
    """Points as of `point_corners` as W x + offsets: W (p, n), and (p, 3) [m]."""
    vertices = [own + of.rows[name].vertices.start if name else own for name, own, *_ in corners]
    weights, start = [weights for _, _, weights, _ in corners], np.cumsum([0, *map(len, vertices)])
    points = csr_array((np.concatenate(weights), np.concatenate(vertices), start), (len(corners), len(of.masses)))
    return points, np.array([offset for *_, offset in corners])


class Actuator(NamedTuple):
    """An actuator in one frame: a force Q that acts on a coordinate s, so that its work is Q ds.

    Attributes
    ----------
    work : the name of its work
    coordinate : volume of a cavity [m^3], length of a span [m]
    force : pressure [Pa], minus the tension [N]; NaN where it was not recorded
    gradient : (n, 3) of the coordinate
    """

    work: str
    coordinate: float
    force: float
    gradient: Floats


def actuators(at: Frame) -> list[Actuator]:
    """All cavities, then all spans of all cables."""
    x, found = at.positions, []
    for name, triangles in at.of.cavities:
        gradient = np.zeros_like(x)
        np.add.at(gradient, triangles, (area_vectors(x, triangles) / -3.0)[:, None])
        pressure = at.details.cavity_pressure.get(name, np.nan)
        found.append(Actuator("cavities", -enclosed_volume(x, triangles), pressure, gradient))
    for name, weights, offsets in at.of.cables:
        for k, r in enumerate(np.diff(weights @ x + offsets, axis=0)):
            length = float(np.linalg.norm(r))
            along = r / length if length > 0.0 else np.zeros(3)
            gradient = (weights[[k + 1]] - weights[[k]]).T @ along[None]
            tension = at.details.cable_tension.get(f"{name}.{k}", np.nan)
            found.append(Actuator("cables", length, -tension, gradient))
    return found
