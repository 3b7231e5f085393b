"""The surfaces of a scene on the nodes of the solver.

Nodes are the rows of the solver's arrays: the vertices, then the anchors of stitches, then the vertices of obstacles
that have triangles. Everything that touches is a node, so that one kernel serves bodies and obstacles. Nodes that are
held or follow a script have the inverse mass zero.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.contact_mesh import ContactMesh, contact_mesh
from supple.contact.mesh.obstacles import ObstacleRange, with_obstacles
from supple.contact.search.patches import Parts, Patches
from supple.model.system import System
from supple.numerics.adjacency import Adjacency, adjacency, only
from supple.numerics.cross_rows import cross_rows
from supple.scene.contact_pairs import pair_table
from supple.scene.shell import Shell
from supple.solvers.xpbd.contact.search.gaps import SHARE, point_gaps
from supple.solvers.xpbd.contact.settings import XPBDContact, colliding_pairs
from supple.solvers.xpbd.rigid.bodies import RigidBodies

# The sine of the angle of an edge that counts as flat: its way out of the face is far below the kept distances.
FLAT = 1e-6


class Simplices(NamedTuple):
    """The parts of the surface, as kernels take them.

    Attributes
    ----------
    nodes : (s,) the node of each point; triangles : (f, 3), edges : (e, 2) nodes
    owner : (N,) the body or obstacle of each node, -1 for nodes that are on no surface
    collide : (p, p) which owners may touch; friction : (p, p)
    gaps : (N,) the distances that are kept, of a pair the smallest of its nodes [m]
    offsets : (N,) half of a shell's thickness, or 0: both sides' are added to the distance of a pair [m]
    rest : (N, 3) places at rest [m]
    around : the triangles at each node
    first : (f, 6) whether a triangle is the first of those with its corner j, and with the side across from it
    """

    nodes: NDArray[np.int32]
    triangles: NDArray[np.int32]
    edges: NDArray[np.int32]
    owner: NDArray[np.int32]
    collide: NDArray[np.bool_]
    friction: NDArray[np.float64]
    gaps: NDArray[np.float64]
    offsets: NDArray[np.float64]
    rest: NDArray[np.float64]
    around: Adjacency
    first: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class RowSurface:
    """What may touch in a scene.

    Attributes
    ----------
    parts : the same arrays as a search takes them; patches : of them, without edges and points in flat rigid faces
    closed : (p,) which things have a closed surface with an inside
    count : number of nodes; first : the first node of obstacles
    anchors : (o, 3) of the obstacles' nodes at time 0 [m]; of_anchor : (o,) their obstacle
    body : (N,) the rigid body of each node, or -1; points : (N,) the point of the system that it is, or -1
    embedded : nodes on rigid bodies, the last ones, by their control
        points (k, 4) and weights (k, 4)
    """

    simplices: Simplices
    parts: Parts
    patches: Patches
    closed: NDArray[np.bool_]
    count: int
    first: int
    anchors: NDArray[np.float64]
    of_anchor: NDArray[np.int64]
    edge_length: float
    body: NDArray[np.int32]
    points: NDArray[np.int32]
    embedded: tuple[NDArray[np.int32], NDArray[np.float64]]


def row_surface(
    system: System,
    rigid: RigidBodies,
    anchors: int,
    settings: XPBDContact | None,
) -> RowSurface:
    """The surfaces of a system in the solver's numbering, whose arrays have rows for `anchors` after the vertices.

    Stitched points and what touches them at the start do not collide.
    """
    n, edge_length = len(system.masses), mean_edge_length(system)
    thickness = settings.thickness if settings is not None else None
    extended, ranges = with_obstacles(system)
    solid = tuple(part for part in ranges if part.obstacle.contact_mesh is not None)
    collide = colliding_pairs(system, settings, joined=True)
    placed = [part.body.place(system.rest_positions[part.vertices]) for part in system.bodies]
    rest = [system.rest_positions[sum(map(len, placed)) :], extended.rest_positions[len(system.rest_positions) :]]
    mesh = contact_mesh(extended, solid, collide, np.concatenate([*placed, *rest]), thickness)
    single = mesh.points.single
    # The obstacles' nodes are numbered by their range; obstacles without triangles have none.
    node_of = np.full(len(extended.masses), -1, dtype=np.int32)
    node_of[:n] = np.arange(n)
    count = n + anchors
    for part in solid:
        node_of[part.vertices] = np.arange(count, count + len(part.vertices))
        count += len(part.vertices)
    first_embedded, inside = count, np.flatnonzero(single < 0)
    count += len(inside)
    embedded = mesh.points.taken(inside)
    control, weights = embedded.vertices.reshape(-1, 4), embedded.weights.reshape(-1, 4)
    nodes = np.where(single >= 0, node_of[single], 0).astype(np.int32)
    nodes[inside] = np.arange(first_embedded, count)
    owner = np.full(count, -1, dtype=np.int32)
    owner[nodes] = mesh.owner
    rest = np.zeros((count, 3))
    rest[nodes] = mesh.points.positions(extended.rest_positions)
    body = np.full(count, -1, dtype=np.int32)
    body[:n] = np.where(rigid.of_vertex >= 0, rigid.of_vertex, rigid.welded_to)
    body[first_embedded:] = rigid.of_vertex[control[:, 0]]
    points = np.full(count, -1, dtype=np.int32)
    points[nodes] = mesh.rows
    offsets = np.zeros(count)
    offsets[nodes] = mesh.offsets
    simplices = Simplices(
        nodes,
        np.ascontiguousarray(nodes[mesh.triangles]),
        np.ascontiguousarray(nodes[mesh.edges]),
        owner,
        np.ascontiguousarray(mesh.collide),
        np.ascontiguousarray(pair_table(system.scene).friction),
        _gaps(mesh, system, rest, nodes, thickness),
        offsets,
        rest,
        adjacency(nodes[mesh.triangles].ravel(), np.repeat(np.arange(len(mesh.triangles)), 3), count),
        _is_first(mesh),
    )
    closed = np.ones(len(collide), dtype=np.bool_)
    closed[mesh.owner[mesh.edges[np.diff(mesh.edge_triangles.start) != 2, 0]]] = False
    closed[: len(system.bodies)] &= [not isinstance(part.body, Shell) for part in system.bodies]  # no inside
    # What is near along a shell is kept apart here without a push, see `describe_pairs`.
    excluded = replace(mesh, near_at_rest=None).excluded
    return RowSurface(
        simplices,
        Parts(nodes, simplices.triangles, simplices.edges, simplices.collide, *excluded),
        _without_flat(mesh, rest[nodes], system),
        closed,
        count,
        n + anchors,
        np.concatenate([np.zeros((0, 3)), *(part.anchors for part in solid)]),
        _numbers(solid),
        edge_length,
        body,
        points,
        (np.ascontiguousarray(control), np.ascontiguousarray(weights)),
    )


def _without_flat(mesh: ContactMesh, x: NDArray[np.float64], system: System) -> Patches:
    """The patches without the edges in flat faces of what does not deform, and without points that have no others.

    Where such a face comes nearest to something, it does so at a point of that, or at its own outline.

    x : (s, 3) places of the points at rest [m]
    """
    rigid = np.ones(len(mesh.names), dtype=np.bool_)
    rigid[: mesh.body_count] = [part.rigid for part in system.bodies]
    around = mesh.edge_triangles
    two = np.flatnonzero(rigid[mesh.owner[mesh.edges[:, 0]]] & (np.diff(around.start) == 2))
    a, b, c = x[mesh.triangles].transpose(1, 0, 2)
    normals = cross_rows(b - a, c - a)
    one, other = normals[around.items[around.start[two]]], normals[around.items[around.start[two] + 1]]
    sines, cosines = np.linalg.norm(cross_rows(one, other), axis=1), np.einsum("ij,ij->i", one, other)
    flat = np.zeros(len(mesh.edges), dtype=np.bool_)
    flat[two] = sines < FLAT * cosines
    kept = np.zeros(len(mesh.owner), dtype=np.bool_)
    kept[mesh.edges[~flat]] = True
    patches = mesh.patches
    return patches._replace(edges=only(patches.edges, ~flat), points=only(patches.points, kept))


def _gaps(
    mesh: ContactMesh,
    system: System,
    rest: NDArray[np.float64],
    nodes: NDArray[np.int32],
    thickness: float | None,
) -> NDArray[np.float64]:
    """(N,) the gap of each node [m]; inside of a body the smallest of its surface."""
    if thickness is not None:
        return np.full(len(rest), thickness)
    of_points, gaps = point_gaps(mesh, rest[nodes]), np.full(len(rest), np.inf)
    of_points = np.where(mesh.offsets > 0.0, np.minimum(of_points, 2.0 * SHARE * mesh.offsets), of_points)
    for k, part in enumerate(system.bodies):
        gaps[part.vertices] = of_points[mesh.owner == k].min(initial=np.inf)
    gaps[nodes] = of_points
    return gaps


def mean_edge_length(system: System) -> float:
    """Mean edge length of all the bodies' surfaces at rest [m]."""
    a, b, c = system.rest_points[system.triangles].transpose(1, 0, 2)
    lengths = np.array([np.linalg.norm(one - other, axis=1) for one, other in ((a, b), (b, c), (c, a))])
    # An edge of a rod is a triangle with one corner twice.
    return float(np.mean(lengths if lengths.all() else lengths[lengths > 0.0]))


def _is_first(mesh: ContactMesh) -> NDArray[np.bool_]:
    """See `Simplices.first`."""
    out = np.zeros((len(mesh.triangles), 6), dtype=np.bool_)
    for column, parts in ((0, mesh.triangles), (3, mesh.triangle_edges)):
        order = np.unique(parts.ravel(), return_index=True)[1]
        out[order // 3, column + order % 3] = True
    return out


def _numbers(ranges: tuple[ObstacleRange, ...]) -> NDArray[np.int64]:
    return np.concatenate([np.zeros(0, dtype=np.int64), *(np.full(len(part.vertices), part.index) for part in ranges)])
