"""Triangle surfaces, from which soft bodies are made and with which they are drawn."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import MeshError
from supple.mesh.checked_arrays import frozen, index_array, vertex_array
from supple.mesh.io.mesh_files import read_contents, surface_of, write_surface
from supple.mesh.origin import with_origin
from supple.mesh.topology import Components, connected_components, is_used, unique_edges, without_unused
from supple.runtime.displayed import Showable, extent

if TYPE_CHECKING:
    from supple.mesh.surface_checks import SurfaceReport


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceMesh(Showable):
    """Triangles in space, counter-clockwise seen from outside.

    Wrong shapes of arrays, indices out of range and coordinates that are not finite are errors. Holes,
    self-intersections and similar faults are allowed here; `check` reports them.

    Parameters
    ----------
    vertices : (n, 3) float [m]
    triangles : (m, 3) int, rows of `vertices`
    shares_vertices : bool
        True where `vertices` belong to a larger mesh (the surface of a `TetMesh`), so that vertices that no
        triangle uses are not a fault.

    Raises
    ------
    MeshError : naming the wrong row.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    shares_vertices: bool = False

    def __init__(self, vertices: ArrayLike, triangles: ArrayLike, *, shares_vertices: bool = False) -> None:
        checked = vertex_array(vertices, "SurfaceMesh")
        object.__setattr__(self, "vertices", checked)
        object.__setattr__(self, "triangles", index_array(triangles, 3, len(checked), "SurfaceMesh", "triangle"))
        object.__setattr__(self, "shares_vertices", bool(shares_vertices))

    def _facts(self) -> dict[str, str]:
        return {
            "vertices": str(len(self.vertices)),
            "triangles": str(len(self.triangles)),
            "size": extent(self.vertices) if len(self.vertices) else "none",
        }

    @classmethod
    def load(cls, path: str | Path, *, keep_axes: bool = False, merge: bool = True) -> SurfaceMesh:
        """Read a surface from an STL, OBJ, PLY, OFF, GLB, glTF, DAE, 3MF, VTP, VTK, VTU, MSH, INP, MESH or USD file, by
        its extension, or by what it holds where that differs.

        Polygons are cut into triangles. Vertices closer than 2e-7 of the bounding box's diagonal (two units in the
        last place of the single precision that most files are written in) become one; triangles that collapse by
        this, that repeat another one and face the same way, and vertices that no triangle uses are dropped. The log
        gives their numbers. Coordinates are in metres where the file names its unit (DAE, 3MF, glTF, USD).

        Parameters
        ----------
        keep_axes : whether the coordinates stay those of a file that says that x or z points up (DAE, USD), which
            otherwise becomes y
        merge : False: vertices and triangles are those of the file; none is merged or dropped

        Raises
        ------
        MeshError : where the file is missing, malformed, of another kind, or has no surface; the text starts with
            the path.
        """
        contents = read_contents(path, keep_axes=keep_axes)
        return with_origin(cls(*surface_of(contents, merge=merge)), path)

    def save(self, path: str | Path) -> None:
        """Write the surface as STL (binary), OBJ, PLY, OFF, VTP, VTK or VTU, by the extension of `path`.

        Raises
        ------
        MeshError : where the extension is none of these, or the file cannot be written. No partial file is left.
        """
        alone = self.compact() if self.shares_vertices else self
        write_surface(path, alone.vertices, alone.triangles)

    @cached_property
    def edges(self) -> NDArray[np.int32]:
        """Unique edges (e, 2), lower vertex first, sorted."""
        return frozen(unique_edges(self.triangles, len(self.vertices)))

    @cached_property
    def area_vectors(self) -> NDArray[np.float64]:
        """Normal of each triangle times its area (m, 3) [m^2], pointing outward."""
        a, b, c = self.vertices[self.triangles].transpose(1, 0, 2)
        return frozen(0.5 * np.cross(b - a, c - a))

    @cached_property
    def area(self) -> float:
        """Total area [m^2]."""
        return float(np.linalg.norm(self.area_vectors, axis=1).sum())

    @cached_property
    def volume(self) -> float:
        """Enclosed volume [m^3] by the divergence theorem; negative where triangles face inward.

        Without meaning unless the surface is watertight.
        """
        low, high = self.bounds
        a = self.vertices[self.triangles[:, 0]] - 0.5 * (low + high)
        return float(np.einsum("ij,ij->i", a, self.area_vectors).sum() / 3.0)

    @cached_property
    def used_vertices(self) -> NDArray[np.int32]:
        """Rows of `vertices` that some triangle uses, sorted."""
        return frozen(np.flatnonzero(is_used(self.triangles, len(self.vertices))).astype(np.int32))

    @cached_property
    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest coordinates (3,), (3,) [m] of the vertices in use."""
        points = self.vertices[self.used_vertices]
        return frozen(points.min(axis=0)), frozen(points.max(axis=0))

    @cached_property
    def components(self) -> Components:
        """The number of connected pieces, and the piece of each triangle (m,)."""
        return connected_components(self.triangles, len(self.vertices))

    def check(self) -> SurfaceReport:
        """Find all faults that prevent a mesher or a contact solver from using this surface."""
        from supple.mesh.surface_checks import check_surface  # loads numba, which reading a file does not need

        return check_surface(self)

    def compact(self) -> SurfaceMesh:
        """The same surface without the vertices that no triangle uses."""
        return SurfaceMesh(*without_unused(self.vertices, self.triangles))

    def flipped(self) -> SurfaceMesh:
        """The same surface turned inside out."""
        return SurfaceMesh(self.vertices, self.triangles[:, ::-1], shares_vertices=self.shares_vertices)

    def transformed(
        self,
        scale: float | ArrayLike = 1.0,
        rotation: ArrayLike | None = None,
        translation: ArrayLike = (0.0, 0.0, 0.0),
    ) -> SurfaceMesh:
        """The surface scaled, then rotated by a matrix (3, 3), then moved by a vector (3,) [m].

        A map that mirrors also reverses the triangles, so that they still face outward.
        """
        linear, shift = linear_map(scale, rotation, translation, "SurfaceMesh.transformed")
        triangles = self.triangles[:, ::-1] if np.linalg.det(linear) < 0.0 else self.triangles
        return SurfaceMesh(self.vertices @ linear.T + shift, triangles, shares_vertices=self.shares_vertices)


def linear_map(
    scale: float | ArrayLike, rotation: ArrayLike | None, translation: ArrayLike, owner: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Matrix (3, 3) and shift (3,) of scaling, then rotating, then translating; `MeshError` where they are unusable."""
    try:
        factors = np.broadcast_to(np.asarray(scale, dtype=np.float64), (3,))
        turn = np.eye(3) if rotation is None else np.asarray(rotation, dtype=np.float64).reshape(3, 3)
        shift = np.asarray(translation, dtype=np.float64).reshape(3)
    except (TypeError, ValueError):
        raise MeshError(f"{owner}: give scale as 1 or 3 numbers, rotation as (3, 3), translation as (3,)") from None
    linear = turn * factors
    if not (np.isfinite(linear).all() and np.isfinite(shift).all()) or np.linalg.det(linear) == 0.0:
        raise MeshError(f"{owner}: scale, rotation and translation must be finite, and must not flatten the mesh")
    return linear, shift
