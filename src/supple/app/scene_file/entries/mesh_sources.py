"""The sources of the meshes of a scene file, and the stores that read or make each mesh once."""

from __future__ import annotations

import glob
import logging
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, create_model

from supple.app.scene_file.entries.kinds import KindModel, entry_of
from supple.app.scene_file.model import FilePath, Model, Positive, Vector
from supple.app.scene_file.yaml_files import printable
from supple.errors import MeshError, SceneError
from supple.mesh.io.mesh_files import READERS
from supple.mesh.io.tetgen_family import SUFFIXES
from supple.mesh.mesh_file import load_mesh
from supple.mesh.meshing.units import warn_of_millimetres
from supple.mesh.primitives.shape import SURFACES, surface_of
from supple.mesh.sets import MeshSets
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.numerics.geometry.convex_hull import convex_hull
from supple.scene.located import at
from supple.scene.rotation import rotation_matrix

logger = logging.getLogger(__name__)

MESH_FILES = (*READERS, *SUFFIXES)
KEEP_AXES = "true: coordinates of a .dae or USD file whose x or z axis points up are not turned to y"
MESHING_OPTIONS = (
    "tets",
    "edge",
    "max_volume",
    "quality",
    "min_dihedral",
    "keep_surface",
    "mesher",
    "repair",
    "time_limit",
)


class MeshFileModel(Model):
    """A mesh file. Where it holds a surface, that is filled with tetrahedra according to the meshing options.

    Without a size, a surface whose triangles need more than about 2,000 tetrahedra is filled with so many. A surface
    that is remeshed for that is the skin of the body.
    """

    file: FilePath = Field(description="relative to the scene file")
    scale: Positive = Field(default=1.0, description="of all coordinates: 0.001 for a file in millimetres")
    tets: int | None = Field(default=None, gt=0, le=10**8, description="number of tetrahedra, about")
    edge: Positive | None = Field(default=None, description="mean length of the tetrahedra's edges [m], after scaling")
    max_volume: Positive | None = Field(default=None, description="of a tetrahedron [m^3], after scaling")
    quality: float | None = Field(
        default=None, ge=1.0, le=100.0, description="largest ratio of circumradius to shortest edge"
    )
    min_dihedral: float | None = Field(default=None, ge=0.0, lt=70.0, description="[degrees]")
    keep_surface: bool | None = Field(default=None, description="true: no new vertices on the surface")
    mesher: Literal["auto", "tetgen", "stuffing"] | None = Field(default=None, description="program for the tetrahedra")
    repair: bool | None = Field(default=None, description="true: repair the surface first, if it has faults")
    time_limit: Positive | None = Field(default=None, description="of the mesher [s]")
    keep_axes: bool = Field(default=False, description=KEEP_AXES)

    @property
    def meshing(self) -> dict[str, Any]:
        """The meshing options that were given."""
        return {key: getattr(self, key) for key in MESHING_OPTIONS if getattr(self, key) is not None}


class SurfaceModel(Model):
    """A triangle surface: of a file or of a shape, scaled, then rotated, then moved."""

    alternatives = ("file", "shape", "a surface needs either `file` or `shape`; give one of them")

    file: FilePath | None = Field(default=None, description="relative to the scene file")
    shape: KindModel | None = None
    scale: Positive | Vector = Field(
        default=1.0, description="of all coordinates, or of x, y and z; a negative one mirrors"
    )
    rotation: Vector = Field(default=[0.0, 0.0, 0.0], description="rotation vector about the origin [rad]")
    position: Vector = Field(default=[0.0, 0.0, 0.0], description="[m]")
    hull: bool = Field(default=False, description="true: the convex hull of the surface instead")
    keep_axes: bool = Field(default=False, description=KEEP_AXES)
    merge: bool = Field(default=True, description="false: vertices at one place stay apart, and nothing is dropped")

    def build(self, meshes: MeshStore) -> SurfaceMesh:
        return meshes.surface(self)


@cache
def surface_model() -> type[SurfaceModel]:
    """`SurfaceModel` with all kinds of shapes."""
    shape: Any = entry_of(SURFACES.values()) | None, Field(default=None, description="instead of `file`")
    return create_model("SurfaceModel", __base__=SurfaceModel, __doc__=SurfaceModel.__doc__, shape=shape)


class MeshStore:
    """Reads and makes meshes; equal descriptions share one mesh.

    Parameters
    ----------
    folder : the folder of relative paths.

    Attributes
    ----------
    sources : by name of a body, the file of its mesh, or None
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.sources: dict[str, MeshFileModel | None] = {}
        self._made: dict[str, Any] = {}

    def _once(self, description: BaseModel, make: Any, kind: str = "") -> Any:
        key = f"{kind}{type(description).__name__}{description.model_dump_json()}"
        if key not in self._made:
            self._made[key] = make()
        return self._made[key]

    def tets(self, source: MeshFileModel) -> TetMesh:
        """The tet mesh of a file, or of the surface in it."""
        return self._once(source, lambda: self._read(source))[0]

    def fine(self, source: MeshFileModel) -> SurfaceMesh | None:
        """The surface in a file, which was reduced before it was filled; None where it was not."""
        return self._once(source, lambda: self._read(source))[1]

    def shape(self, shape: KindModel, order: int = 1) -> TetMesh:
        """The tet mesh of a shape."""
        return self._once(shape, lambda: shape.made(**shape.built_values(self), order=order), f"order {order} ")

    def solid(self, source: MeshFileModel) -> SurfaceMesh | TetMesh:
        """The surface in a file as it is, without meshing options; otherwise its tet mesh."""
        return self.tets(source) if source.meshing else self._loaded(source)

    def sets(self, body: str, source: MeshFileModel | None) -> MeshSets:
        """The named sets of the mesh file of a body.

        Raises
        ------
        SceneError : where it has none.
        """
        if source is None or not isinstance(self._loaded(source), TetMesh):
            raise SceneError(f"body {body!r} has no file of tets with named sets (.inp or .msh)")
        return self.tets(source).sets

    def vertices_of(self, body: str, name: str) -> NDArray[np.integer]:
        """Numbers (k,) of the vertices of a body that are in a set of its mesh file.

        Raises
        ------
        SceneError : where the body does not exist, or has no such set.
        """
        if body not in self.sources:
            raise SceneError(f"body {body!r} does not exist")
        return self.sets(body, self.sources[body]).vertices_of(name)

    def solid_shape(self, shape: KindModel) -> SurfaceMesh | TetMesh:
        """The surface of a shape, or its tet mesh where the surface has other parameters."""
        return self._once(shape, lambda: surface_of(getattr(shape, "kind"), shape.built_values(self)), "solid ")  # noqa: B009

    def surface(self, source: SurfaceModel) -> SurfaceMesh:
        """The surface of a file or a shape, placed."""
        return self._once(source, lambda: self._surface(source))

    def joined(self, sources: list[SurfaceModel]) -> SurfaceMesh:
        """Several surfaces as one."""
        surfaces = [self.surface(source) for source in sources]
        begins = np.cumsum([0, *(len(one.vertices) for one in surfaces)])
        triangles = [one.triangles + begin for one, begin in zip(surfaces, begins[:-1], strict=True)]
        return SurfaceMesh(np.concatenate([one.vertices for one in surfaces]), np.concatenate(triangles))

    def array(self, file: str) -> NDArray[Any]:
        """The numbers in a file of NumPy.

        Raises
        ------
        SceneError : where it cannot be read, or holds anything else.
        """
        with at("file"):
            try:
                numbers = np.load(self.located(file), allow_pickle=False)
            except (OSError, ValueError, EOFError) as error:
                reason = error.strerror if isinstance(error, OSError) and error.strerror else "it is not such a file"
                raise SceneError(f"{printable(file)}: no numbers of NumPy (.npy) can be read: {reason}") from None
            if not isinstance(numbers, np.ndarray) or numbers.dtype.kind not in "iuf":
                raise SceneError(f"{printable(file)}: it holds something other than one array of numbers")
        return numbers

    def located(self, file: str) -> Path:
        """The path of a file that a scene names.

        Raises
        ------
        SceneError : where reading it is not allowed.
        """
        return self.folder / file

    def _read(self, source: MeshFileModel) -> tuple[TetMesh, SurfaceMesh | None]:
        """The mesh; and the surface where it was reduced before it was filled."""
        loaded = self._loaded(source)
        if isinstance(loaded, TetMesh):
            return loaded, None
        from supple.mesh.meshing.tetrahedralize import tetrahedralize_reported

        mesh, report = tetrahedralize_reported(loaded, **source.meshing)
        if report.reduced:
            logger.info("%s: its %d triangles are drawn, as the skin", source.file, len(report.fine.triangles))
        return mesh, report.fine if report.reduced else None

    def _loaded(self, source: MeshFileModel) -> SurfaceMesh | TetMesh:
        """What a file holds, scaled."""

        def load() -> SurfaceMesh | TetMesh:
            with at("file"):
                mesh = load_mesh(self.located(source.file), keep_axes=source.keep_axes)
            warn_of_millimetres(source.file, mesh.vertices, source.scale)
            return mesh if source.scale == 1.0 else mesh.transformed(source.scale)

        loaded = self._once(source, load, "loaded ")
        if isinstance(loaded, TetMesh) and source.meshing:
            with at(next(iter(source.meshing))):
                raise MeshError(f"{source.file} already holds tetrahedra; remove this")
        return loaded

    def _surface(self, source: SurfaceModel) -> SurfaceMesh:
        if source.file is not None:
            file = source.file
            with at("file"):
                surface = self._once(
                    MeshFileModel(file=file, keep_axes=source.keep_axes),
                    lambda: SurfaceMesh.load(self.located(file), keep_axes=source.keep_axes, merge=source.merge),
                    f"surface {source.merge} in ",
                )
        else:
            assert source.shape is not None
            with at("shape"):
                surface = source.shape.build(self)
        if source.hull:
            try:
                surface = SurfaceMesh(*convex_hull(surface.vertices))
            except ValueError as error:
                raise MeshError(f"{source.file}: no convex hull: {error}") from None
        if source.scale == 1.0 and not any(source.rotation) and not any(source.position):
            return surface
        return surface.transformed(source.scale, rotation_matrix(source.rotation), source.position)


LARGEST_FILE = 256 * 1024 * 1024


class ConfinedMeshStore(MeshStore):
    """Reads mesh files from one folder and those below it: no absolute path, no `..`, no link to another place.

    No file may be larger than `LARGEST_FILE` bytes, or be anything but a regular file.
    """

    def located(self, file: str) -> Path:
        path = self.folder / file
        self._require_inside(path, file)
        # A TetGen mesh consists of several files of one stem; the scene gives one of them.
        for sibling in path.parent.glob(f"{glob.escape(path.stem)}.*") if path.parent.is_dir() else ():
            self._require_inside(sibling, file)
        return path

    def _require_inside(self, path: Path, file: str) -> None:
        try:
            folder, real = self.folder.resolve(), path.resolve()
            inside = real.is_relative_to(folder)
            exists = real.exists()
            regular = real.is_file() and real.stat().st_size <= LARGEST_FILE
        except (OSError, ValueError, RuntimeError):
            raise SceneError(f"{printable(file)} cannot be read") from None
        if not inside or Path(file).is_absolute():
            raise SceneError(
                f"{printable(file)} is outside the scene file's folder, to which reading is confined; "
                "move it there, or do not confine reading (--no-confine, confine=False)"
            )
        if exists and not regular:
            raise SceneError(f"{printable(file)} is not a regular file of at most {LARGEST_FILE // 2**20} MiB")
