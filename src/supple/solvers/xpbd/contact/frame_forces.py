"""The contact forces of a frame: means over its substeps, one by one and by body."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.model.state import ContactPoints
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.numerics.mat3 import dot, row
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.pairs import SHAPE, is_loaded


class LoadedRows(NamedTuple):
    """Rows that hold a force, see `ROW`.

    Attributes
    ----------
    keys : (k,) of their pairs; nodes : (k, 4); weights : (k, 4); normals : (k, 3)
    places : (k, 3) the place of a simple shape [m]; zero where the second side has nodes
    forces : (k, 3) on the first side [N]; owners : (k, 2) what the sides belong to: bodies, then obstacles
    """

    keys: NDArray[np.int64]
    nodes: NDArray[np.int32]
    weights: NDArray[np.float64]
    normals: NDArray[np.float64]
    places: NDArray[np.float64]
    forces: NDArray[np.float64]
    owners: NDArray[np.int64]

    def chosen(self, kept: NDArray[np.bool_] | NDArray[np.int64] | slice) -> LoadedRows:
        """Those rows (of k,) that are kept."""
        return LoadedRows._make(values[kept] for values in self)

    @classmethod
    def room(cls, k: int) -> LoadedRows:
        """For k rows."""
        wide = np.zeros((k, 4), dtype=np.int32), np.zeros((k, 4))
        three = np.zeros((k, 3)), np.zeros((k, 3)), np.zeros((k, 3))
        return cls(np.zeros(k, np.int64), *wide, *three, np.zeros((k, 2), np.int64))


@njit
def add_loaded(rows, count, pairs, owner, shape_owners, origin, h, log, first):
    """Append those of the first rows that have an impulse to the log of `LoadedRows`; returns its new length.

    owner : (N,) of nodes, shape_owners : of shapes; origin : (3,) of places [m]; h : of the substep [s]
    first : how many rows the log has
    """
    for e in range(count):
        if not is_loaded(rows.impulses, e):
            continue
        p = rows.pairs[e]
        log.keys[first], log.owners[first, 0] = pairs.keys[p], owner[rows.nodes[e, 0]]
        on_shape = rows.kinds[e] == SHAPE
        log.owners[first, 1] = shape_owners[pairs.shapes[p]] if on_shape else owner[rows.nodes[e, 3]]
        for j in range(4):
            log.nodes[first, j], log.weights[first, j] = rows.nodes[e, j], rows.weights[e, j]
        for j in range(3):
            log.normals[first, j], log.forces[first, j] = rows.normals[e, j], rows.impulses[e, j] / (h * h)
            log.places[first, j] = rows.places[e, j] + origin[j] if on_shape else 0.0
        first += 1
    return first


@njit
def works_of(log, first, last, of_point, points, x, begun):
    """The works of rows of the log along normals, and along surfaces [J].

    of_point : (N,) the system's points, which are `points` (start, vertices, weights)
    x, begun : (n, >= 3) its vertices when the substep ends and began [m]
    """
    start, vertices, shares = points
    normal = tangential = 0.0
    for k in range(first, last):
        a = b = c = 0.0
        for slot in range(4):
            i = of_point[log.nodes[k, slot]]
            if i < 0:
                continue
            for m in range(start[i], start[i + 1]):
                v, w = vertices[m], log.weights[k, slot] * shares[m]
                a += w * (x[v, 0] - begun[v, 0])
                b += w * (x[v, 1] - begun[v, 1])
                c += w * (x[v, 2] - begun[v, 2])
        force, n, way = row(log.forces, k), row(log.normals, k), (a, b, c)
        along = dot(force, n) * dot(n, way)
        normal += along
        tangential += dot(force, way) - along
    return normal, tangential


class FrameForces:
    """The contact forces in the substeps of one frame, in the numbering of the solver.

    Parameters
    ----------
    names : of bodies, then of obstacles
    points : (N,) the point of the system that each node is, -1 for others
    log : the rows that pushed, of all substeps, and room for more

    Attributes
    ----------
    latest : of the latest substep; rows : of all; count : number of substeps
    standing : of things that sleep with each other and with obstacles, which are those of every substep
    """

    def __init__(self, names: tuple[str, ...], points: NDArray[np.int32], log: LoadedRows | None = None) -> None:
        self.names, self.points = names, points
        self.log = LoadedRows.room(0) if log is None else log
        self.rows = self.latest = self.standing = LoadedRows.room(0)
        self.count = 0

    def end_substeps(self, latest: int, logged: int, count: int) -> None:
        """Note that `count` substeps have filled `logged` rows of the log, the last one from row `latest` on."""
        self.rows, self.latest = self.log.chosen(slice(0, logged)), self.log.chosen(slice(latest, logged))
        self.count = count

    def end_frame(self) -> None:
        """Keep the rows, as the log is filled again in the next frame."""
        self.rows = LoadedRows._make(values.copy() for values in self.rows)

    def add_to(self, out: NDArray[np.float64], points: EmbeddedPoints, latest: int, logged: int) -> None:
        """Add the forces of the rows latest to logged of the log to those on the vertices (n, 3) [N].

        points : of the system
        """
        at_points, rows = np.zeros((len(points), 3)), self.log.chosen(slice(latest, logged))
        add_rows(self.points, rows.nodes, rows.weights, rows.forces, at_points)
        points.add_forces(at_points, out)

    def pairs(self) -> NDArray[np.int64]:
        """(k, 2) the pairs of bodies and obstacles (counted after the bodies) that push each other."""
        owners = np.concatenate([rows.owners for rows in (self.rows, self.standing)])
        numbers = np.unique(owners[:, 0] * len(self.names) + owners[:, 1])
        return np.column_stack(np.divmod(numbers, len(self.names)))

    def keep_standing(self, standing: LoadedRows, asleep: NDArray[np.bool_]) -> None:
        """Set `standing` to the contacts of an earlier frame, as far as the bodies (b,) still sleep."""
        self.standing = standing
        self.standing = self.at_rest(asleep)

    def at_rest(self, asleep: NDArray[np.bool_]) -> LoadedRows:
        """The contacts of sleeping bodies (b,) with each other and with obstacles, with their means over the frame."""
        if not asleep.any():
            return LoadedRows.room(0)
        still = np.ones(len(self.names), dtype=np.bool_)
        still[: len(asleep)] = asleep
        rows = self._rows()
        rows = rows.chosen(np.asarray(still[rows.owners].all(axis=1)))
        last, number = _same(rows.keys)
        forces = _sums(number, rows.forces, len(last)) / max(self.count, 1)
        return rows.chosen(last)._replace(forces=forces)

    def by_name(self) -> tuple[dict[str, NDArray[np.float64]], dict[str, NDArray[np.float64]]]:
        """The sums along the normals, and along the surfaces, on each body and obstacle: (3,) [N]; each add up to 0."""
        rows, count = self._rows(), len(self.names)
        out = []
        for forces in self._parts(rows):
            sums = _sums(rows.owners[:, 0], forces, count) - _sums(rows.owners[:, 1], forces, count)
            out.append(dict(zip(self.names, sums, strict=True)))
        return out[0], out[1]

    def contact_points(self, x: NDArray[np.float64], old_points: NDArray[np.int32]) -> ContactPoints:
        """All contacts of the frame, one by one. Those of the same pair in several substeps are one.

        Parameters
        ----------
        x : (N, 3) the nodes at the end of the frame [m]
        old_points : (s,) the scene's number of each of the solver's points
        """
        rows = self._rows()
        last, number = _same(rows.keys)
        sizes = np.linalg.norm(rows.forces, axis=1)[:, None]
        total = _sums(number, sizes, len(last))
        weights = _sums(number, sizes * rows.weights, len(last)) / total
        ends = _sums(number, sizes * rows.places, len(last)) / total
        nodes, owners = rows.nodes[last], rows.owners[last]
        first, second = (np.einsum("ki,kij->kj", np.maximum(sign * weights, 0.0), x[nodes]) for sign in (1.0, -1.0))
        second += ends
        normal, tangential = (_sums(number, forces, len(last)) for forces in self._parts(rows))
        normals = _directions(normal, rows.normals[last])
        point = self.points[nodes]
        k, slot = np.nonzero((point >= 0) & (weights != 0.0))
        return ContactPoints(
            points=0.5 * (first + second),
            normals=normals,
            forces=normal,
            friction=tangential,
            distances=np.einsum("kj,kj->k", first - second, normals),
            first=owners[:, 0].astype(np.int32),
            second=owners[:, 1].astype(np.int32),
            names=self.names,
            rows=k,
            vertices=old_points[point[k, slot]],
            weights=weights[k, slot],
        )

    def _rows(self) -> LoadedRows:
        parts = self.rows, self.standing._replace(forces=max(self.count, 1) * self.standing.forces)
        return LoadedRows._make(np.concatenate(arrays) for arrays in zip(*parts, strict=True))

    def _parts(self, rows: LoadedRows) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The forces along the normals, and those along the surfaces, as shares of their means over the frame."""
        forces = rows.forces / max(self.count, 1)
        normal = np.einsum("kj,kj->k", forces, rows.normals)[:, None] * rows.normals
        return normal, forces - normal


@njit(cache=True)
def add_rows(points, nodes, weights, forces, out):
    """Add forces (k, 3) on nodes (k, 4) with weights to those of the system's points, `points` (N,)."""
    for k in range(len(forces)):
        for slot in range(4):
            i = points[nodes[k, slot]]
            if i >= 0:
                for j in range(3):
                    out[i, j] += weights[k, slot] * forces[k, j]


def _same(keys: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The last row (c,) with each key, and the number of each row's key (e,)."""
    _, first, number = np.unique(keys[::-1], return_index=True, return_inverse=True)
    return len(keys) - 1 - first, number[::-1]


def _sums(number: NDArray[np.integer], values: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    sums = [np.bincount(number, column, count) for column in values.T]
    return np.stack(sums, axis=1).astype(np.float64, copy=False).reshape(count, values.shape[1])


def _directions(forces: NDArray[np.float64], otherwise: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, 3) unit vectors along forces (k, 3), where these are not zero."""
    sizes = np.linalg.norm(forces, axis=1)[:, None]
    return np.where(sizes > 0.0, forces / np.where(sizes > 0.0, sizes, 1.0), otherwise)
