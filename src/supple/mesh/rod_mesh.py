"""The points and edges of a rod, and the material points that carry its twist, under the names of a tet mesh."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from supple.errors import MeshError
from supple.mesh.checked_arrays import frozen, index_array, place, vertex_array
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.mesh.topology import is_used

# An edge has no direction where round-off of its ends turns it.
_SHORT = 1e-9


class RodMesh(TetMesh):
    """A `TetMesh` without tets: n points, then two material points of each of e edges.

    The material points of an edge lie opposite each other on the rod's surface, beside its middle, along one line of
    the rod: from edge to edge they are turned as little as possible.

    Parameters
    ----------
    points : (n, 3) [m]; edges : (e, 2) rows of `points`, None to join each with the next
    radius : of the rod [m]

    Attributes
    ----------
    line : (e, 2) the edges; material_points : (e, 2) rows of `vertices`
    surface : the edges as triangles whose last two corners are the same

    Raises
    ------
    MeshError : naming the point or edge at fault.
    """

    line: NDArray[np.int32]
    material_points: NDArray[np.int32]
    radius: float

    _arguments: ClassVar[dict[str, str]] = {"points": "points", "edges": "line", "radius": "radius"}

    def __init__(self, points: ArrayLike, edges: ArrayLike | None, radius: float) -> None:
        given = vertex_array(points, "points")
        n = len(given)
        if edges is None and n < 2:
            raise MeshError("it has one point; give two or more")
        steps = np.column_stack([np.arange(n - 1), np.arange(1, n)]) if edges is None else edges
        line = index_array(steps, 2, n, "edges", "edge")
        _check(given, line)
        directors = radius * _transported(given, line)
        middles = given[line].mean(axis=1)
        vertices = np.concatenate([given, np.stack([middles + directors, middles - directors], axis=1).reshape(-1, 3)])
        rows = np.arange(n, len(vertices), dtype=np.int32).reshape(-1, 2)
        none = frozen(np.zeros((0, 4), dtype=np.int32))
        surface = SurfaceMesh(vertices, line[:, [0, 1, 1]], shares_vertices=True)
        made = {"vertices": frozen(vertices), "tets": none, "nodes": none, "reoriented": 0, "_surface": surface}
        made |= {"line": line, "material_points": frozen(rows), "points": given, "radius": radius}
        for key, value in made.items():
            object.__setattr__(self, key, value)

    @property
    def surface(self) -> SurfaceMesh:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.__dict__["_surface"]

    @property
    def edges(self) -> NDArray[np.int32]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """(3 e, 2) of the line, then from the first end of each to its material points."""
        spokes = np.stack(np.broadcast_arrays(self.line[:, :1], self.material_points), axis=2)
        return np.concatenate([self.line, spokes.reshape(-1, 2)])


def _check(points: NDArray[np.float64], line: NDArray[np.int32]) -> None:
    a, b = points[line].transpose(1, 0, 2)
    short = np.linalg.norm(b - a, axis=1) <= _SHORT * np.abs(points[line]).max(axis=(1, 2))
    if short.any():
        row = int(np.flatnonzero(short)[0])
        i, j = line[row].tolist()
        raise MeshError(f"points {i} and {j} at {place(points[i])} of edge {row} are the same; remove one of them")
    keys = np.sort(line, axis=1) @ np.array([len(points), 1])
    if len(np.unique(keys)) < len(keys):
        order = np.argsort(keys, kind="stable")
        row = int(order[1:][keys[order][1:] == keys[order][:-1]][0])
        raise MeshError(f"edge {row} of points {line[row, 0]} and {line[row, 1]} is given twice; remove it")
    unused = np.flatnonzero(~is_used(line, len(points)))
    if len(unused):
        raise MeshError(f"point {unused[0]} at {place(points[unused[0]])} belongs to no edge; remove it, or join it")


def _transported(points: NDArray[np.float64], line: NDArray[np.int32]) -> NDArray[np.float64]:
    """(e, 3) unit vectors normal to edges, each turned from that of an edge before it as the edges turn."""
    e = len(line)
    t = points[line[:, 1]] - points[line[:, 0]]
    t /= np.linalg.norm(t, axis=1)[:, None]
    shared = coo_array((np.ones(2 * e), (np.repeat(np.arange(e), 2), line.ravel())), shape=(e, len(points))).tocsr()
    graph = shared @ shared.T
    pieces, labels = connected_components(graph, directed=False)
    out = np.empty((e, 3))
    for piece in range(pieces):
        first = int(np.flatnonzero(labels == piece)[0])
        order, before = breadth_first_order(graph, first, directed=False)
        across = np.eye(3)[np.argmin(np.abs(t[first]))]
        out[first] = across - (across @ t[first]) * t[first]
        for row in order[1:]:
            other = before[row]
            along, turned = t[other], out[other]
            # Where edges run against each other, the direction of one is reversed, and its director stays.
            meets_at_ends = (line[row] == line[other]).any()
            out[row] = _turned(turned, -along if meets_at_ends else along, t[row])
    return out / np.linalg.norm(out, axis=1)[:, None]


def _turned(d: NDArray[np.float64], a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """The vector d, normal to the unit vector a, turned by the least rotation that takes a to b."""
    cosine = float(a @ b)
    if cosine <= -1.0 + 1e-12:  # any half turn about a normal of a: that about d
        return d
    turned = d - (d @ b) / (1.0 + cosine) * (a + b)
    return turned / np.linalg.norm(turned)
