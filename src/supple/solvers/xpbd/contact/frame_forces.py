"""The contact forces of a frame: means over its substeps, one by one and by body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.model.state import ContactPoints
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.contact_rows import LoadedRows


class ShapeLoads(NamedTuple):
    """The contacts of one substep of c vertices with simple shapes.

    Attributes
    ----------
    shapes, vertices : (c,); loads : (c, 3) accelerations of the vertices [m/s^2]
    places : (c, 4) normal of the shape, and gap after the contact was resolved [m]
    """

    shapes: NDArray[np.int64]
    vertices: NDArray[np.int32]
    loads: NDArray[np.float64]
    places: NDArray[np.float64]

    def chosen(self, kept: NDArray[np.bool_]) -> ShapeLoads:
        """Those contacts (of c,) that are kept."""
        return ShapeLoads._make(values[kept] for values in self)

    @staticmethod
    def none() -> ShapeLoads:
        return ShapeLoads(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int32), np.zeros((0, 3)), np.zeros((0, 4)))


class Owners(NamedTuple):
    """What the points and shapes of a scene belong to: bodies, then obstacles.

    Attributes
    ----------
    names : of all; of_points : (p,) of the points of `ContactSurfaces`; of_shapes : (s,)
    of_vertices : (t,) of what simple shapes are tested with, see `ObstacleContacts`
    rows : (nb,) points of the system that are the bodies' points, which come first among the points
    tested : (t,) points of the system that are tested; masses : (t,) of vertices [kg], 1 on rigid bodies
    """

    names: tuple[str, ...]
    of_points: NDArray[np.int32]
    of_shapes: NDArray[np.int32]
    of_vertices: NDArray[np.int32]
    rows: NDArray[np.int32]
    tested: NDArray[np.int32]
    masses: NDArray[np.float64]


class _Entries(NamedTuple):
    """Forces (e, 3) on the first side along the normal, and along the surface [N], already divided by substeps."""

    first: NDArray[np.int32]
    second: NDArray[np.int32]
    normal: NDArray[np.float64]
    tangential: NDArray[np.float64]


@dataclass
class FrameForces:
    """What the substeps of one frame had, in the numbering of the solver.

    Attributes
    ----------
    surfaces, shapes : one entry for each substep that had any contact of the kind
    latest : those of the latest substep, or None
    substeps : their number, also of those without contact
    standing : the contacts of things that sleep with each other and with obstacles, which are those of every substep
    """

    owners: Owners
    surfaces: list[LoadedRows] = field(default_factory=list)
    shapes: list[ShapeLoads] = field(default_factory=list)
    substeps: int = 0
    latest: tuple[LoadedRows | None, ShapeLoads | None] = (None, None)
    standing: tuple[LoadedRows, ShapeLoads] = field(default_factory=lambda: (LoadedRows.none(), ShapeLoads.none()))

    def end_substep(self, rows: LoadedRows | None, loads: ShapeLoads | None) -> None:
        """Take notice of the contacts that push in a substep."""
        rows = rows if rows is not None and len(rows.keys) else None
        loads = loads if loads is not None and len(loads.vertices) else None
        self.surfaces += [] if rows is None else [rows]
        self.shapes += [] if loads is None else [loads]
        self.latest = rows, loads
        self.substeps += 1

    def on_vertices(self, points: EmbeddedPoints, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The forces of the latest substep along normals and along surfaces on the vertices, (count, 3) [N] each.

        Parameters
        ----------
        points : those of the system; count : of its vertices
        """
        at_points = np.zeros((2, len(points), 3))
        rows, loads = self.latest
        if rows is not None:
            add_rows(self.owners.rows, rows.vertices, rows.weights, rows.normals, rows.forces, *at_points)
        if loads is not None:
            forces = self.owners.masses[loads.vertices, None] * loads.loads
            add_vertices(self.owners.tested[loads.vertices], loads.places, forces, *at_points)
        normal, tangential = np.zeros((2, count, 3))
        points.add_forces(at_points[0], normal)
        points.add_forces(at_points[1], tangential)
        return normal, tangential

    def pairs(self) -> NDArray[np.int64]:
        """(k, 2) the pairs of bodies and obstacles (counted after the bodies) whose surfaces push each other."""
        vertices, owner, count = self._rows().vertices, self.owners.of_points, len(self.owners.names)
        keys = np.unique(owner[vertices[:, 0]].astype(np.int64) * count + owner[vertices[:, 3]])
        return np.column_stack(np.divmod(keys, count))

    def keep_standing(self, standing: tuple[LoadedRows, ShapeLoads], asleep: NDArray[np.bool_]) -> None:
        """Set `standing` to the contacts of an earlier frame, as far as the bodies (b,) still sleep."""
        self.standing = standing
        self.standing = self.at_rest(asleep)

    def at_rest(self, asleep: NDArray[np.bool_]) -> tuple[LoadedRows, ShapeLoads]:
        """The contacts of sleeping bodies (b,) with each other and with obstacles, with their means over the frame."""
        if not asleep.any():
            return LoadedRows.none(), ShapeLoads.none()
        still = np.ones(len(self.owners.names), dtype=np.bool_)
        still[: len(asleep)] = asleep
        rows, loads, owner = self._rows(), self._loads(), self.owners.of_points
        rows = rows.chosen(still[owner[rows.vertices[:, 0]]] & still[owner[rows.vertices[:, 3]]])
        loads = loads.chosen(still[self.owners.of_vertices[loads.vertices]])
        chosen, contact = _same(rows.keys[:, None])
        forces = _sums(contact, rows.forces, len(chosen)) / max(self.substeps, 1)
        rows = LoadedRows._make(values[chosen] for values in rows)._replace(forces=forces)
        chosen, contact = _same(np.column_stack([loads.shapes, loads.vertices.astype(np.int64)]))
        means = _sums(contact, loads.loads, len(chosen)) / max(self.substeps, 1)
        return rows, ShapeLoads._make(values[chosen] for values in loads)._replace(loads=means)

    def by_name(self) -> tuple[dict[str, NDArray[np.float64]], dict[str, NDArray[np.float64]]]:
        """The sums along the normals, and along the surfaces, on each body and obstacle: (3,) [N]; each add up to 0."""
        names, count = self.owners.names, len(self.owners.names)
        normal, tangential = np.zeros((2, count, 3))
        for part in (_of_rows(self._rows(), self), _of_shapes(self._loads(), self)):
            for out, forces in ((normal, part.normal), (tangential, part.tangential)):
                out += _sums(part.first, forces, count) - _sums(part.second, forces, count)
        return dict(zip(names, normal, strict=True)), dict(zip(names, tangential, strict=True))

    def points(
        self, x: NDArray[np.float64], at_end: NDArray[np.float64], old_points: NDArray[np.int32]
    ) -> ContactPoints:
        """All contacts of the frame, one by one. Those of the same vertices in several substeps are one.

        Parameters
        ----------
        x : (t, 3) positions at the end of the frame of what is tested; at_end : (p, 3) of the surfaces' points [m]
        old_points : (s,) the scene's number of each of the solver's points
        """
        return _joined(
            self.owners.names,
            [
                self._surface_points(at_end, old_points),
                self._shape_points(x, old_points),
            ],
        )

    def _rows(self) -> LoadedRows:
        standing = self.standing[0]
        parts = [*self.surfaces, standing._replace(forces=max(self.substeps, 1) * standing.forces)]
        return LoadedRows(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))

    def _loads(self) -> ShapeLoads:
        standing = self.standing[1]
        parts = [*self.shapes, standing._replace(loads=max(self.substeps, 1) * standing.loads)]
        return ShapeLoads(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))

    def _surface_points(self, x: NDArray[np.float64], old_points: NDArray[np.int32]) -> ContactPoints:
        rows, bodies = self._rows(), len(self.owners.rows)
        entries = _of_rows(rows, self)
        places = np.column_stack([rows.keys, rows.vertices.astype(np.int64)])
        chosen, contact = _same(places)
        sizes = np.linalg.norm(rows.forces, axis=1)
        weights = _sums(contact, sizes[:, None] * rows.weights, len(chosen))
        weights /= _sums(contact, sizes, len(chosen))[:, None]
        vertices = rows.vertices[chosen]
        corners = x[vertices]
        sides = [np.einsum("ki,kij->kj", np.maximum(sign * weights, 0.0), corners) for sign in (1.0, -1.0)]
        forces = _sums(contact, entries.normal, len(chosen))
        normals = _directions(forces, rows.normals[chosen])
        k, slot = np.nonzero((vertices < bodies) & (weights != 0.0))
        return ContactPoints(
            points=0.5 * (sides[0] + sides[1]),
            normals=normals,
            forces=forces,
            friction=_sums(contact, entries.tangential, len(chosen)),
            distances=np.einsum("kj,kj->k", sides[0] - sides[1], normals),
            first=entries.first[chosen],
            second=entries.second[chosen],
            names=self.owners.names,
            rows=k,
            vertices=old_points[self.owners.rows[vertices[k, slot]]],
            weights=weights[k, slot],
        )

    def _shape_points(self, x: NDArray[np.float64], old_points: NDArray[np.int32]) -> ContactPoints:
        loads = self._loads()
        entries = _of_shapes(loads, self)
        chosen, contact = _same(np.column_stack([loads.shapes, loads.vertices.astype(np.int64)]))
        forces = _sums(contact, entries.normal, len(chosen))
        normals = _directions(forces, loads.places[chosen, :3])
        vertices, gaps = loads.vertices[chosen], loads.places[chosen, 3]
        return ContactPoints(
            points=x[vertices] - 0.5 * gaps[:, None] * normals,
            normals=normals,
            forces=forces,
            friction=_sums(contact, entries.tangential, len(chosen)),
            distances=gaps,
            first=entries.first[chosen],
            second=entries.second[chosen],
            names=self.owners.names,
            rows=np.arange(len(chosen)),
            vertices=old_points[self.owners.tested[vertices]],
            weights=np.ones(len(chosen)),
        )


@njit(cache=True)
def add_rows(owners, vertices, weights, normals, forces, normal, tangential):
    """Add forces (k, 3) on points (k, 4) of surfaces with weights to those of the system's points."""
    for k in range(len(forces)):
        along = forces[k, 0] * normals[k, 0] + forces[k, 1] * normals[k, 1] + forces[k, 2] * normals[k, 2]
        for slot in range(4):
            if vertices[k, slot] < len(owners):
                i = owners[vertices[k, slot]]
                for j in range(3):
                    normal[i, j] += weights[k, slot] * along * normals[k, j]
                    tangential[i, j] += weights[k, slot] * (forces[k, j] - along * normals[k, j])


@njit(cache=True)
def add_vertices(vertices, places, forces, normal, tangential):
    """Add forces (k, 3) on points (k,), with normals in the first columns of `places`."""
    for k in range(len(vertices)):
        i = vertices[k]
        along = forces[k, 0] * places[k, 0] + forces[k, 1] * places[k, 1] + forces[k, 2] * places[k, 2]
        for j in range(3):
            normal[i, j] += along * places[k, j]
            tangential[i, j] += forces[k, j] - along * places[k, j]


def _of_rows(rows: LoadedRows, frame: FrameForces) -> _Entries:
    owner = frame.owners.of_points
    return _entries(owner[rows.vertices[:, 0]], owner[rows.vertices[:, 3]], rows.forces, rows.normals, frame.substeps)


def _of_shapes(loads: ShapeLoads, frame: FrameForces) -> _Entries:
    owners = frame.owners
    forces = owners.masses[loads.vertices, None] * loads.loads
    first, second = owners.of_vertices[loads.vertices], owners.of_shapes[loads.shapes]
    return _entries(first, second, forces, loads.places[:, :3], frame.substeps)


def _entries(
    first: NDArray[np.int32],
    second: NDArray[np.int32],
    forces: NDArray[np.float64],
    normals: NDArray[np.float64],
    substeps: int,
) -> _Entries:
    forces = forces / max(substeps, 1)
    normal = np.einsum("kj,kj->k", forces, normals)[:, None] * normals
    return _Entries(first, second, normal, forces - normal)


def _same(places: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The last row (c,) with each content, and the number of each row's content (e,)."""
    order = np.lexsort(places.T)
    ordered = places[order]
    differs = np.ones(len(places), dtype=bool)
    differs[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    contact = np.empty(len(places), dtype=np.int64)
    contact[order] = np.cumsum(differs) - 1
    # Equal rows keep their order.
    last = np.flatnonzero(np.append(differs[1:], True)) if len(places) else np.zeros(0, dtype=np.int64)
    return order[last], contact


def _sums(number: NDArray[np.integer], values: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    columns = [values] if values.ndim == 1 else values.T
    sums = [np.bincount(number, column, count) for column in columns]
    return np.stack(sums, axis=1).astype(np.float64, copy=False).reshape(count, *values.shape[1:])


def _directions(forces: NDArray[np.float64], otherwise: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, 3) unit vectors along forces (k, 3), where these are not zero."""
    sizes = np.linalg.norm(forces, axis=1)[:, None]
    return np.where(sizes > 0.0, forces / np.where(sizes > 0.0, sizes, 1.0), otherwise)


def _joined(names: tuple[str, ...], parts: Sequence[ContactPoints]) -> ContactPoints:
    begins = np.cumsum([0, *(len(part) for part in parts[:-1])])
    fields = ("points", "normals", "forces", "friction", "distances", "first", "second", "vertices", "weights")
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in fields}
    rows = np.concatenate([part.rows + begin for part, begin in zip(parts, begins, strict=True)])
    return ContactPoints(**arrays, names=names, rows=rows)
