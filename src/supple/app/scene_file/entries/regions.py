"""Regions of a body of a scene file: tets with other materials."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from supple.app.scene_file.entries import schema_types as schema_types  # registers how values are written
from supple.app.scene_file.entries.arrays import array_type
from supple.app.scene_file.entries.kinds import KindModel, built, model_of
from supple.app.scene_file.entries.mesh_sources import MeshFileModel, MeshStore
from supple.app.scene_file.model import Index, Model, Name
from supple.errors import SceneError
from supple.materials.elastic_tets.regions import Regions
from supple.materials.material import Hyperelastic, Material
from supple.mesh.tetmesh import TetMesh
from supple.scene.located import at
from supple.scene.selection import InBox, distinct_numbers


class Region(Model):
    """Tets of a body with another elastic material than the body's."""

    alternatives = ("box", "tets", "set", "give the tets of a region by either `box`, `tets` or `set`")

    material: KindModel
    box: model_of(InBox, False) | None = Field(  # pyright: ignore[reportInvalidTypeForm]
        default=None,
        description="all tets whose center is inside, in the coordinates of the mesh: before `position`, `rotation` "
        "and `copies`",
    )
    tets: array_type(row=Annotated[list[Index], Field(min_length=1)]) | None = Field(  # pyright: ignore[reportInvalidTypeForm]
        default=None, description="instead of `box`: tet numbers of the mesh, from 0"
    )
    set: Name | None = Field(default=None, description="instead of `box`: a set of the mesh file (.inp or .msh)")

    def select(self, mesh: TetMesh, source: MeshFileModel | None, meshes: MeshStore, body: str) -> NDArray[np.integer]:
        """Numbers (k,) of the selected tets of a body's mesh, which is of the file `source`, or of none."""
        if self.set is not None:
            with at("set"):
                return meshes.sets(body, source).tets_of(self.set)
        if self.box is not None:
            with at("box"):
                centers = mesh.vertices[mesh.tets].mean(axis=1)
                inside = self.box.build(meshes).select(centers)
                if not len(inside):
                    low, high = (np.round(corner, 6).tolist() for corner in (centers.min(axis=0), centers.max(axis=0)))
                    raise SceneError(
                        f"no tet has its center inside; in the mesh's coordinates, centers are from {low} to {high}"
                    )
                return inside
        with at("tets"):
            chosen = distinct_numbers(built(self.tets, meshes), "it", "tet", "tets", "a box or a set")
        if chosen.max() >= len(mesh.tets):
            with at("tets"):
                raise SceneError(f"names tet {chosen.max()}; the mesh has tets 0 to {len(mesh.tets) - 1}")
        return chosen


def with_regions(
    material: Material,
    regions: list[Region],
    mesh: TetMesh,
    source: MeshFileModel | None,
    meshes: MeshStore,
    body: str,
) -> Material:
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
            index[region.select(mesh, source, meshes, body)] = k + 1
    return Regions(materials=[material, *(region.material.build(meshes) for region in regions)], index=index)
