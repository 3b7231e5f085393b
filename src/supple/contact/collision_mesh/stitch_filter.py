"""Excludes contacts between parts that are stitched to each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from supple.scene.stitches.masks import stitched_crossings, stitched_edges, stitched_triangles

if TYPE_CHECKING:
    import ipctk


# Parts that are nearer than this share of the mean edge at the start touch.
_TOUCHING = 1e-6


@dataclass(frozen=True, eq=False)
class StitchFilter:
    """Pairs that the library's own filters cannot exclude: those filters know pairs of vertices only.

    Excluded are pairs that are stitched to each other. Excluded are also pairs with a stitched vertex that touch at the
    start, between things that are stitched to each other: halves stitched face to face touch everywhere.

    Attributes
    ----------
    triangles, edges : ascending codes of pairs: triangle * s + vertex; e * (number of edges) + f, in both orders
    sizes : s, and the number of edges
    crossing : ascending codes t * (number of triangles) + u, t < u, of pairs of triangles that may cross: triangles
        around a stitched vertex with its partner, and triangles whose parts touch at the start as above
    """

    triangles: NDArray[np.int64]
    edges: NDArray[np.int64]
    sizes: tuple[int, int]
    crossing: NDArray[np.int64]

    @classmethod
    def of(
        cls,
        mesh: ipctk.CollisionMesh,
        nodes: NDArray[np.int32],
        owner: NDArray[np.int32],
        start: NDArray[np.float64],
    ) -> StitchFilter | None:
        """Of stitches with nodes (k, 4) in the mesh's numbers, -1 for none; None where there are no stitches.

        Parameters
        ----------
        owner : (s,) which thing each of the mesh's vertices belongs to; start : (s, 3) where it is at the start [m]
        """
        if not len(nodes):
            return None
        s, e = len(mesh.rest_positions), len(mesh.edges)
        vertices, faces = stitched_triangles(nodes, mesh.faces, s)
        one, other = stitched_edges(nodes, mesh.edges, s)
        near_triangles, near_edges = _touching(mesh, nodes, owner, start)
        triangles = np.unique(np.append(faces * s + vertices, near_triangles))
        edges = np.unique(np.concatenate([one * e + other, other * e + one, near_edges]))
        pairs = stitched_crossings(nodes, mesh.faces, s) + _crossings(mesh, near_triangles, near_edges)
        t, u = pairs.nonzero()
        crossing = np.unique(np.minimum(t, u).astype(np.int64) * len(mesh.faces) + np.maximum(t, u))
        return cls(triangles, edges, (s, e), crossing)

    def exclude(self, pairs: NDArray[np.int64], count: int) -> NDArray[np.int64]:
        """Those of the pairs (k, 2) of `count` triangles that must stay apart."""
        codes = pairs.min(axis=1) * count + pairs.max(axis=1)
        return pairs[~np.isin(codes, self.crossing)]

    def drop_from(self, candidates: ipctk.Candidates) -> None:
        """Remove excluded pairs from the result of the broad phase."""
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


def _crossings(mesh: ipctk.CollisionMesh, triangles: NDArray[np.int64], edges: NDArray[np.int64]) -> csr_array:
    """(t, t) non-zero for pairs of triangles to which a code of triangle and vertex, or of two edges, belongs."""
    s, e, f = len(mesh.rest_positions), len(mesh.edges), len(mesh.faces)

    def incidence(rows: NDArray[np.integer], columns: NDArray[np.integer], shape: tuple[int, int]) -> csr_array:
        return csr_array((np.ones(len(rows), dtype=np.int32), (rows, columns)), shape=shape)

    corners = incidence(np.repeat(np.arange(f), 3), mesh.faces.ravel(), (f, s))
    sides = incidence(np.repeat(np.arange(f), 3), mesh.faces_to_edges.ravel(), (f, e))
    near = incidence(*np.divmod(triangles, s), (f, s)) @ corners.T
    return near + sides @ incidence(*np.divmod(edges, e), (e, e)) @ sides.T


def _touching(
    mesh: ipctk.CollisionMesh, nodes: NDArray[np.int32], owner: NDArray[np.int32], start: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Codes of triangles with vertices, and of edges with edges both ways round, that touch at the start."""
    import ipctk

    ends = start[mesh.edges]
    reach = _TOUCHING * float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean())
    stitched = set(nodes[nodes >= 0].tolist())
    joined = {(owner[v], owner[w]) for v, *others in nodes.tolist() for w in others if v >= 0 and w >= 0}
    joined |= {(b, a) for a, b in joined}
    candidates = ipctk.Candidates()
    candidates.build(mesh, np.asfortranarray(start), reach)
    s, e = len(mesh.rest_positions), len(mesh.edges)

    def touch(candidate: ipctk.CollisionStencil, one: list[int], two: list[int]) -> bool:
        return (
            (owner[one[0]], owner[two[0]]) in joined
            and not stitched.isdisjoint((*one, *two))
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
