"""The surfaces that may touch, as one triangle mesh on embedded points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.near_at_rest import near_at_rest
from supple.contact.mesh.obstacles import ObstacleRange
from supple.contact.mesh.stitch_filter import StitchFilter, WeldedPoints, stitch_filter
from supple.contact.search.patches import Parts, Patches, patches_of
from supple.mesh.topology import are_edges, edge_keys
from supple.model.system import System
from supple.numerics.adjacency import Adjacency, adjacency, joined_lists, no_lists
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.numerics.geometry.triangle_crossings import crossing_triangles


@dataclass(frozen=True, eq=False)
class ContactMesh:
    """Surface triangles of bodies and obstacles (half-spaces aside), with s points, e edges and f triangles.

    Indices are int32 and name rows of this mesh's own points, edges and triangles.

    Attributes
    ----------
    points : where the points are
    triangles : (f, 3) points; edges of rods are triangles whose last two corners are the same
    edges : (e, 2) points, the lower first, in lexicographic order
    triangle_edges : (f, 3) edge k joins the corners k and k + 1; of an edge of a rod itself three times
    edge_triangles, vertex_triangles : the triangles at each edge (none at one of a rod, one at a boundary, two on a
        manifold) and each point
    neighbors : the points that an edge joins to each point
    owner : (s,) number of the body, or (number of bodies) + number of the obstacle, of each point
    areas, edge_areas : (s,), (e,) a third of the adjacent triangles' area at rest; of rods, of width times
        length half at each end, and a third at the edge [m^2]
    edge_lengths : (e,) at rest [m]
    body_count : how many of the owners are bodies; names : of all owners
    collide : (p, p) which owners may touch
    patches : of neighbouring triangles, for searches
    stitched : pairs that do not collide because they are stitched or welded; None where there are none
    rows : (s,) the point of the system that each is, or -1
    offsets : (s,) how far in front of its triangles the surface of a thing is: half of a shell's thickness, or 0 [m]
    near_at_rest : pairs of a surface and itself that are nearer at rest than the offsets; None without offsets
    """

    points: EmbeddedPoints
    triangles: NDArray[np.int32]
    edges: NDArray[np.int32]
    triangle_edges: NDArray[np.int32]
    edge_triangles: Adjacency
    vertex_triangles: Adjacency
    neighbors: Adjacency
    owner: NDArray[np.int32]
    areas: NDArray[np.float64]
    edge_areas: NDArray[np.float64]
    edge_lengths: NDArray[np.float64]
    body_count: int
    names: tuple[str, ...]
    collide: NDArray[np.bool_]
    patches: Patches
    stitched: StitchFilter | None
    rows: NDArray[np.int32]
    offsets: NDArray[np.float64]
    near_at_rest: tuple[Adjacency, Adjacency] | None

    @property
    def excluded(self) -> tuple[Adjacency, Adjacency]:
        """See `Parts`."""
        lists = [] if self.stitched is None else [(self.stitched.triangles_of_point, self.stitched.edges_of_edge)]
        if self.near_at_rest is not None:
            lists.append(self.near_at_rest)
        if len(lists) == 2:
            (points, edges), (other_points, other_edges) = lists
            return joined_lists(points, other_points), joined_lists(edges, other_edges)
        if lists:
            return lists[0]
        return no_lists(len(self.owner)), no_lists(len(self.edges))

    @property
    def parts(self) -> Parts:
        """As a search takes them."""
        every = np.arange(len(self.owner), dtype=np.int32)
        return Parts(every, self.triangles, self.edges, self.collide, *self.excluded)


def contact_mesh(
    system: System,
    obstacles: tuple[ObstacleRange, ...],
    collide: NDArray[np.bool_],
    start: NDArray[np.float64],
    touching: float | None = None,
) -> ContactMesh:
    """Join the surfaces of a system whose obstacles are vertices (see `with_obstacles`).

    Parameters
    ----------
    collide : (p, p) which owners may touch, bodies before obstacles
    start : (n, 3) where everything is at the start [m]
    touching : how near stitched parts are at the start that do not collide, see `stitch_filter` [m]
    """
    points, corners, owner = joined_surfaces(system, obstacles)
    used = np.unique(corners)
    number = np.full(len(points), -1, dtype=np.int32)
    number[used] = np.arange(len(used), dtype=np.int32)
    surface = points.taken(used)
    of_vertex = points_of_stitches(system, obstacles)
    return mesh_of_triangles(
        surface,
        number[corners],
        owner[used],
        surface.positions(system.rest_positions),
        body_count=len(system.bodies),
        names=tuple(part.name for part in system.bodies) + tuple(str(o.name) for o in system.obstacles),
        collide=collide,
        stitches=(of_vertex[system.stitching.seams()], surface.positions(start)),
        welded=_welded_points(system, of_vertex),
        touching=touching,
        rows=np.where(used < len(system.points), used, -1).astype(np.int32),
        offsets=_offsets(system)[owner[used]],
    )


def _offsets(system: System) -> NDArray[np.float64]:
    """(p,) of bodies, then obstacles; see `ContactMesh`."""
    return np.array([part.body.offset for part in system.bodies] + [0.0] * len(system.obstacles))


def points_of_stitches(system: System, obstacles: tuple[ObstacleRange, ...]) -> NDArray[np.int32]:
    """(q + 1,) of each node of stitches the point of `contact_mesh` that it is, -1 where it is on no surface."""
    points, corners, _ = joined_surfaces(system, obstacles)
    number = np.full(len(points) + 1, -1, dtype=np.int32)
    used = np.unique(corners)
    number[used] = np.arange(len(used), dtype=np.int32)
    # Obstacles are vertices here; the last entry is for nodes without one.
    return number[np.append(system.stitching.points_of_nodes(points), -1)]


def joined_surfaces(
    system: System, obstacles: tuple[ObstacleRange, ...]
) -> tuple[EmbeddedPoints, NDArray[np.int32], NDArray[np.int32]]:
    """Points (s,) of a system, then the vertices of obstacles, triangles (f, 3) of such points, and owners (s,)."""
    bodies = len(system.bodies)
    points, triangles = [system.points], [system.triangles]
    owner = [np.repeat(np.arange(bodies), [part.points.stop - part.points.start for part in system.bodies])]
    for part in obstacles:
        if not part.is_plane:
            triangles.append(part.triangles + sum(map(len, points)))
            points.append(EmbeddedPoints.at_vertices(part.vertices))
            owner.append(np.full(len(part.vertices), bodies + part.index))
    corners = np.ascontiguousarray(np.concatenate(triangles), dtype=np.int32)
    return EmbeddedPoints.joined(points), corners, np.concatenate(owner).astype(np.int32)


def _welded_points(system: System, of_vertex: NDArray[np.int32]) -> WeldedPoints | None:
    welding = system.welding
    of_weld = welding.vertices[welding.weld >= 0]
    if not len(of_weld):
        return None
    number = {part.name: k for k, part in enumerate(system.bodies)}
    joined = np.array([(number[weld.body], number[weld.rigid]) for weld in system.scene.welds], dtype=np.int64)
    points = of_vertex[of_weld]
    return WeldedPoints(points[points >= 0], joined)


def mesh_of_triangles(
    points: EmbeddedPoints,
    triangles: NDArray[np.int32],
    owner: NDArray[np.int32],
    rest: NDArray[np.float64],
    *,
    body_count: int,
    names: tuple[str, ...],
    collide: NDArray[np.bool_],
    stitches: tuple[NDArray[np.int32], NDArray[np.float64]] | None = None,
    welded: WeldedPoints | None = None,
    touching: float | None = None,
    rows: NDArray[np.int32] | None = None,
    offsets: NDArray[np.float64] | None = None,
) -> ContactMesh:
    """The mesh of triangles (f, 3) of points with rest positions (s, 3); for the other arguments see `ContactMesh`.

    Parameters
    ----------
    stitches : nodes (k, 4) of stitches, -1 for none, and (s, 3) where the points are at the start; welded : of welds
    touching : see `contact_mesh`
    rows : see `ContactMesh`; None where the points belong to no system; offsets : None for zero
    """
    s = len(points)
    triangles = np.ascontiguousarray(triangles, dtype=np.int32)
    owner = np.ascontiguousarray(owner, dtype=np.int32)
    of_rod = are_edges(triangles)
    keys = edge_keys(triangles, s)
    keys[of_rod] = keys[of_rod, :1]
    keys, side = np.unique(keys, return_inverse=True)
    edges = np.ascontiguousarray(np.column_stack(np.divmod(keys, s)).astype(np.int32))
    triangle_edges = np.ascontiguousarray(side.reshape(-1, 3).astype(np.int32))
    each = np.repeat(np.arange(len(triangles)), 3)
    a, b, c = rest[triangles].transpose(1, 0, 2)
    offsets = np.zeros(s) if offsets is None else offsets
    doubled = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    thirds = np.repeat(doubled / 6.0, 3)
    widths = (2.0 * offsets[triangles[:, 0]] * np.linalg.norm(b - a, axis=1))[of_rod]
    of_edges, of_corners = thirds.copy(), thirds.reshape(-1, 3)
    of_edges.reshape(-1, 3)[of_rod] = widths[:, None] / 9.0  # at each of the three sides, which are one edge
    of_corners[of_rod] = widths[:, None] * np.array([0.5, 0.25, 0.25])
    sided = np.repeat(~of_rod, 3)
    patches, stitched = patches_of(triangles, triangle_edges, owner, rest), None
    if stitches is not None and (len(stitches[0]) or welded is not None):
        mesh = triangles, edges, triangle_edges, patches
        stitched = stitch_filter(mesh, *stitches, owner, collide, welded, touching)
    return ContactMesh(
        points=points,
        triangles=triangles,
        edges=edges,
        triangle_edges=triangle_edges,
        edge_triangles=adjacency(triangle_edges.ravel()[sided], each[sided], len(edges)),
        vertex_triangles=adjacency(triangles.ravel(), each, s),
        neighbors=adjacency(edges.ravel(), edges[:, ::-1].ravel(), s),
        owner=owner,
        areas=np.bincount(triangles.ravel(), weights=of_corners.ravel(), minlength=s).astype(np.float64),
        edge_areas=np.bincount(triangle_edges.ravel(), weights=of_edges, minlength=len(edges)).astype(np.float64),
        edge_lengths=np.linalg.norm(rest[edges[:, 0]] - rest[edges[:, 1]], axis=1),
        body_count=body_count,
        names=names,
        collide=np.ascontiguousarray(collide),
        patches=patches,
        stitched=stitched,
        rows=np.full(s, -1, dtype=np.int32) if rows is None else rows,
        offsets=offsets,
        near_at_rest=near_at_rest((triangles, edges, triangle_edges, patches), rest, owner, offsets, collide),
    )


def intersects(mesh: ContactMesh, points: NDArray[np.float64]) -> bool:
    """Whether two triangles that may touch have a common point at `points` (s, 3).

    Common vertices do not count, and neither do seams of stitches, whose sides touch.
    """
    owner = mesh.owner[mesh.triangles[:, 0]]
    ignored = None if mesh.stitched is None else mesh.stitched.crossing
    return len(crossing_triangles(points, mesh.triangles, owner, mesh.collide, 1, ignored)[0]) > 0
