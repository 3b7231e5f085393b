"""Bodies of a scene file: mesh, material, placement, and copies."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from supple.app.scene_file.entries.families import ElasticMaterialModel, MaterialModel
from supple.app.scene_file.entries.mesh_sources import MeshFileModel, MeshStore, SurfaceModel
from supple.app.scene_file.entries.shapes import ShapeModel
from supple.app.scene_file.model import Count, Extents, Index, Model, Name, NonNegative, Positive, Vector
from supple.errors import SceneError
from supple.materials.elastic_tets.regions import Regions
from supple.materials.material import Hyperelastic, Material
from supple.mesh.tetmesh import TetMesh
from supple.scene.body import LOOKS, Body, PlacedBody
from supple.scene.located import at
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.selection import InBox


class BoxOfMeshModel(Model):
    """The tets whose center is inside an axis-aligned box, in the coordinates of the mesh: before `position`,
    `rotation` and `copies`."""

    low: Vector = Field(description="corner with the lowest coordinates [m]")
    high: Vector = Field(description="corner with the highest coordinates [m]")


class RegionModel(Model):
    """Tets of a body with another elastic material than the body's."""

    alternatives = ("box", "tets", "set", "give the tets of a region by either `box`, `tets` or `set`")

    material: ElasticMaterialModel
    box: BoxOfMeshModel | None = Field(default=None, description="all tets whose center is inside")
    tets: list[Index] | None = Field(
        default=None, min_length=1, description="instead of `box`: tet numbers of the mesh, from 0"
    )
    set: Name | None = Field(default=None, description="instead of `box`: a set of the mesh file (.inp or .msh)")

    def select(self, mesh: TetMesh) -> NDArray[np.int64]:
        """Numbers (k,) of the selected tets."""
        if self.box is not None:
            with at("box"):
                centers = mesh.vertices[mesh.tets].mean(axis=1)
                inside = InBox(self.box.low, self.box.high).select(centers)
                if not len(inside):
                    low, high = (np.round(corner, 6).tolist() for corner in (centers.min(axis=0), centers.max(axis=0)))
                    raise SceneError(
                        f"no tet has its center inside; in the mesh's coordinates, centers are from {low} to {high}"
                    )
                return inside.astype(np.int64)
        chosen = np.array(self.tets)
        if chosen.max() >= len(mesh.tets):
            with at("tets"):
                raise SceneError(f"names tet {chosen.max()}; the mesh has tets 0 to {len(mesh.tets) - 1}")
        return chosen


def with_regions(material: Material, regions: list[RegionModel], mesh: TetMesh, meshes: MeshStore) -> Material:
    """The body's material, replaced in each tet by that of the last region that contains the tet.

    Raises
    ------
    LocatedError : where a region is empty or not of this mesh, or the body's own material is not elastic.
    """
    if not isinstance(material, Hyperelastic):
        raise SceneError(f"a body with regions needs an elastic material, which {type(material).__name__} is not")
    index = np.zeros(len(mesh.tets), dtype=np.int64)
    for k, region in enumerate(regions):
        with at(k):
            index[region.select(mesh)] = k + 1
    return Regions(materials=[material, *(region.material.build(meshes) for region in regions)], index=index)


MAX_COPIES = 10_000


class CopiesModel(Model):
    """Copies of the body, named name01, name02, ...: at given offsets, or in a grid."""

    offsets: list[Vector] | None = Field(
        default=None, min_length=1, max_length=MAX_COPIES, description="from `position` [m]"
    )
    rotations: list[Vector] | None = Field(default=None, description="one per offset, instead of the body's [rad]")
    grid: Annotated[list[Count], Field(min_length=3, max_length=3)] | None = Field(
        default=None, description="instead of `offsets`: how many along x, y and z"
    )
    spacing: Vector | None = Field(default=None, description="between neighbours of the grid [m]")

    @model_validator(mode="after")
    def _one_layout(self) -> CopiesModel:
        if (self.offsets is None) == (self.grid is None):
            raise ValueError("copies need either `offsets` or `grid`; give one of them")
        if (self.grid is None) != (self.spacing is None):
            raise ValueError("`grid` needs `spacing`; give both or neither")
        if self.grid is not None and np.prod([float(n) for n in self.grid]) > MAX_COPIES:
            raise ValueError(f"grid {self.grid} makes more than {MAX_COPIES} copies; make it smaller")
        if self.rotations is not None and (self.offsets is None or len(self.rotations) != len(self.offsets)):
            raise ValueError("`rotations` needs one entry for each of `offsets`")
        return self

    def placements(self) -> Iterator[tuple[NDArray[np.float64], list[float] | None]]:
        """Offset (3,) [m], and rotation where one is given, of each copy."""
        if self.offsets is not None:
            for i, offset in enumerate(self.offsets):
                yield np.array(offset), self.rotations[i] if self.rotations else None
        if self.grid is not None:
            for cell in np.ndindex(*reversed(self.grid)):
                yield np.array(cell[::-1]) * np.array(self.spacing), None


class InitialModel(Model):
    """A deformed start of a body."""

    scale: Extents = Field(
        description="along the world's x, y and z about the center of volume; [1, 0.5, 1] squeezes to half the height"
    )


class RigidModel(Model):
    """What makes a body rigid (implicit solver). A surface file is used as it is; it must be closed."""

    alternatives = ("density", "mass", "a rigid body needs either `density` or `mass`; give one of them")

    density: Positive | None = Field(default=None, description="[kg/m^3]")
    mass: Positive | None = Field(default=None, description="instead of `density` [kg]")
    inertia: Annotated[list[Vector], Field(min_length=3, max_length=3)] | None = Field(
        default=None, description="rows of the tensor about the center of mass, with `mass` [kg m^2]"
    )
    center: Vector | None = Field(
        default=None, description="of mass, with `inertia`, in the coordinates of the shape; default: of the solid [m]"
    )
    stiffness: Positive | None = Field(
        default=None, description="of the energy that keeps it rigid [Pa]; default: from the heaviest load of the scene"
    )


@dataclass(frozen=True, eq=False)
class BuiltBody:
    """A body, and its vertices (n, 3) [m] at the start if it starts deformed."""

    body: PlacedBody
    initial_positions: NDArray[np.float64] | None


class BodyModel(Model):
    """One body. Give `mesh` (a file), `shape` or `surfaces`; and `material`, or `rigid` for a rigid one."""

    alternatives = ("mesh", "shape", "surfaces", "a body needs either `mesh` or `shape`; give one of them")

    name: Name = Field(description="unique in the scene")
    mesh: MeshFileModel | None = Field(default=None, description="of tetrahedra, or a surface to fill with them")
    shape: ShapeModel | None = Field(default=None, description="instead of `mesh`: a ready-made shape")
    surfaces: list[SurfaceModel] | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="instead of `mesh`, of a rigid body: closed surfaces that are its shape together, and may overlap",
    )
    order: Literal[1, 2] | None = Field(
        default=None,
        description="of the tets: 2 for quadratic ones (implicit solver), 1 for linear ones; default: as in the file",
    )
    material: MaterialModel | None = Field(default=None, description="of a soft body")
    rigid: RigidModel | None = Field(default=None, description="instead of `material`: the body is rigid")
    regions: list[RegionModel] | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="parts of the body with other materials; where two overlap, the later one counts",
    )
    position: Vector = Field(default=[0.0, 0.0, 0.0], description="where the mesh's origin is placed [m]")
    rotation: Vector = Field(default=[0.0, 0.0, 0.0], description="rotation vector about the mesh's origin [rad]")
    velocity: Vector = Field(default=[0.0, 0.0, 0.0], description="of the center of mass, at the start [m/s]")
    angular_velocity: Vector = Field(
        default=[0.0, 0.0, 0.0], description="about the center of mass, at the start [rad/s]"
    )
    friction: NonNegative = Field(default=0.0, description="Coulomb coefficient against other bodies and itself")
    skin: SurfaceModel | None = Field(
        default=None,
        description="a finer surface that follows the body in pages and exports; default: the surface in the file of "
        "`mesh`, where it was reduced",
    )
    collide: Literal["tets", "skin"] | None = Field(
        default=None, description="what touches other things: the surface of the tets (default), or the skin"
    )
    look: Literal[LOOKS] | None = Field(  # pyright: ignore[reportInvalidTypeForm]
        default=None, description="how it is drawn; default: foam where the material is light, otherwise rubber"
    )
    copies: CopiesModel | None = Field(default=None, description="copies of the body")
    initial: InitialModel | None = Field(default=None, description="a deformed start")

    @model_validator(mode="after")
    def _soft_or_rigid(self) -> BodyModel:
        if (self.material is None) == (self.rigid is None):
            raise ValueError("a body needs either `material` or `rigid`; give one of them")
        if self.surfaces is not None and self.rigid is None:
            raise ValueError("`surfaces` are of rigid bodies; give a soft one a `mesh` or a `shape`")
        if self.rigid is not None:
            for key in ("regions", "skin", "collide", "initial", "order"):
                if getattr(self, key) is not None:
                    raise ValueError(f"a rigid body has no `{key}`; remove it")
        return self

    def build(self, meshes: MeshStore) -> list[BuiltBody]:
        """The body, or all its copies."""
        alone = self._rigid(self.rigid, meshes) if self.rigid is not None else self._soft(meshes)
        copies = list(self.copies.placements()) if self.copies is not None else [(np.zeros(3), None)]
        digits = max(2, len(str(len(copies))))
        built = []
        for i, (offset, rotation) in enumerate(copies):
            body = alone.changed(
                name=self.name if self.copies is None else f"{self.name}{i + 1:0{digits}d}",
                position=np.array(self.position) + offset,
                rotation=self.rotation if rotation is None else rotation,
            )
            built.append(BuiltBody(body, _scaled(body, self.initial.scale) if self.initial else None))
        return built

    def _placement(self) -> dict[str, Any]:
        keys = ("position", "rotation", "velocity", "angular_velocity", "friction", "look")
        return {key: getattr(self, key) for key in keys}

    def _rigid(self, rigid: RigidModel, meshes: MeshStore) -> RigidBody:
        """Without copies."""
        if self.mesh is not None:
            with at("mesh"):
                shape = meshes.solid(self.mesh)
        elif self.surfaces is not None:
            with at("surfaces"):
                shape = meshes.joined(self.surfaces)
        else:
            assert self.shape is not None
            with at("shape"):
                shape = meshes.solid_shape(self.shape)
        with at("rigid"):
            return RigidBody(
                self.name,
                shape,
                density=rigid.density,
                mass=rigid.mass,
                inertia=rigid.inertia,
                center=rigid.center,
                stiffness=rigid.stiffness,
                **self._placement(),
            )

    def _soft(self, meshes: MeshStore) -> Body:
        """Without copies."""
        assert self.material is not None
        fine = None
        if self.mesh is not None:
            with at("mesh"):
                mesh, fine = meshes.tets(self.mesh), meshes.fine(self.mesh)
                mesh = mesh if self.order is None else mesh.to_order(self.order)
        else:
            assert self.shape is not None
            with at("shape"):
                mesh = meshes.shape(self.shape, self.order or 1)
        with at("skin"):
            skin = meshes.surface(self.skin) if self.skin is not None else fine
        with at("material"):
            material = self.material.build(meshes)
        if self.regions is not None:
            with at("regions"):
                material = with_regions(material, self.regions, mesh, meshes)
        return Body(self.name, mesh, material, skin=skin, collide=self.collide or "tets", **self._placement())


def _scaled(body: PlacedBody, scale: list[float]) -> NDArray[np.float64]:
    placed = body.place(body.mesh.vertices)
    corners = placed[body.mesh.tets].mean(axis=1)
    center = body.mesh.volumes @ corners / body.mesh.volume
    return center + (placed - center) * np.array(scale)
