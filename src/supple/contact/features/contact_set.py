"""The contacts of surfaces at given positions: of vertices first, then of edges."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.contact.features.contacts import Contacts, KnownWeights
from supple.contact.features.edge_contacts import edge_weights, write_edge_contacts
from supple.contact.features.vertex_contacts import REACH, write_vertex_contacts
from supple.contact.features.vertex_features import alternating_sums, grouped, near_features
from supple.contact.mesh.contact_mesh import ContactMesh


class Found(NamedTuple):
    """What `contacts_at` has found.

    Attributes
    ----------
    contacts : those with a weight
    least : the smallest gap of the pairs, infinite where none is below `REACH` dhat [m]
    new : what is to be known where the search goes on, in any order
    planes : codes of the pairs that may count with a plane, for `KnownWeights`
    """

    contacts: Contacts
    least: float
    new: KnownWeights
    planes: NDArray[np.int64]


def contacts_at(
    x: NDArray[np.float64],
    mesh: ContactMesh,
    vertex_triangle: NDArray[np.int32],
    edge_edge: NDArray[np.int32],
    known: KnownWeights,
    dhat: float,
) -> Found:
    """The contacts of a mesh at x (s, 3) with gaps below dhat [m].

    Parameters
    ----------
    vertex_triangle, edge_edge : (k, 2), (l, 2) all pairs whose gaps may be below `REACH` dhat
    known : the weights that do not depend on x
    """
    if not len(vertex_triangle) and not len(edge_edge):
        return _NOTHING
    triangles, edges, reach = mesh.triangles, mesh.edges, REACH * dhat
    of_sums = triangles, edges, mesh.triangle_edges, *mesh.vertex_triangles, mesh.owner, mesh.offsets
    features, squares = near_features(
        x, vertex_triangle, triangles, mesh.triangle_edges, len(edges), reach, mesh.offsets
    )
    areas, edge_squares, edge_keys, edges_grown = edge_weights(
        x, edge_edge, (triangles, edges, *mesh.edge_triangles, mesh.offsets), mesh.edge_areas, dhat, known
    )
    rows, start = grouped(vertex_triangle, features, triangles, mesh.owner)
    codes, signs, counts, shares = alternating_sums(
        x, vertex_triangle, features, squares, rows, start, of_sums, known, reach
    )
    starts = np.column_stack([start, np.append(0, np.cumsum(counts))])
    count = int(starts[-1, 1])
    crossing = np.flatnonzero(areas)
    out = Contacts.room(count + 2 * len(crossing))
    saddles = write_edge_contacts(x, edge_edge, crossing, areas, edges, mesh.offsets, count, out)
    new = KnownWeights(np.empty(count, np.int64), np.empty(count), np.empty(count, np.int32))
    groups, around = (rows, starts, codes, signs, shares), (triangles, edges, *mesh.neighbors)
    surface = mesh.owner, mesh.areas, mesh.offsets, saddles
    write_vertex_contacts(x, vertex_triangle, groups, around, surface, dhat, known, out, new)
    least = min(squares.min(initial=np.inf), edge_squares.min(initial=np.inf))
    planes = new.codes[new.triangles >= 0]
    of_edges = KnownWeights(edge_keys, edges_grown, np.full(len(edge_keys), -1, np.int32))
    new = new.with_weights().with_more(of_edges.with_weights())
    counted = (out.weights != 0.0) & (out.gaps < dhat)
    if not counted.all():
        out = out.where(counted)
    return Found(out, math.copysign(math.sqrt(abs(least)), least), new, planes)


_NOTHING = Found(Contacts.room(0), np.inf, KnownWeights.none(), np.zeros(0, dtype=np.int64))
