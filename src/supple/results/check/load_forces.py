"""Loads, cavities and cables, computed again from a frame: their forces on vertices, volumes and lengths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.active import MUSCLE, ActiveTets

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LoadPattern:
    """How the forces of a load follow from one value.

    Attributes
    ----------
    kind : "vector", a force w_i f on each vertex, with the value f (3,); "pressure", a third of -p A on each corner of
        a triangle of area vector A, with the value p; "spring", the forces of k / 2 (l - l0)^2,
        l = |sum w_i x_i + offset|, with the value l0; "drag", c / 3 (w - v_i) on each corner of a triangle, with the
        value w (3,), see `_add_drag`
    work : the name under which its work is counted
    vertices : (v,), or (t, 3) triangles of a pressure or a drag
    weights : (v,) w; none of triangles
    offset : (3,) [m]; stiffness : k [N/m]; of a drag, density times coefficient [kg/m^3]
    """

    kind: Literal["vector", "pressure", "spring", "drag"]
    work: str
    vertices: NDArray[np.integer]
    weights: Floats = field(default_factory=lambda: np.zeros(0))
    offset: Floats = field(default_factory=lambda: np.zeros(3))
    stiffness: float = 0.0


@dataclass(frozen=True, eq=False)
class CavitySurface:
    """A cavity; triangles : (t, 3) vertices of the surface around it, seen counter-clockwise from inside."""

    name: str
    triangles: NDArray[np.integer]


@dataclass(frozen=True, eq=False)
class CablePath:
    """A cable through points W x + offset, of some vertices (v,); weights : (p, v); offsets : (p, 3) [m]."""

    name: str
    vertices: NDArray[np.integer]
    weights: Floats
    offsets: Floats


def load_forces(
    loads: Mapping[str, LoadPattern],
    values: Mapping[str, NDArray[np.float64] | float],
    x: NDArray[np.float64],
    v: NDArray[np.float64],
) -> dict[str, NDArray[np.float64]]:
    """By the name of their work, (n, 3) at positions x and velocities v (n, 3) [N]; NaN where a value is missing."""
    out: dict[str, NDArray[np.float64]] = {}
    for name, load in loads.items():
        total = out.setdefault(load.work, np.zeros_like(x))
        value = np.asarray(values.get(name, np.nan))
        if load.kind == "drag":
            _add_drag(load, value, (x, v), total)
        else:
            _add_forces(load, value, x, total)
    return out


def _add_forces(
    load: LoadPattern, value: NDArray[np.float64], x: NDArray[np.float64], out: NDArray[np.float64]
) -> None:
    if load.kind == "pressure":
        a, b, c = (x[corner] for corner in load.vertices.T)
        on_corner = -value / 6.0 * np.cross(b - a, c - a)
        for corner in load.vertices.T:
            for k in range(3):
                out[:, k] += np.bincount(corner, on_corner[:, k], len(x))
        return
    force = value
    if load.kind == "spring":
        r = load.weights @ x[load.vertices] + load.offset
        length = float(np.linalg.norm(r))
        force = -load.stiffness * (length - value) * (r / length if length > 0.0 else np.zeros(3))
    np.add.at(out, load.vertices, load.weights[:, None] * force)


def _add_drag(
    load: LoadPattern,
    flow: NDArray[np.float64],
    motion: tuple[NDArray[np.float64], NDArray[np.float64]],
    out: NDArray[np.float64],
) -> None:
    """Of triangles with outward area vectors A and mean velocities u against the flow, where A . u < 0: on each corner
    a sixth of stiffness |A . u| times the flow's velocity against it; motion : places and velocities (n, 3)."""
    x, v = (values[load.vertices] for values in motion)
    A = 0.5 * np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    facing = np.einsum("ti,ti->t", A, v.sum(axis=1) / 3.0 - flow)
    share = load.stiffness / 6.0 * np.where(facing > 0.0, facing, 0.0)
    np.add.at(out, load.vertices, share[:, None, None] * (flow - v))


def add_muscle_forces(
    active: Sequence[ActiveTets],
    tets: NDArray[np.int32],
    F: NDArray[np.float64],
    shapes: tuple[NDArray[np.float64], NDArray[np.float64]],
    out: NDArray[np.float64],
) -> None:
    """Add the forces of all muscles to `out` (n, 3) [N]: those of the stress a S f(s) (F d / s) d^T, s = |F d|.

    Parameters
    ----------
    tets : (m, 4); F : (m, 3, 3); shapes : Dm^-1 (m, 3, 3) [1/m] and volumes (m,) [m^3] at rest
    """
    for each in active:
        if each.kind != MUSCLE:
            continue
        d, Dm_inv = each.directions, shapes[0][each.rows]
        ways = np.einsum("mij,mj->mi", F[each.rows], d)
        s = np.linalg.norm(ways, axis=1)
        pull = each.value * each.strength * shapes[1][each.rows] * np.interp(s, each.curve[:, 0], each.curve[:, 1])
        along = ways * (pull / np.where(s > 0.0, s, np.inf))[:, None]
        # b . d of the shape gradients b: rows of Dm^-1, and minus their sum.
        inner = np.einsum("mki,mi->mk", Dm_inv, d)
        for corner, c in enumerate([-inner.sum(axis=1), *inner.T]):
            np.add.at(out, tets[each.rows, corner], -c[:, None] * along)


@dataclass(frozen=True, eq=False)
class ActuatorState:
    """An actuator in one frame: a force Q that acts on a coordinate s, so that its work is Q ds.

    Attributes
    ----------
    work : the name of its work
    coordinate : volume of a cavity [m^3], length of a span [m]
    force : pressure [Pa], minus the tension [N]; NaN where it was not recorded
    vertices : (v,); gradient : (v, 3) of the coordinate, with a row for each
    """

    work: str
    coordinate: float
    force: float
    vertices: NDArray[np.integer]
    gradient: Floats

    def rate(self, velocities: Floats) -> float:
        """Of the coordinate, at velocities (n, 3) of all vertices [m/s]."""
        return float(np.einsum("ij,ij->", self.gradient, velocities[self.vertices]))


def actuator_states(
    cavities: Sequence[CavitySurface],
    cables: Sequence[CablePath],
    pressures: Mapping[str, float],
    tensions: Mapping[str, float],
    x: Floats,
) -> list[ActuatorState]:
    """All cavities, then all spans of all cables, at positions x (n, 3) [m]."""
    states = [_cavity(each, pressures.get(each.name, np.nan), x) for each in cavities]
    for cable in cables:
        ends = cable.weights @ x[cable.vertices] + cable.offsets
        for k, r in enumerate(np.diff(ends, axis=0)):
            length = float(np.linalg.norm(r))
            along = r / length if length > 0.0 else np.zeros(3)
            gradient = (cable.weights[k + 1] - cable.weights[k])[:, None] * along
            tension = tensions.get(f"{cable.name}.{k}", np.nan)
            states.append(ActuatorState("cables", length, -tension, cable.vertices, gradient))
    return states


def _cavity(cavity: CavitySurface, pressure: float, x: Floats) -> ActuatorState:
    """The volume is the sum of the tetrahedra between its triangles and their center, seen from inside."""
    corners = x[cavity.triangles]
    a, b, c = (corners - corners.mean(axis=(0, 1))).transpose(1, 0, 2)
    volume = -float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0
    on_corner = np.cross(b - a, c - a) / -6.0
    gradient = np.repeat(on_corner, 3, axis=0)
    return ActuatorState("cavities", volume, pressure, cavity.triangles.ravel(), gradient)
