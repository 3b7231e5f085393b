"""Contacts that are none, because their two sides are stitched together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from supple.scene.stitches.masks import stitched_edges, stitched_neighbours, stitched_triangles

if TYPE_CHECKING:
    import ipctk


# Of the mean edge: what is nearer than that at the start touches.
_TOUCHING = 1e-6


@dataclass(frozen=True, eq=False)
class StitchedContacts:
    """What the library's filters cannot say: they know pairs of vertices only, and not of edges and triangles.

    Attributes
    ----------
    triangles, edges : ascending codes of pairs: triangle * s + vertex; e * (number of edges) + f, both ways round
    sizes : s, and the number of edges

    Beside what is stitched to each other, that is what touches at the start between things that are stitched, and has a
    stitched vertex: two halves sewn together face to face touch everywhere.

    without_neighbours : the collision mesh, whose filter leaves out the stitched vertices' neighbours, too. Whether
        triangles cross is asked of that one: a triangle around a stitched vertex may cross what that is stitched to.
    touches : whether something stitched touches at the start; then that cannot be asked
    """

    triangles: NDArray[np.int64]
    edges: NDArray[np.int64]
    sizes: tuple[int, int]
    without_neighbours: ipctk.CollisionMesh
    touches: bool

    @classmethod
    def of(
        cls,
        mesh: ipctk.CollisionMesh,
        nodes: NDArray[np.int32],
        owner: NDArray[np.int32],
        start: NDArray[np.float64],
    ) -> StitchedContacts | None:
        """Of stitches with nodes (k, 4) in the mesh's numbers, -1 for none; None where there are no stitches.

        Parameters
        ----------
        owner : (s,) which thing each of the mesh's vertices belongs to; start : (s, 3) where it is at the start [m]
        """
        import ipctk

        if not len(nodes):
            return None
        s, e = len(mesh.rest_positions), len(mesh.edges)
        vertices, faces = stitched_triangles(nodes, mesh.faces, s)
        one, other = stitched_edges(nodes, mesh.edges, s)
        pairs = np.sort(stitched_neighbours(nodes, mesh.edges, s), axis=1)
        tolerant = ipctk.CollisionMesh(mesh.rest_positions, mesh.edges, mesh.faces)
        apart = ipctk.make_sparse_filter({(a, b): False for a, b in pairs.tolist()}, True)
        tolerant.can_collide = mesh.can_collide & apart
        touching = _touching(mesh, nodes, owner, start)
        codes = np.concatenate([one * e + other, other * e + one, touching[1]])
        return cls(
            np.unique(np.append(faces * s + vertices, touching[0])),
            np.unique(codes),
            (s, e),
            tolerant,
            len(touching[0]) + len(touching[1]) > 0,
        )

    def drop_from(self, candidates: ipctk.Candidates) -> None:
        """Take the stitched ones out of what the broad phase has found."""
        s, e = self.sizes
        faces = candidates.fv_candidates
        codes = np.fromiter((c.face_id * s + c.vertex_id for c in faces), dtype=np.int64, count=len(faces))
        stitched = np.isin(codes, self.triangles)
        if stitched.any():
            candidates.fv_candidates = [faces[k] for k in np.flatnonzero(~stitched)]
        edges = candidates.ee_candidates
        codes = np.fromiter((c.edge0_id * e + c.edge1_id for c in edges), dtype=np.int64, count=len(edges))
        stitched = np.isin(codes, self.edges)
        if stitched.any():
            candidates.ee_candidates = [edges[k] for k in np.flatnonzero(~stitched)]


def _touching(
    mesh: ipctk.CollisionMesh, nodes: NDArray[np.int32], owner: NDArray[np.int32], start: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Codes of triangles with vertices, and of edges with edges both ways round, that touch at the start."""
    import ipctk

    ends = start[mesh.edges]
    reach = _TOUCHING * float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean())
    sewn = set(nodes[nodes >= 0].tolist())
    joined = {(owner[v], owner[w]) for v, *others in nodes.tolist() for w in others if v >= 0 and w >= 0}
    joined |= {(b, a) for a, b in joined}
    candidates = ipctk.Candidates()
    candidates.build(mesh, np.asfortranarray(start), reach)
    s, e = len(mesh.rest_positions), len(mesh.edges)

    def touch(candidate: ipctk.CollisionStencil, one: list[int], two: list[int]) -> bool:
        return (
            (owner[one[0]], owner[two[0]]) in joined
            and not sewn.isdisjoint((*one, *two))
            and candidate.compute_distance(start, mesh.edges, mesh.faces) < reach * reach
        )

    faces = [
        c.face_id * s + c.vertex_id
        for c in candidates.fv_candidates
        if touch(c, [c.vertex_id], mesh.faces[c.face_id].tolist())
    ]
    edges = [
        code
        for c in candidates.ee_candidates
        if touch(c, mesh.edges[c.edge0_id].tolist(), mesh.edges[c.edge1_id].tolist())
        for code in (c.edge0_id * e + c.edge1_id, c.edge1_id * e + c.edge0_id)
    ]
    return np.array(faces, dtype=np.int64), np.array(edges, dtype=np.int64)
