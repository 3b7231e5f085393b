"""The surfaces of a recording in one array: bodies, and the obstacles that are made of triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from supple.results.check.geometry.box_tree import build_tree, triangle_boxes
from supple.results.check.geometry.surface_pairs import meeting_pairs
from supple.results.check.trajectory import Part, Trajectory


@dataclass(frozen=True, eq=False)
class Piece:
    """A connected piece of a body, or of an obstacle made of triangles.

    Attributes
    ----------
    owner : body, or number of bodies + obstacle; triangles : (k,) rows of the surfaces' triangles
    closed : whether it has an inside; vertex : one of its points
    """

    owner: int
    triangles: NDArray[np.int64]
    closed: bool
    vertex: int


class Surfaces:
    """All surfaces of a recording, and which of them must stay apart.

    Attributes
    ----------
    names : of bodies and obstacles, the owners; bodies : how many owners are bodies
    triangles : (t, 3) those of bodies first; owners : (t,); first_triangle : (p,) the first one of each owner
    allowed : (p, p) which owners' surfaces must stay apart; ignored : sorted keys of pairs of triangles that may meet
    stitched : (k, 4) points of each stitch, some of them twice where it has fewer
    skins : (body, its first row) of bodies that touch with their skin, whose points follow vertices
    fixed : (obstacle, its points at time 0, its first row) of obstacles made of triangles; points : number of all rows
    pieces : see `Piece`; closed : whether all pieces of an owner are
    """

    def __init__(self, recording: Trajectory) -> None:
        self.bodies, self._file_numbers = len(recording.bodies), recording.file_numbers
        self.names = tuple(str(thing.name) for thing in (*recording.bodies, *recording.obstacles))
        triangles: list[NDArray[np.int64]] = []
        self.fixed: list[tuple[int, NDArray[np.float64], int]] = []
        self.skins: list[tuple[Part, int]] = []
        row = len(recording.rest_positions)
        for body in recording.bodies:
            if body.touches_with_skin and body.skin is not None:
                self.skins.append((body, row))
                triangles.append(body.skin.triangles.astype(np.int64) + row)
                row += len(body.skin.corners)
            else:
                triangles.append(body.triangles.astype(np.int64) + body.vertices.start)
        counts = [len(part) for part in triangles]
        for j, obstacle in enumerate(recording.obstacles):
            points, faces = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
            if obstacle.checked_by_triangles:  # others are checked by their formula
                points, faces = obstacle.triangles()
                self.fixed.append((j, points, row))
            triangles.append(faces.astype(np.int64) + row)
            counts.append(len(faces))
            row += len(points)
        self.points = row
        self.triangles = np.ascontiguousarray(np.concatenate(triangles).reshape(-1, 3))
        self.owners = np.repeat(np.arange(len(counts)), counts)
        self.first_triangle = np.cumsum(counts) - counts
        self.allowed = _allowed(recording, self.bodies, len(self.names))
        self.stitched = self._stitched_points(recording)
        self.ignored = np.union1d(_ignored_keys(self.stitched, self.triangles), self._welded_keys(recording))
        self.pieces = pieces = _pieces(recording, self.triangles, self.owners, row)
        self.closed = [all(piece.closed for piece in pieces if piece.owner == k) for k in range(len(self.names))]

    def place(self, positions: NDArray[np.float64], poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """All points (n + skins' + obstacles' + 2, 3) of a frame; the last two rows are room for a ray."""
        x = np.zeros((self.points + 2, 3))
        x[: len(positions)] = positions
        for body, row in self.skins:
            assert body.skin is not None
            corners = positions[body.vertices][body.skin.corners]
            x[row : row + len(corners)] = np.einsum("kw,kwi->ki", body.skin.weights, corners)
        for obstacle, points, row in self.fixed:
            x[row : row + len(points)] = moved(points, poses[obstacle])
        return x

    def _stitched_points(self, recording: Trajectory) -> NDArray[np.int64]:
        """The nodes of the stitches, of which those on rigid bodies and obstacles are the points at the same place."""
        if recording.stitches is None:
            return np.zeros((0, 4), dtype=np.int64)
        stitches = recording.stitches.ends
        number = list(range(len(recording.rest_positions)))
        skins = {body.vertices.start: (body.skin, row) for body, row in self.skins}
        for control, weights in zip(stitches.rigid_control.tolist(), stitches.rigid_weights, strict=True):
            skin, row = skins[control[0]]
            assert skin is not None
            number.append(row + int(np.argmin(np.abs(skin.weights - weights).max(axis=1))))
        placed = {obstacle: (points, row) for obstacle, points, row in self.fixed}
        for owner, anchor in zip(stitches.anchor_owners.tolist(), stitches.anchors, strict=True):
            points, row = placed.get(owner, (anchor[None], 0))
            number.append(row + int(np.argmin(np.linalg.norm(points - anchor, axis=1))))
        return np.array(number, dtype=np.int64)[stitches.nodes]

    def _welded_keys(self, recording: Trajectory) -> NDArray[np.int64]:
        """Welds as pairs of triangles that may meet: those with a welded corner, with those of the rigid body."""
        keys = [np.zeros(0, dtype=np.int64)]
        for weld in recording.welds:
            soft = np.flatnonzero((self.owners == weld.soft) & np.isin(self.triangles, weld.vertices).any(axis=1))
            rigid = np.flatnonzero(self.owners == weld.rigid)
            low, high = np.minimum(soft[:, None], rigid), np.maximum(soft[:, None], rigid)
            keys.append((low * len(self.triangles) + high).ravel())
        return np.concatenate(keys)

    def name_triangle(self, row: int) -> str:
        """A triangle as messages call it: the row of its own body's surface."""
        owner = int(self.owners[row])
        kind = "" if owner < self.bodies else "obstacle "
        if self._file_numbers is not None:
            number = int(self._file_numbers["triangle"][row])
            corners = "-".join(str(int(self._file_numbers["vertex"][k])) for k in self.triangles[row])
            return f"triangle {corners if number < 0 else number} of {self.names[owner]}"
        return f"triangle {row - int(self.first_triangle[owner])} of {kind}{self.names[owner]}"


def moved(points: NDArray[np.float64], pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (k, 3) of time 0 under a pose (3, 4); the same bits where the pose is the identity."""
    R, t = pose[:, :3], pose[:, 3]
    if np.array_equal(R, np.eye(3)) and not t.any():
        return points
    return points @ R.T + t


def moved_back(points: NDArray[np.float64], pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """The inverse of `moved`: points (k, 3) under a pose (3, 4), where they were at time 0."""
    R, t = pose[:, :3], pose[:, 3]
    return points if np.array_equal(R, np.eye(3)) and not t.any() else (points - t) @ R


def _allowed(recording: Trajectory, bodies: int, owners: int) -> NDArray[np.bool_]:
    """(p, p) which owners must stay apart: all but two obstacles, and pairs that the scene excludes."""
    is_body = np.arange(owners) < bodies
    allowed = is_body[:, None] | is_body[None, :]
    for i, j in recording.untouching:
        allowed[i, j] = allowed[j, i] = False
    return allowed


def _ignored_keys(stitched: NDArray[np.int64], triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Stitches as pairs of triangles that may meet: all around the stitched vertex, with those it is stitched to."""
    order = np.argsort(triangles.ravel(), kind="stable")
    corners = triangles.ravel()[order]

    def around(vertex: np.int64) -> NDArray[np.int64]:
        begin, end = np.searchsorted(corners, [vertex, vertex + 1])
        return order[begin:end] // 3

    keys = [np.zeros(0, dtype=np.int64)]
    for vertex, *others in stitched:
        second = around(others[0])
        for other in others[1:]:
            second = np.intersect1d(second, around(other))
        first = around(vertex)
        low, high = np.minimum(first[:, None], second), np.maximum(first[:, None], second)
        keys.append((low * len(triangles) + high).ravel())
    return np.unique(np.concatenate(keys))


def _pieces(
    recording: Trajectory, triangles: NDArray[np.int64], owners: NDArray[np.int64], points: int
) -> tuple[Piece, ...]:
    """Pieces of bodies are connected by tets, so that cavities belong to them; those of obstacles by triangles."""
    tets = recording.tets.astype(np.int64)
    parts = [tets[:, [0, k]] for k in (1, 2, 3)] + [triangles[:, [0, 1]], triangles[:, [1, 2]]]
    ends = np.concatenate(parts)
    graph = coo_matrix((np.ones(len(ends), dtype=np.int8), (ends[:, 0], ends[:, 1])), shape=(points, points))
    labels = connected_components(graph, directed=False)[1][triangles[:, 0]]
    order = np.argsort(labels, kind="stable")
    starts = np.flatnonzero(np.diff(labels[order], prepend=-1))
    pieces = []
    for rows in np.split(order, starts[1:]) if len(order) else []:
        own = triangles[rows]
        pieces.append(Piece(int(owners[rows[0]]), rows, _is_closed(own), int(own[0, 0])))
    return tuple(pieces)


def _is_closed(triangles: NDArray[np.int64]) -> bool:
    """Whether every side belongs to an even number of triangles: crossings of a ray then determine the inside."""
    sides = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    return bool((np.unique(sides, axis=0, return_counts=True)[1] % 2 == 0).all())


def seam_keys(recording: Trajectory, surfaces: Surfaces) -> NDArray[np.int64]:
    """Keys, as in `Surfaces.ignored`, of the pairs of triangles that meet in the first frame, belong to two things that
    are stitched to each other, and have a stitched corner."""
    stitched = surfaces.stitched
    if not len(stitched):
        return np.zeros(0, dtype=np.int64)
    frame = recording.frame(0)
    if not np.isfinite(frame.positions).all() or not np.isfinite(frame.poses).all():
        return np.zeros(0, dtype=np.int64)
    x, triangles, owners = surfaces.place(frame.positions, frame.poses), surfaces.triangles, surfaces.owners
    thing = np.full(len(x), -1)
    thing[triangles] = owners[:, None]
    joined = np.zeros_like(surfaces.allowed)
    ends = thing[stitched]
    for k in range(1, stitched.shape[1]):
        on_surface = (ends[:, 0] >= 0) & (ends[:, k] >= 0)
        joined[ends[on_surface, 0], ends[on_surface, k]] = True
    joined &= surfaces.allowed
    joined |= joined.T
    low, high = triangle_boxes(x, triangles)
    tree = low, high, *build_tree(low, high)
    pairs = np.zeros((0, 2), dtype=np.int64)
    # The first pass counts, the second one writes.
    for _ in range(2):
        found = meeting_pairs(x, triangles, owners, joined, surfaces.ignored, *tree, pairs)
        pairs = np.zeros((found, 2), dtype=np.int64) if len(pairs) < found else pairs
    has_stitch = np.asarray(np.isin(triangles, stitched).any(axis=1))
    pairs = np.sort(pairs[has_stitch[pairs].any(axis=1)], axis=1)
    return pairs[:, 0] * len(triangles) + pairs[:, 1]
