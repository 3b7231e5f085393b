"""The contacts of surfaces at given positions: of vertices first, then of edges."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.contact.potentials.contacts import Contacts
from supple.contact.potentials.edge_contacts import edge_weights, write_edge_contacts
from supple.contact.potentials.vertex_contacts import grouped_minima, vertex_minima, write_vertex_contacts
from supple.contact.surface.adjacency import Adjacency
from supple.contact.surface.contact_mesh import ContactMesh
from supple.numerics.threads import threads_for

# Pairs from which a second thread pays.
_PARALLEL_FROM = 2000


class Topology(NamedTuple):
    """What kernels need of a `ContactMesh`."""

    triangles: NDArray[np.int32]
    edges: NDArray[np.int32]
    triangle_edges: NDArray[np.int32]
    edge_triangles: Adjacency
    neighbors: Adjacency


class ContactSet:
    """Finds the contacts among given pairs.

    Parameters
    ----------
    dhat : [m] contacts are nearer than this
    """

    def __init__(self, mesh: ContactMesh, dhat: float) -> None:
        self.dhat = dhat
        self._topology = Topology(
            mesh.triangles, mesh.edges, mesh.triangle_edges, mesh.edge_triangles, mesh.neighbors
        )
        self._areas = mesh.areas
        self._edge_areas = mesh.edge_areas

    def of(
        self, x: NDArray[np.float64], vertex_triangle: NDArray[np.int32], edge_edge: NDArray[np.int32]
    ) -> tuple[Contacts, float]:
        """The contacts at x (s, 3), and the smallest distance of the pairs, or infinity where none is below dhat [m].

        Parameters
        ----------
        vertex_triangle, edge_edge : (k, 2), (l, 2) all pairs that may be nearer than dhat
        """
        topology, dhat = self._topology, self.dhat
        with threads_for(len(vertex_triangle) + len(edge_edge), _PARALLEL_FROM):
            codes, squares = vertex_minima(x, vertex_triangle, topology, dhat)
            grouped = grouped_minima(vertex_triangle, codes, len(x))
            weights, edge_squares = edge_weights(x, edge_edge, topology, self._edge_areas, dhat)
            vertices = len(grouped[0])
            out = _empty(vertices + int(np.count_nonzero(weights)))
            write_vertex_contacts(x, vertex_triangle, codes, grouped, topology, self._areas, dhat, out)
        write_edge_contacts(x, edge_edge, weights, topology.edges, vertices, out)
        least = min(squares.min(initial=np.inf), edge_squares.min(initial=np.inf))
        counted = out.weights > 0.0
        if not counted.all():
            out = Contacts(*(array[counted] for array in out))
        return out, float(np.sqrt(least))


def _empty(count: int) -> Contacts:
    return Contacts(
        np.empty(count, dtype=np.int8),
        np.empty((count, 4), dtype=np.int32),
        np.empty((count, 4)),
        np.empty((count, 3)),
        np.empty(count),
        np.empty(count),
    )
