"""All surfaces of a scene that can touch, as flat arrays: points and triangles of bodies and of triangle obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.obstacles import ObstaclePoses
from supple.mesh.surface import SurfaceMesh
from supple.mesh.topology import connected_components
from supple.model.system import System
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.scene.contact_pairs import PairTable
from supple.scene.obstacles.obstacle import Obstacle


@dataclass(frozen=True, eq=False)
class ContactSurfaces:
    """Points and triangles, and which of them may touch. A piece is a connected part of one body or one obstacle.

    The bodies' points come first, then those of obstacles.

    Attributes
    ----------
    rows : (nb,) points of the system that are on the bodies' surfaces
    embedded : (nb,) these as combinations of the system's vertices
    fixed_points : (no, 3) obstacles' points at time 0 [m]; fixed_owners : (no,) the obstacle of each
    inverse_masses : (n,) 1/m [1/kg] with n = nb + no; zero for points of rigid bodies
    point_piece : (n,)
    triangles : (t, 3) indices of points, sorted by piece, those of bodies first; triangle_piece : (t,)
    body_triangles : number of triangles of bodies
    owner : (p,) the row of the piece's body or obstacle in the scene's `PairTable`
    closed : (p,) whether a piece has an inside
    allowed : (p, p) whether points of the first piece may touch triangles of the second
    gaps : (p, p) gap that is kept between the two [m]; friction : (p, p) Coulomb coefficients
    """

    rows: NDArray[np.int32]
    embedded: EmbeddedPoints
    fixed_points: NDArray[np.float64]
    fixed_owners: NDArray[np.int32]
    inverse_masses: NDArray[np.float64]
    point_piece: NDArray[np.int32]
    triangles: NDArray[np.int32]
    triangle_piece: NDArray[np.int32]
    body_triangles: int
    owner: NDArray[np.int64]
    closed: NDArray[np.bool_]
    allowed: NDArray[np.bool_]
    gaps: NDArray[np.float64]
    friction: NDArray[np.float64]

    @property
    def is_needed(self) -> bool:
        """Whether any contact is possible."""
        return bool(self.allowed.any()) and len(self.triangles) > 0

    def place_obstacles(self, poses: ObstaclePoses, time: float, out: NDArray[np.float64]) -> None:
        """Write the positions of the obstacles' points at `time` [s] into the last rows of out (n, 3)."""
        if len(self.fixed_points):
            R, t = poses.at(time)
            out[len(self.rows) :] = (
                np.einsum("kij,kj->ki", R[self.fixed_owners], self.fixed_points) + t[self.fixed_owners]
            )


@dataclass
class _Piece:
    """The contact rules of a piece: `owner` is the row of its body or obstacle in the scene's `PairTable`."""

    owner: int
    closed: bool = True
    gap: float | None = None


class _Part(NamedTuple):
    """The surfaces of all bodies or of one obstacle: (k, 3) points, their pieces (k,), and triangles (t, 3) of them."""

    pieces: list[_Piece]
    points: NDArray[np.float64]
    point_piece: NDArray[np.int32]
    triangles: NDArray[np.int32]


def build_surfaces(
    system: System,
    table: PairTable,
    body_collision: bool,
    self_collision: bool,
    thickness: float,
    skin: float,
) -> ContactSurfaces:
    """Collect what may touch.

    Parameters
    ----------
    table : which bodies and obstacles may touch, and with which friction
    body_collision, self_collision : whether bodies touch each other, and themselves
    thickness : the gap that surfaces keep; skin : that from obstacles of simple shape [m]
    """
    rows, bodies = _body_part(system)
    fixed = [_obstacle_part(table.bodies + k, each, skin) for k, each in enumerate(system.obstacles)]
    pieces: list[_Piece] = []
    point_piece, triangles, count = [], [], 0
    for part in (bodies, *fixed):
        point_piece.append(part.point_piece + len(pieces))
        triangles.append(part.triangles + count)
        pieces += part.pieces
        count += len(part.points)
    piece_of = np.concatenate(point_piece).astype(np.int32)
    all_triangles = np.ascontiguousarray(np.concatenate(triangles), dtype=np.int32)
    fixed_points = np.concatenate([np.zeros((0, 3)), *(part.points for part in fixed)])
    allowed, gaps, friction = _rules(pieces, table, body_collision, self_collision, thickness)
    for piece in range(len(bodies.pieces)):
        # A rigid body does not fold.
        allowed[piece, piece] &= not system.bodies[pieces[piece].owner].rigid
    embedded = system.points.taken(rows)
    inverse = np.where(embedded.single < 0, 0.0, system.inverse_masses[embedded.single])
    return ContactSurfaces(
        rows=rows,
        embedded=embedded,
        fixed_points=fixed_points,
        fixed_owners=np.repeat(np.arange(len(fixed), dtype=np.int32), [len(part.points) for part in fixed]),
        inverse_masses=np.concatenate([inverse, np.zeros(len(fixed_points))]),
        point_piece=piece_of,
        triangles=all_triangles,
        triangle_piece=piece_of[all_triangles[:, 0]],
        body_triangles=len(bodies.triangles),
        owner=np.array([piece.owner for piece in pieces], dtype=np.int64),
        closed=np.array([piece.closed for piece in pieces], dtype=np.bool_),
        allowed=allowed,
        gaps=gaps,
        friction=friction,
    )


def _body_part(system: System) -> tuple[NDArray[np.int32], _Part]:
    """The points of the system that are on the bodies' surfaces, and these surfaces."""
    rows = np.unique(system.triangles).astype(np.int32)
    index = np.full(len(system.points), -1, dtype=np.int32)
    index[rows] = np.arange(len(rows), dtype=np.int32)
    components = system.components[system.points.vertices[system.points.start[rows]]]
    _, first, piece = np.unique(components, return_index=True, return_inverse=True)
    ends = [part.points.stop for part in system.bodies]
    pieces = [_Piece(int(owner)) for owner in np.searchsorted(ends, rows[first], side="right")]
    triangles = index[system.triangles]
    order = np.argsort(piece[triangles[:, 0]], kind="stable")
    return rows, _Part(pieces, system.rest_points[rows], piece.astype(np.int32), triangles[order])


def _obstacle_part(owner: int, obstacle: Obstacle, skin: float) -> _Part:
    if obstacle.contact_mesh is None:
        return _Part([], np.zeros((0, 3)), np.zeros(0, dtype=np.int32), np.zeros((0, 3), dtype=np.int32))
    return _triangle_part(owner, obstacle.contact_mesh, None if obstacle.surface_mesh is not None else skin)


def _triangle_part(owner: int, mesh: SurfaceMesh, gap: float | None) -> _Part:
    surface = mesh.compact()
    triangles = surface.triangles
    count, labels = connected_components(triangles, len(surface.vertices))
    order = np.argsort(labels, kind="stable")
    triangles, labels = triangles[order], labels[order]
    closed = np.array([_is_closed(triangles[labels == piece]) for piece in range(count)])
    inward = closed[labels].all() and surface.volume < 0.0
    point_piece = np.zeros(len(surface.vertices), dtype=np.int32)
    point_piece[triangles] = labels[:, None]
    pieces = [_Piece(owner, closed=bool(c), gap=gap) for c in closed]
    return _Part(pieces, surface.vertices, point_piece, triangles[:, ::-1] if inward else triangles)


def _is_closed(triangles: NDArray[np.int32]) -> bool:
    """Whether every edge of consistently wound triangles has one triangle on each side."""
    starts, ends = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    n = int(triangles.max()) + 1
    forward, backward = starts.astype(np.int64) * n + ends, ends.astype(np.int64) * n + starts
    return len(np.unique(forward)) == len(forward) and np.array_equal(np.sort(forward), np.sort(backward))


def _rules(
    pieces: Sequence[_Piece], table: PairTable, body_collision: bool, self_collision: bool, thickness: float
) -> tuple[NDArray[np.bool_], NDArray[np.float64], NDArray[np.float64]]:
    """(p, p) arrays: may touch, gap, friction. See `build_surfaces`."""
    owner = np.array([piece.owner for piece in pieces])
    fixed = owner >= table.bodies
    gap = np.array([thickness if piece.gap is None else piece.gap for piece in pieces])
    same = np.eye(len(pieces), dtype=np.bool_)
    both_bodies = ~fixed[:, None] & ~fixed[None, :]
    allowed = fixed[:, None] ^ fixed[None, :]
    allowed |= both_bodies & ((same & self_collision) | (~same & body_collision))
    gaps = np.where(fixed[:, None], gap[:, None], gap[None, :])
    pairs = np.ix_(owner, owner)
    allowed &= table.collide[pairs]
    return allowed, np.ascontiguousarray(gaps), np.ascontiguousarray(table.friction[pairs])
