"""Contacts that are none, because their two sides are stitched together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from supple.scene.stitches.masks import stitched_edges, stitched_neighbours, stitched_triangles

if TYPE_CHECKING:
    import ipctk


@dataclass(frozen=True, eq=False)
class StitchedContacts:
    """What the library's filters cannot say: they know pairs of vertices only, and not of edges and triangles.

    Attributes
    ----------
    triangles, edges : ascending codes of pairs: triangle * s + vertex; e * (number of edges) + f, both ways round
    sizes : s, and the number of edges
    without_neighbours : the collision mesh, whose filter leaves out the stitched vertices' neighbours, too. Whether
        triangles cross is asked of that one: a triangle around a stitched vertex may cross what that is stitched to.
    """

    triangles: NDArray[np.int64]
    edges: NDArray[np.int64]
    sizes: tuple[int, int]
    without_neighbours: ipctk.CollisionMesh

    @classmethod
    def of(cls, mesh: ipctk.CollisionMesh, nodes: NDArray[np.int32]) -> StitchedContacts | None:
        """Of stitches with nodes (k, 4) in the mesh's numbers, -1 for none; None where there are no stitches."""
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
        codes = np.concatenate([one * e + other, other * e + one])
        return cls(np.unique(faces * s + vertices), np.unique(codes), (s, e), tolerant)

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
