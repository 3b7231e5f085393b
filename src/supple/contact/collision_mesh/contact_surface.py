"""The surfaces that may touch, as a collision mesh of the contact library."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix, coo_matrix, csc_matrix, csr_matrix, identity, kron

from supple.contact.collision_mesh.quad_split import split_quads
from supple.contact.collision_mesh.stitch_filter import StitchFilter
from supple.contact.obstacle_vertices import ObstacleRange
from supple.numerics.sparse.couplings import Couplings
from supple.system import System

if TYPE_CHECKING:
    import ipctk


@dataclass(frozen=True, eq=False)
class ContactSurface:
    """Surface triangles of bodies and obstacles (half-spaces aside) as one collision mesh.

    Attributes
    ----------
    mesh : the collision mesh, in numbers of its own: first vertices of the solver, then middles
    vertices : (s,) the solver's vertex of each of the mesh's first, ascending
    middles : (k, 2) which of those each of the further points lies between (see `split_quads`)
    owner : (s + k,) number of the body, or len(bodies) + number of the obstacle, of each point
    areas : (s,) a third of the adjacent triangles' area at rest [m^2]
    body_count : how many of the owners are bodies; names : of all owners
    collide : (p, p) which owners may touch
    stitched : pairs that do not collide because they are stitched to each other
    """

    mesh: ipctk.CollisionMesh
    vertices: NDArray[np.int32]
    middles: NDArray[np.int32]
    owner: NDArray[np.int32]
    areas: NDArray[np.float64]
    body_count: int
    names: tuple[str, ...]
    collide: NDArray[np.bool_]
    stitched: StitchFilter | None

    def points(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points of the mesh, or displacements, from those of all vertices x (n, 3), in the library's memory layout."""
        own = x[self.vertices]
        if len(self.middles):
            own = np.concatenate([own, 0.5 * (own[self.middles[:, 0]] + own[self.middles[:, 1]])])
        return np.asfortranarray(own)

    def add_gradient(self, gradient: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        """Add one by the mesh's points (3 (s + k),) to the rows of `out` (n, 3)."""
        rows = gradient.reshape(-1, 3)
        s = len(self.vertices)
        out[self.vertices] += rows[:s]
        for ends in self.middles.T:
            np.add.at(out, self.vertices[ends], 0.5 * rows[s:])

    def couplings(self, hessian: csc_matrix) -> Couplings:
        """A symmetric matrix by the mesh's points (3 (s + k), 3 (s + k)) in the solver's vertices."""
        size = 3 * len(self.vertices)
        if len(self.middles):
            hessian = self.weights.T @ hessian @ self.weights
        # The columns of a symmetric matrix, read as its rows.
        by_rows = csr_matrix((hessian.data, hessian.indices, hessian.indptr), shape=hessian.shape)
        blocks: Any = bsr_matrix(by_rows, blocksize=(3, 3), shape=(size, size))
        rows = np.repeat(np.arange(len(self.vertices)), np.diff(blocks.indptr))
        once = blocks.indices >= rows
        return Couplings(self.vertices[rows[once]], self.vertices[blocks.indices[once]], blocks.data[once])

    @cached_property
    def weights(self) -> csc_matrix:
        """(3 (s + k), 3 s) the mesh's coordinates from those of its first vertices."""
        s, k = len(self.vertices), len(self.middles)
        rows = np.concatenate([np.arange(s), np.repeat(np.arange(s, s + k), 2)])
        columns = np.concatenate([np.arange(s), self.middles.ravel()])
        values = np.concatenate([np.ones(s), np.full(2 * k, 0.5)])
        return csc_matrix(kron(coo_matrix((values, (rows, columns)), shape=(s + k, s)), identity(3)))


def contact_surface(
    system: System,
    obstacles: tuple[ObstacleRange, ...],
    collide: NDArray[np.bool_],
    start: NDArray[np.float64],
) -> ContactSurface:
    """Join the surfaces of a system whose obstacles are vertices (see `with_obstacles`).

    Parameters
    ----------
    collide : (p, p) which owners may touch, bodies before obstacles
    start : (n, 3) where everything is at the start [m]
    """
    import ipctk

    parts = [system.triangles] + [part.triangles for part in obstacles if not part.is_plane]
    triangles = np.concatenate(parts)
    vertices = np.unique(triangles).astype(np.int32)
    number = np.full(len(system.rest_positions), -1, dtype=np.int32)
    number[vertices] = np.arange(len(vertices), dtype=np.int32)
    owner_of = np.full(len(system.rest_positions), -1, dtype=np.int32)
    for k, part in enumerate(system.bodies):
        owner_of[part.vertices] = k
    for part in obstacles:
        owner_of[part.vertices] = len(system.bodies) + part.index
    owner = owner_of[vertices]
    faces = number[triangles]
    rest = system.rest_positions[vertices]
    corners = rest[faces]
    doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    areas = np.bincount(faces.ravel(order="C"), weights=np.repeat(doubled / 6.0, 3), minlength=len(vertices))
    middles = np.zeros((0, 2), dtype=np.int32)
    if not len(system.stitching):  # stitches name vertices, edges and triangles of the bodies' own meshes
        faces, middles = split_quads(rest, faces, owner)
        rest = np.concatenate([rest, rest[middles].mean(axis=1)])
        owner = np.concatenate([owner, owner[middles[:, 0]]])
    faces = np.asfortranarray(faces, dtype=np.int32)
    mesh = ipctk.CollisionMesh(np.asfortranarray(rest), ipctk.edges(faces), faces)
    mesh.can_collide = _filter(owner, len(system.bodies), collide)
    nodes = np.append(number, -1)[system.stitching.nodes()]
    stitched = StitchFilter.of(mesh, nodes, owner, np.asfortranarray(start[vertices]))
    names = tuple(part.name for part in system.bodies) + tuple(str(o.name) for o in system.obstacles)
    return ContactSurface(
        mesh, vertices, middles, owner, areas.astype(np.float64), len(system.bodies), names, collide, stitched
    )


def _filter(owner: NDArray[np.int32], body_count: int, collide: NDArray[np.bool_]) -> ipctk.CollisionFilter:
    """Which vertices may touch, built from the library's own filters: it calls them from several threads at once."""
    import ipctk

    other_owner = ipctk.make_vertex_patches_filter(owner)
    allowed = _apart(owner >= body_count)
    present = np.unique(owner)
    for i, a in enumerate(present[present < body_count]):
        for b in present[i:]:
            if not collide[a, b]:
                apart = _apart((owner == a) | (owner == b))
                allowed = allowed & (apart if a == b else apart | ~other_owner)
    return allowed


def _apart(group: NDArray[np.bool_]) -> ipctk.CollisionFilter:
    """Rejects pairs of which both are in the group."""
    import ipctk

    patch = np.arange(len(group), dtype=np.int32) + 1
    patch[group] = 0
    return ipctk.make_vertex_patches_filter(patch)
