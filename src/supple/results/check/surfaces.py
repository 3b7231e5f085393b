"""The surfaces of a trajectory in one array: bodies, and the obstacles that are made of triangles."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.mesh.skin import Skin
from supple.mesh.topology import graph_components
from supple.results.check.geometry.box_tree import Tree, refitted, tree_of
from supple.results.check.geometry.surface_pairs import Triangles, touching_pairs
from supple.results.check.known import Floats, Ints, Known, Part
from supple.scene.rows import BodyRows

_MOST_PAIRS = 1000


class Piece(NamedTuple):
    """A connected piece of a body, or of an obstacle made of triangles.

    Attributes
    ----------
    owner : body, or number of bodies + obstacle; triangles : (k,) rows of the surfaces' triangles
    closed : whether it has an inside; vertex : one of its points
    """

    owner: int
    triangles: Ints
    closed: bool
    vertex: int


class Surfaces:
    """All surfaces of a trajectory, and which of them must stay apart.

    Attributes
    ----------
    names : of bodies and obstacles, the owners; bodies : how many owners are bodies
    triangles : (t, 3) those of bodies first; owners : (t,); first_triangle : (p,) the first one of each owner
    allowed : (p, p) which owners' surfaces must stay apart
    ignored : sorted keys a t + b, a < b, of pairs of triangles that may meet: at stitches, their seams, and welds
    stitched : (k, 4) points of each stitch, some of them twice where it has fewer
    skins : (body, skin, its first row) of bodies that touch with their skin, whose points follow vertices
    fixed : (obstacle, its points at time 0, its first row) of obstacles made of triangles; points : number of all rows
    pieces : see `Piece`; closed : whether all pieces of an owner are
    """

    def __init__(self, of: Known) -> None:
        self.bodies, self._file_numbers = len(of.bodies), of.file_numbers
        self.names = tuple(str(thing.name) for thing in (*of.bodies, *of.obstacles))
        triangles: list[Ints] = []
        self.fixed: list[tuple[int, Floats, int]] = []
        self.skins: list[tuple[Part | BodyRows, Skin, int]] = []
        row = len(of.rest_positions)
        for body in of.bodies:
            skin = body.touching_skin
            triangles.append(
                (body.boundary + body.vertices.start if skin is None else skin.triangles + row).astype(int)
            )
            if skin is not None:
                self.skins.append((body, skin, row))
                row += len(skin.corners)
        for j, obstacle in enumerate(of.obstacles):
            points, faces = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
            if obstacle.checked_by_triangles:  # others are checked by their formula
                points, faces = obstacle.triangles()
                self.fixed.append((j, points, row))
            triangles.append(faces.astype(np.int64) + row)
            row += len(points)
        self.points, counts = row, [len(part) for part in triangles]
        self.triangles = np.ascontiguousarray(np.concatenate(triangles).reshape(-1, 3))
        self.owners = np.repeat(np.arange(len(counts)), counts)
        self.first_triangle = np.cumsum(counts) - counts
        self.allowed = np.ones((len(counts), len(counts)), dtype=bool) if of.allowed is None else of.allowed
        self.stitched = self._stitched_points(of)
        self.ignored = np.unique(np.concatenate([*self._stitched_keys(), *self._welded_keys(of)]))
        self.ignored = np.union1d(self.ignored, self._seam_keys(of))
        self.pieces = pieces = self._pieces(of)
        self.closed = [all(piece.closed for piece in pieces if piece.owner == k) for k in range(len(self.names))]

    def place(self, positions: Floats, poses: Floats) -> Floats:
        """All points (n + skins' + obstacles' + 2, 3) of a frame; the last two rows are for a ray."""
        x = np.zeros((self.points + 2, 3))
        x[: len(positions)] = positions
        for body, skin, row in self.skins:
            corners = positions[body.vertices][skin.corners]
            x[row : row + len(corners)] = np.einsum("kw,kwi->ki", skin.weights, corners)
        for obstacle, points, row in self.fixed:
            x[row : row + len(points)] = moved(points, poses[obstacle])
        return x

    def looked_at(self, allowed: NDArray[np.bool_] | None = None) -> Triangles:
        """All triangles; allowed : (p, p) of which owners, instead of all that must stay apart."""
        return Triangles(self.triangles, self.owners, self.allowed if allowed is None else allowed, self.ignored)

    def pairs(
        self, tree: Tree, x0: Floats, x1: Floats | None = None, allowed: NDArray[np.bool_] | None = None
    ) -> tuple[int, Ints]:
        """How many pairs of triangles meet, and the first ones (k, 2) of them, at most a thousand.

        Parameters
        ----------
        tree : over the triangles; with the boxes of x0, where nothing moves
        x0, x1 : (n, 3) all points; with x1, the pairs that penetrate each other between them
        allowed : (p, p) of which owners, instead of all that must stay apart
        """
        out, surface = np.zeros((_MOST_PAIRS, 2), dtype=np.int64), self.looked_at(allowed)
        if x1 is None:
            count = touching_pairs(surface, x0, x0, tree, tree, False, out)
        else:
            trees = (refitted(tree, x, self.triangles) for x in (x0, x1))
            count = touching_pairs(surface, x0, x1, *trees, True, out)
        return count, out[: min(count, _MOST_PAIRS)]

    def name_triangle(self, row: int) -> str:
        """A triangle as messages call it: the row of its own body's surface."""
        owner = int(self.owners[row])
        kind = "" if owner < self.bodies else "obstacle "
        if self._file_numbers is not None:
            number = int(self._file_numbers["triangle"][row])
            corners = "-".join(str(int(self._file_numbers["vertex"][k])) for k in self.triangles[row])
            return f"triangle {corners if number < 0 else number} of {self.names[owner]}"
        return f"triangle {row - int(self.first_triangle[owner])} of {kind}{self.names[owner]}"

    def name_pair(self, pairs: Ints) -> str:
        """The first of pairs (k, 2) of triangles as messages call it."""
        return " and ".join(self.name_triangle(int(row)) for row in pairs[0])

    def _stitched_points(self, of: Known) -> Ints:
        """The nodes of the stitches, of which those on rigid bodies and obstacles are the points at the same place."""
        if of.stitch_ends is None:
            return np.zeros((0, 4), dtype=np.int64)
        stitches = of.stitch_ends
        number = list(range(len(of.rest_positions)))
        skins = {body.vertices.start: (skin, row) for body, skin, row in self.skins}
        for control, weights in zip(stitches.rigid_control.tolist(), stitches.rigid_weights, strict=True):
            skin, row = skins[control[0]]
            number.append(row + int(np.argmin(np.abs(skin.weights - weights).max(axis=1))))
        placed = {obstacle: (points, row) for obstacle, points, row in self.fixed}
        for owner, anchor in zip(stitches.anchor_owners.tolist(), stitches.anchors, strict=True):
            points, row = placed.get(owner, (anchor[None], 0))
            number.append(row + int(np.argmin(np.linalg.norm(points - anchor, axis=1))))
        return np.array(number, dtype=np.int64)[stitches.nodes]

    def _keys(self, first: Ints, second: Ints) -> Ints:
        """Of all pairs of one of the first and one of the second triangles."""
        low, high = np.minimum(first[:, None], second), np.maximum(first[:, None], second)
        return (low * len(self.triangles) + high).ravel()

    def _stitched_keys(self) -> Iterator[Ints]:
        """Stitches as pairs of triangles that may meet: all around a stitched vertex, with those it is stitched to."""
        order = np.argsort(self.triangles.ravel(), kind="stable")
        corners = self.triangles.ravel()[order]

        def around(vertex: np.int64) -> Ints:
            begin, end = np.searchsorted(corners, [vertex, vertex + 1])
            return order[begin:end] // 3

        yield np.zeros(0, dtype=np.int64)
        for vertex, *others in self.stitched:
            second = around(others[0])
            for other in others[1:]:
                second = np.intersect1d(second, around(other))
            yield self._keys(around(vertex), second)

    def _welded_keys(self, of: Known) -> Iterator[Ints]:
        """Welds as pairs of triangles that may meet: those with a welded corner, with those of the rigid body."""
        for weld in of.welds:
            welded = np.isin(self.triangles, weld.vertices).any(axis=1)
            yield self._keys(
                np.flatnonzero((self.owners == weld.soft) & welded), np.flatnonzero(self.owners == weld.rigid)
            )

    def _seam_keys(self, of: Known) -> Ints:
        """The pairs of triangles that meet in the first frame, belong to two things that are stitched to each other,
        and have a stitched corner."""
        if not len(self.stitched):
            return np.zeros(0, dtype=np.int64)
        frame = of.snapshot(0)
        if not np.isfinite(frame.positions).all() or not np.isfinite(frame.poses).all():
            return np.zeros(0, dtype=np.int64)
        x = self.place(frame.positions, frame.poses)
        thing = np.full(len(x), -1)
        thing[self.triangles] = self.owners[:, None]
        joined, ends = np.zeros_like(self.allowed), thing[self.stitched]
        for k in range(1, self.stitched.shape[1]):
            on_surface = (ends[:, 0] >= 0) & (ends[:, k] >= 0)
            joined[ends[on_surface, 0], ends[on_surface, k]] = True
        joined &= self.allowed
        joined |= joined.T
        surface, tree = self.looked_at(joined), tree_of(x, self.triangles)
        pairs = np.zeros((0, 2), dtype=np.int64)
        # The first pass counts, the second one writes.
        for _ in range(2):
            found = touching_pairs(surface, x, x, tree, tree, False, pairs)
            pairs = np.zeros((found, 2), dtype=np.int64) if len(pairs) < found else pairs
        has_stitch = np.asarray(np.isin(self.triangles, self.stitched).any(axis=1))
        low, high = np.sort(pairs[has_stitch[pairs].any(axis=1)], axis=1).T
        return low * len(self.triangles) + high

    def _pieces(self, of: Known) -> tuple[Piece, ...]:
        """Pieces of bodies are connected by tets, so that cavities belong to them; those of obstacles by triangles."""
        tets, triangles = of.tets.astype(np.int64), self.triangles
        parts = [tets[:, [0, k]] for k in (1, 2, 3)] + [triangles[:, [0, 1]], triangles[:, [1, 2]]]
        labels = graph_components(self.points, *np.concatenate(parts).T)[triangles[:, 0]]
        order = np.argsort(labels, kind="stable")
        starts = np.flatnonzero(np.diff(labels[order], prepend=-1))
        pieces, thin = [], {body.number for body, _ in of.thin}
        for rows in np.split(order, starts[1:]) if len(order) else []:
            own = triangles[rows]
            owner = int(self.owners[rows[0]])
            # A thing may be in a closed shell, which is hollow.
            closed = _is_closed(own) and owner not in thin
            pieces.append(Piece(owner, rows, closed, int(own[0, 0])))
        return tuple(pieces)


def moved(points: Floats, pose: Floats) -> Floats:
    """Points (k, 3) of time 0 under a pose (3, 4); the same bits where the pose is the identity."""
    R, t = pose[:, :3], pose[:, 3]
    return points if _is_identity(pose) else points @ R.T + t


def moved_back(points: Floats, pose: Floats) -> Floats:
    """The inverse of `moved`: points (k, 3) under a pose (3, 4), where they were at time 0."""
    R, t = pose[:, :3], pose[:, 3]
    return points if _is_identity(pose) else (points - t) @ R


def _is_identity(pose: Floats) -> bool:
    return np.array_equal(pose, np.eye(3, 4))


def _is_closed(triangles: Ints) -> bool:
    """Whether every side belongs to an even number of triangles: crossings of a ray then determine the inside."""
    sides = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    return bool((np.unique(sides, axis=0, return_counts=True)[1] % 2 == 0).all())
