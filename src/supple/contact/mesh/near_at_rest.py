"""Pairs of a shell or a rod with itself that never collide: they are nearer at rest than its thickness.

Only what is near along it counts: parts that are joined by triangles, or edges of a rod, which are near, too. Layers
that lie on each other at rest collide.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from supple.contact.search.patch_search import PatchSearch
from supple.contact.search.patches import Parts, Patches
from supple.mesh.topology import are_edges
from supple.numerics.adjacency import Adjacency, adjacency, no_lists

# Of the thickness: pairs that are a little farther apart at rest would press on each other as soon as a shell bends.
_NEAR = 1.5

Mesh = tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32], Patches]


def near_at_rest(
    mesh: Mesh,
    rest: NDArray[np.float64],
    owner: NDArray[np.int32],
    offsets: NDArray[np.float64],
    collide: NDArray[np.bool_],
) -> tuple[Adjacency, Adjacency] | None:
    """The triangles of each point and the edges of each edge that are near; None without offsets.

    Parameters
    ----------
    mesh : triangles (f, 3), edges (e, 2), triangle_edges (f, 3), patches, see `ContactMesh`
    rest : (s, 3) [m]; owner, offsets : (s,); collide : (p, p) which owners may touch
    """
    if not offsets.any():
        return None
    triangles, edges, triangle_edges, patches = mesh
    s, f, e = len(owner), len(triangles), len(edges)
    of_points, of_edges = [np.zeros((0, 2), dtype=np.int64)], [np.zeros((0, 2), dtype=np.int64)]
    every, none = np.arange(s, dtype=np.int32), (no_lists(s), no_lists(e))
    for k in np.unique(owner[offsets > 0.0]):
        alone = np.zeros_like(collide)
        alone[k, k] = collide[k, k]
        search = PatchSearch(Parts(every, triangles, edges, alone, *none), patches)
        reach = 2.0 * _NEAR * float(offsets[owner == k].max())
        for found, out in zip(search.find(rest, np.zeros_like(rest), reach), (of_points, of_edges), strict=True):
            out.append(found.astype(np.int64))
    points, pairs = np.concatenate(of_points), np.concatenate(of_edges)
    # Triangles join at edges, edges of rods at points.
    joints = np.where(are_edges(triangles)[:, None], e + triangles, triangle_edges)
    joined_at = adjacency(joints.ravel(), np.repeat(np.arange(f), 3), e + s)
    sides = adjacency(triangle_edges.ravel(), np.repeat(np.arange(f), 3), e)
    # What each point is near to, with the triangles that have it; of edges, the triangles of edges.
    own = np.column_stack([triangles.ravel(), np.repeat(np.arange(f), 3)]).astype(np.int64)
    points = points[_are_joined(points, own, joints, joined_at, s)]
    both = np.concatenate([pairs, pairs[:, ::-1]])
    row, triangle = _expanded(both[:, 1], sides).T
    near = np.column_stack([both[row, 0], triangle])
    around = adjacency(triangles.ravel(), np.repeat(np.arange(f), 3), s)
    ends = [_expanded(edges[:, side], around) for side in (0, 1)]
    joined = np.zeros(len(both), dtype=np.bool_)
    joined[row[_are_joined(near, np.concatenate(ends), joints, joined_at, e)]] = True
    both = both[joined]
    both = np.concatenate([both, both[:, ::-1]])
    return adjacency(points[:, 0], points[:, 1], s), adjacency(both[:, 0], both[:, 1], e)


def _expanded(points: NDArray[np.integer], lists: Adjacency) -> NDArray[np.int64]:
    """(k, 2) the rows of points, each with every item of the list of its point."""
    counts = np.diff(lists.start)[points]
    row = np.repeat(np.arange(len(points)), counts)
    place = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.column_stack([row, lists.items[lists.start[points[row]] + place]]).astype(np.int64)


def _are_joined(
    near: NDArray[np.int64],
    own: NDArray[np.int64],
    joints: NDArray[np.int32],
    joined_at: Adjacency,
    count: int,
) -> NDArray[np.bool_]:
    """(k,) which of the pairs (k, 2) of things and triangles `near` them are joined to an `own` pair (m, 2) over common
    joints of triangles that are near to the same thing."""
    f = len(joints)
    codes = np.unique(np.concatenate([near, own]) @ [f, 1])
    thing, triangle = np.divmod(codes, f)
    one, other = [], []
    for k in range(3):
        expanded = _expanded(joints[triangle, k], joined_at)
        wanted = thing[expanded[:, 0]] * f + expanded[:, 1]
        at = np.minimum(np.searchsorted(codes, wanted), len(codes) - 1)
        found = codes[at] == wanted
        one.append(expanded[found, 0])
        other.append(at[found])
    first, second = np.concatenate(one), np.concatenate(other)
    graph = coo_array((np.ones(len(first), dtype=np.bool_), (first, second)), shape=(len(codes), len(codes)))
    labels = connected_components(graph, directed=False)[1]
    of_own = np.zeros(int(labels.max(initial=-1)) + 1, dtype=np.bool_)
    of_own[labels[np.searchsorted(codes, own @ [f, 1])]] = True
    return of_own[labels[np.searchsorted(codes, near @ [f, 1])]]
