"""A tetrahedral mesh: the rest shape of a soft body."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import MeshError
from supple.mesh.checked_arrays import frozen, index_array, place, vertex_array
from supple.mesh.io.mesh_files import TetFile, read_contents, tet_file_of, write_tets
from supple.mesh.io.tetgen_family import is_tetgen_path, write_tetgen_family
from supple.mesh.origin import with_origin
from supple.mesh.quadratic import (
    check_middle_nodes,
    check_positive,
    facet_quarters,
    half_edges,
    reoriented_nodes,
    volumes_of,
    with_middle_nodes,
)
from supple.mesh.quality import min_dihedrals, radius_ratios
from supple.mesh.sets import MeshSets, sets_of
from supple.mesh.surface import SurfaceMesh, linear_map
from supple.mesh.topology import (
    TET_EDGES,
    TET_FACETS,
    Components,
    connected_components,
    has_vertex_twice,
    is_used,
    tet_neighbours,
    unique_edges,
    without_unused,
)
from supple.runtime.displayed import Showable, extent

logger = logging.getLogger(__name__)

# A determinant is wrong by a few units of round-off of its largest terms; below this many its sign is unknown.
ROUND_OFF_UNITS = 64.0


@dataclass(frozen=True, eq=False, repr=False)
class TetMesh(Showable):
    """Tetrahedra in space, each with det[x1-x0, x2-x0, x3-x0] > 0.

    Tets given with the other winding are reoriented by swapping their last two vertices; `reoriented` is their number.

    Quadratic tets have ten nodes: the four corners, and one on each of the edges (0, 1), (1, 2), (0, 2), (0, 3),
    (1, 3), (2, 3), in this order, that of VTK. Their edges and sides may be curved. The determinant of the map
    from a straight tet must be positive everywhere in each; its Bernstein coefficients prove that.

    A tet is rejected as flat when its thickness |det| / L^2, with L its longest edge, is at most 64 eps times the
    larger of L and its largest coordinate (eps = 2.2e-16): then round-off alone decides its sign.

    Parameters
    ----------
    vertices : (n, 3) float [m], each used by some tet (`TetMesh.dropping_unused` drops the others)
    tets : (m, 4) int, rows of `vertices`; (m, 10) for quadratic tets

    Attributes
    ----------
    tets : (m, 4) the corners, rows of `vertices`
    nodes : (m, 4), or (m, 10) of quadratic tets
    order : 1, or 2 of quadratic tets
    reoriented : int
        Number of tets that were given with negative winding.

    Raises
    ------
    MeshError : naming the vertex, tet or facet at fault: not finite, out of range, repeated, flat, given twice,
        in no tet, or shared by more than two tets. Of quadratic tets also the edge with two middle nodes, the node
        on two edges, and the tet whose determinant is not positive everywhere.
    """

    vertices: NDArray[np.float64]
    tets: NDArray[np.int32]
    nodes: NDArray[np.int32]
    reoriented: int

    _arguments: ClassVar[dict[str, str]] = {"vertices": "vertices", "tets": "nodes"}  # see `supple.kinds.codec`

    def __init__(self, vertices: ArrayLike, tets: ArrayLike) -> None:
        points = vertex_array(vertices, "TetMesh")
        given = index_array(tets, _width(tets), len(points), "TetMesh", "tet")
        _check_repeated_corners(given)
        negative = _negative_winding(points, given[:, :4])
        nodes = reoriented_nodes(given, negative)
        corners = np.ascontiguousarray(nodes[:, :4])
        _check_unused(points, nodes)
        _check_duplicates(corners, len(points))
        object.__setattr__(self, "vertices", points)
        object.__setattr__(self, "tets", frozen(corners))
        object.__setattr__(self, "nodes", self.tets if nodes.shape[1] == 4 else frozen(nodes))
        object.__setattr__(self, "reoriented", int(np.count_nonzero(negative)))
        _ = self.adjacency  # raises for facets that three or more tets share
        if self.order == 2:
            check_middle_nodes(nodes, len(points))
            check_positive(points, nodes)

    def _facts(self) -> dict[str, str]:
        return {
            "vertices": str(len(self.vertices)),
            "quadratic tets" if self.order == 2 else "tets": str(len(self.tets)),
            "size": extent(self.vertices),
            "volume": f"{self.volume:.4g} m^3",
        }

    @property
    def order(self) -> int:
        """1 of linear tets, 2 of quadratic ones."""
        return 1 if self.nodes.shape[1] == 4 else 2

    def to_order(self, order: int) -> TetMesh:
        """The mesh with linear or quadratic tets; `self` where it has these.

        From 1 to 2 a node is added in the middle of each edge, after the vertices that exist. From 2 to 1 only the
        corners are kept, in their order, so that curved sides become straight.

        Raises
        ------
        MeshError : for another order than 1 and 2.
        """
        if order not in (1, 2) or isinstance(order, bool):
            raise MeshError(f"TetMesh.to_order: order is {order!r}; give 1 for linear tets or 2 for quadratic ones")
        if order == self.order:
            return self
        if order == 1:
            return TetMesh(*without_unused(self.vertices, self.tets))
        return TetMesh(*with_middle_nodes(self.vertices, self.tets, self.edges))

    @classmethod
    def dropping_unused(cls, vertices: ArrayLike, tets: ArrayLike) -> TetMesh:
        """A `TetMesh` of the vertices that some tet uses, in their order; the log gives the number of the others."""
        points = vertex_array(vertices, "TetMesh")
        given = index_array(tets, _width(tets), len(points), "TetMesh", "tet")
        kept, renumbered = without_unused(points, given)
        if len(kept) < len(points):
            logger.warning("dropped %d of %d vertices that belong to no tet", len(points) - len(kept), len(points))
        return cls(kept, renumbered)

    @classmethod
    def load(cls, path: str | Path, *, keep_axes: bool = False) -> TetMesh:
        """Read a tet mesh from TetGen's .node/.ele/.edge/.face, Gmsh .msh, .vtu, .vtk, Abaqus's .inp, Medit's .mesh or
        USD's .usd, .usda or .usdc (the extra `usd`), by the extension, or by what the file holds where that differs.

        Tets of ten nodes stay quadratic; of TetGen's only the corners are used. Hexahedra, wedges, pyramids and voxels
        are split into tets that fit those of their neighbours: by the numbers of their corners (Dompierre et al. 1999).
        Vertices that belong to no tet are dropped, and negative tets are reoriented; the log says so.

        Parameters
        ----------
        keep_axes : whether the coordinates stay those of a file of USD whose z axis points up, which otherwise becomes
            y

        Raises
        ------
        MeshError : where the file is missing, malformed, of another kind, or has no usable tets; the text starts
            with the path.
        """
        return with_origin(cls.of_file(tet_file_of(read_contents(path, keep_axes=keep_axes))), path)

    @classmethod
    def of_file(cls, file: TetFile) -> TetMesh:
        """The mesh of what a file holds; see `load`."""
        source = file.source
        try:
            mesh = cls.dropping_unused(file.points, file.tets)
        except MeshError as error:
            raise MeshError(f"{source}: {str(error).removeprefix('TetMesh: ')} (counted from 0)") from None
        if mesh.reoriented:
            logger.info(
                "%s: %d of %d tets had negative winding and were reoriented", source, mesh.reoriented, len(mesh.tets)
            )
        return mesh._with_sets(sets_of(file))

    def save(self, path: str | Path) -> None:
        """Write the mesh as TetGen's four files (.node, .ele, .edge or .face), .msh, .vtu, .vtk, .inp, .usd, .usda or
        .usdc, by the extension. USD keeps coordinates in single precision.

        Raises
        ------
        MeshError : where the extension is none of these, the file cannot be written, or quadratic tets would be written
            to TetGen's or USD's files. No partial file is left.
        """
        if is_tetgen_path(path):
            if self.order == 2:
                raise MeshError(
                    f"{path}: TetGen's files are written for linear tets only; use .msh, .vtu, .vtk or .inp, or "
                    "save mesh.to_order(1)"
                )
            write_tetgen_family(path, self.vertices, self.tets, self.edges, self.surface.triangles)
        else:
            write_tets(path, self.vertices, self.nodes)

    @cached_property
    def edges(self) -> NDArray[np.int32]:
        """Unique edges (e, 2), lower vertex first, sorted; of quadratic tets, both halves of each edge."""
        if self.order == 2:
            return frozen(half_edges(self.nodes))
        return frozen(unique_edges(self.tets, len(self.vertices)))

    @cached_property
    def volumes(self) -> NDArray[np.float64]:
        """Volume of each tet (m,) [m^3], all positive."""
        if self.order == 2:
            return frozen(volumes_of(self.vertices, self.nodes))
        return frozen(_determinants(self.vertices, self.tets) / 6.0)

    @cached_property
    def volume(self) -> float:
        """Total volume [m^3]."""
        return float(self.volumes.sum())

    @cached_property
    def rest_shape_inverse(self) -> NDArray[np.float64]:
        """Inverse of Dm = [x1-x0, x2-x0, x3-x0] (columns) of each tet (m, 3, 3) [1/m].

        Its rows are the gradients of the barycentric coordinates of vertices 1, 2 and 3. Of quadratic tets, this is
        that of the straight tet between their corners.
        """
        x0, x1, x2, x3 = self.vertices[self.tets].transpose(1, 0, 2)
        a, b, c = x1 - x0, x2 - x0, x3 - x0
        rows = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
        volumes = self.volumes if self.order == 1 else _determinants(self.vertices, self.tets) / 6.0
        return frozen(rows / (6.0 * volumes)[:, None, None])

    @cached_property
    def adjacency(self) -> NDArray[np.int32]:
        """Neighbour of each tet across the facet opposite each of its vertices (m, 4); -1 on the boundary."""
        return frozen(tet_neighbours(self.tets, len(self.vertices)))

    @cached_property
    def surface(self) -> SurfaceMesh:
        """The boundary, counter-clockwise from outside; its triangles index into this mesh's whole vertex array.

        Each facet of a quadratic tet is four triangles between its six nodes.
        """
        tet, facet = np.nonzero(self.adjacency < 0)
        if self.order == 2:
            return SurfaceMesh(self.vertices, facet_quarters(self.nodes[tet], facet), shares_vertices=True)
        triangles = self.tets[tet[:, None], TET_FACETS[facet]]
        return SurfaceMesh(self.vertices, triangles, shares_vertices=True)

    @cached_property
    def components(self) -> Components:
        """How many connected pieces there are, and which one each tet (m,) belongs to."""
        return connected_components(self.tets, len(self.vertices))

    @cached_property
    def min_dihedrals(self) -> NDArray[np.float64]:
        """Smallest dihedral angle of each tet (m,) [degrees]; 70.5 in the regular one."""
        return frozen(min_dihedrals(self.vertices, self.tets))

    @cached_property
    def radius_ratios(self) -> NDArray[np.float64]:
        """Three times inscribed over circumscribed radius of each tet (m,): 1 in the regular one, 0 in a flat one."""
        return frozen(radius_ratios(self.vertices, self.tets))

    def transformed(
        self,
        scale: float | ArrayLike = 1.0,
        rotation: ArrayLike | None = None,
        translation: ArrayLike = (0.0, 0.0, 0.0),
    ) -> TetMesh:
        """The mesh scaled, then turned by a matrix (3, 3), then moved by a vector (3,) [m]."""
        linear, shift = linear_map(scale, rotation, translation, "TetMesh.transformed")
        return TetMesh(self.vertices @ linear.T + shift, self.nodes)._with_sets(self.sets)

    @property
    def sets(self) -> MeshSets:
        """The named sets of the file that the mesh was loaded from (.inp, .msh); none of other meshes."""
        return self.__dict__.get("_sets") or MeshSets({}, {}, len(self.tets))

    def _with_sets(self, sets: MeshSets) -> TetMesh:
        object.__setattr__(self, "_sets", sets)
        return self


def _determinants(vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> NDArray[np.float64]:
    x0, x1, x2, x3 = vertices[tets].transpose(1, 0, 2)
    return np.einsum("ij,ij->i", x1 - x0, np.cross(x2 - x0, x3 - x0))


def _width(tets: ArrayLike) -> int:
    return 10 if np.shape(tets)[1:] == (10,) else 4


def _negative_winding(vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(m,) which tets have negative determinants; raises for flat ones."""
    det = _determinants(vertices, tets)
    corners = vertices[tets]
    longest = np.zeros(len(tets))
    for i, j in TET_EDGES:
        d = corners[:, j] - corners[:, i]
        np.maximum(longest, np.einsum("ij,ij->i", d, d), out=longest)
    reach = np.maximum(np.sqrt(longest), np.abs(corners).max(axis=(1, 2)))
    flat = np.abs(det) <= ROUND_OFF_UNITS * np.finfo(np.float64).eps * longest * reach
    if flat.any():
        rows = np.flatnonzero(flat)
        t = int(rows[0])
        length = float(np.sqrt(longest[t]))
        # A tet of coinciding vertices has no length to compare with.
        thickness = f"{abs(det[t]) / length**2:.3g} m" if length > 0.0 else "0 m"
        more = f" (and {len(rows) - 1} more)" if len(rows) > 1 else ""
        raise MeshError(
            f"TetMesh: tet {t} {tets[t].tolist()} at {place(corners[t].mean(axis=0))} is flat: it is {thickness} thick "
            f"with edges up to {length:.3g} m{more}; remove it or remesh"
        )
    return det < 0.0


def _check_repeated_corners(tets: NDArray[np.int32]) -> None:
    repeated = has_vertex_twice(tets)
    if repeated.any():
        t = int(np.flatnonzero(repeated)[0])
        raise MeshError(f"TetMesh: tet {t} is {tets[t].tolist()}, with a vertex twice; remove it")


def _check_unused(vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> None:
    rows = np.flatnonzero(~is_used(tets, len(vertices)))
    if len(rows):
        more = f" (and {len(rows) - 1} more)" if len(rows) > 1 else ""
        raise MeshError(
            f"TetMesh: vertex {rows[0]} at {place(vertices[rows[0]])}{more} belongs to no tet; "
            "drop such vertices with TetMesh.dropping_unused(vertices, tets)"
        )


def _check_duplicates(tets: NDArray[np.int32], n_vertices: int) -> None:
    corners = np.sort(tets, axis=1).astype(np.int64)
    first, second = corners[:, 0] * n_vertices + corners[:, 1], corners[:, 2] * n_vertices + corners[:, 3]
    # Equal tets have equal sums of keys. The slower exact comparison is needed only where two sums agree.
    sums = np.sort(first.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15) + second.astype(np.uint64))
    if not (sums[1:] == sums[:-1]).any():
        return
    order = np.lexsort((second, first))
    same = (first[order][1:] == first[order][:-1]) & (second[order][1:] == second[order][:-1])
    if same.any():
        k = int(np.flatnonzero(same)[0])
        a, b = sorted((int(order[k]), int(order[k + 1])))
        raise MeshError(
            f"TetMesh: tet {b} {tets[b].tolist()} has the same four vertices as tet {a}; remove one of them"
        )
