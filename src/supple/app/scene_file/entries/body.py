"""Bodies of a scene file: the declared fields of all kinds of bodies, where meshes come from, regions and copies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, create_model, model_validator

from supple.app.scene_file.entries.copies import CopiesModel
from supple.app.scene_file.entries.kinds import built, entry_of, typed_keys, values_of
from supple.app.scene_file.entries.mesh_sources import MeshFileModel, MeshStore
from supple.app.scene_file.entries.regions import Region, with_regions
from supple.app.scene_file.model import Extents, Model, Name
from supple.errors import SceneError
from supple.kinds.kind import declared
from supple.materials.material import Hyperelastic
from supple.materials.registry import MATERIALS
from supple.materials.rods.rod_material import RodMaterial
from supple.materials.shells.shell_material import ShellMaterial
from supple.mesh.tetmesh import TetMesh
from supple.scene.body import Body, PlacedBody
from supple.scene.located import at
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rod import Rod
from supple.scene.shell import Shell

# What all kinds of bodies have, and what each has of its own beside the mesh, shape or surface.
SHARED = declared(PlacedBody)
SOFT = {key: one for key, one in declared(Body).items() if key not in (*SHARED, "mesh", "material")}
RIGID = {key: one for key, one in declared(RigidBody).items() if key not in (*SHARED, "shape")}
SHELL = declared(ShellMaterial)
ROD = {key: one for key, one in declared(Rod).items() if key not in (*SHARED, "material")}
ROD_MATERIAL = declared(RodMaterial)


class InitialModel(Model):
    """A deformed start of a body."""

    scale: Extents = Field(
        description="along the world's x, y and z about the center of volume; [1, 0.5, 1] squeezes to half the height"
    )


@dataclass(frozen=True, eq=False)
class BuiltBody:
    """A body, and its vertices (n, 3) [m] at the start if it starts deformed."""

    body: PlacedBody
    initial_positions: NDArray[np.float64] | None


class BodyEntry(Model):
    """One body. Give `mesh` (a file), `shape` or `surfaces`; and `material`, or `rigid` or `shell` for such a one. A
    `rod` has its points itself."""

    alternatives = ("mesh", "shape", "surfaces", "rod", "a body needs either `mesh` or `shape`; give one of them")
    # Of this class alone: the other keys are those of `body_model`.
    others: ClassVar[Sequence[str]] = ("regions", "initial", "order")

    name: Name
    mesh: MeshFileModel | None = None
    regions: list[Region] | None = None
    order: Literal[1, 2] | None = Field(
        default=None,
        description="of the tets: 2 for quadratic ones (implicit solver), 1 for linear ones; default: as in the file",
    )
    copies: CopiesModel | None = Field(default=None, description="copies of the body")
    initial: InitialModel | None = Field(default=None, description="a deformed start")

    @model_validator(mode="after")
    def _soft_or_rigid(self) -> BodyEntry:
        this: Any = self
        if sum(one is not None for one in (this.material, this.rigid, this.shell, this.rod)) != 1:
            raise ValueError("a body needs either `material`, `rigid`, `shell` or `rod`; give one of them")
        if this.surfaces is not None and this.material is not None:
            raise ValueError("`surfaces` are of rigid bodies and shells; give a soft one a `mesh` or a `shape`")
        if this.material is None:
            for key in (*self.others, *SOFT):
                if getattr(self, key) is not None:
                    kind = "shell" if this.shell is not None else "rigid body" if this.rod is None else "rod"
                    raise ValueError(f"a {kind} has no `{key}`; remove it")
        return self

    def build(self, meshes: MeshStore) -> list[BuiltBody]:
        """The body, or all its copies."""
        this: Any = self
        shared = values_of(self, SHARED, meshes)
        kinds = (
            (this.rigid, self._rigid),
            (this.shell, self._shell),
            (this.rod, self._rod),
            (this.material, self._soft),
        )
        alone = next(make for given, make in kinds if given is not None)(shared, meshes)
        # -0.0 is what changes no number, also not the sign of zero.
        copies = list(self.copies.placements()) if self.copies is not None else [(np.full(3, -0.0), None)]
        digits = max(2, len(str(len(copies))))
        made = []
        for i, (offset, rotation) in enumerate(copies):
            body = alone.changed(
                name=this.name if self.copies is None else f"{this.name}{i + 1:0{digits}d}",
                position=np.array(this.position) + offset,
                rotation=this.rotation if rotation is None else rotation,
            )
            made.append(BuiltBody(body, _scaled(body, self.initial.scale) if self.initial else None))
        return made

    def _rigid(self, shared: dict[str, Any], meshes: MeshStore) -> RigidBody:
        """Without copies."""
        this: Any = self
        shape = self._shape(meshes.solid, meshes.solid_shape, meshes.joined)
        with at("rigid"):
            return RigidBody(shape=shape, **shared, **values_of(this.rigid, RIGID, meshes))

    def _shell(self, shared: dict[str, Any], meshes: MeshStore) -> Shell:
        """Without copies."""
        this: Any = self
        surface = self._shape(meshes.solid, meshes.solid_shape, meshes.joined)
        if isinstance(surface, TetMesh):
            raise SceneError("a shell needs a surface, and this is a mesh of tets; give a file of triangles")
        with at("shell"):
            material = ShellMaterial(**values_of(this.shell, SHELL, meshes))
        return Shell(surface=surface, material=material, **shared)

    def _rod(self, shared: dict[str, Any], meshes: MeshStore) -> Rod:
        """Without copies."""
        this: Any = self
        with at("rod"):
            material = RodMaterial(**values_of(this.rod, ROD_MATERIAL, meshes))
            return Rod(material=material, **shared, **values_of(this.rod, ROD, meshes))

    def _soft(self, shared: dict[str, Any], meshes: MeshStore) -> Body:
        """Without copies."""
        this: Any = self
        mesh = self._shape(meshes.tets, lambda shape: meshes.shape(shape, self.order or 1))
        with at("order"):
            mesh = mesh if self.order is None else mesh.to_order(self.order)
        fine = None if this.mesh is None else meshes.fine(this.mesh)
        given = {key: value for key, value in values_of(self, SOFT, meshes).items() if value is not None}
        with at("material"):
            material = built(this.material, meshes)
        if self.regions is not None:
            with at("regions"):
                material = with_regions(material, self.regions, mesh, this.mesh, meshes, this.name)
        return Body(mesh=mesh, material=material, **shared, **({"skin": fine} if fine else {}) | given)

    def _shape(self, *makers: Any) -> Any:
        """What the first of the makers that has something to do makes of its key."""
        for key, make in zip(("mesh", "shape", "surfaces"), makers, strict=False):
            source = getattr(self, key)
            if source is not None:
                with at(key):
                    return make(source)
        raise AssertionError("`alternatives` requires one of the keys")


@cache
def body_model() -> type[BodyEntry]:
    """The keys of a body: those of `BodyEntry`, and the declared fields of all kinds of bodies."""
    elastic = entry_of([kind for kind in MATERIALS if issubclass(kind, Hyperelastic)])
    region: Any = create_model("RegionModel", __base__=Region, __doc__=Region.__doc__, material=(elastic, ...))
    own: dict[str, Any] = typed_keys(RigidBody, RIGID)
    rigid: Any = create_model(
        "RigidModel",
        __base__=_Rigid,
        __doc__="What makes a body rigid. A surface file is used as it is; it must be closed.",
        **own,
    )
    text = "parts of the body with other materials; where two overlap, the later one counts"
    keys: dict[str, Any] = typed_keys(RigidBody, (*SHARED, "shape")) | typed_keys(Body, SOFT, null=True)
    keys["material"] = entry_of(MATERIALS) | None, Field(default=None, description="of a soft body")
    keys["rigid"] = rigid | None, Field(default=None, description="instead of `material`: the body is rigid")
    of_sheet: dict[str, Any] = typed_keys(ShellMaterial, SHELL)
    sheet: Any = create_model(
        "ShellModel",
        __base__=Model,
        __doc__="What makes a body a shell, whose surface is its middle one, open or closed.",
        **of_sheet,
    )
    keys["shell"] = sheet | None, Field(default=None, description="instead of `material`: the body is a thin sheet")
    of_rod: dict[str, Any] = typed_keys(Rod, ROD) | typed_keys(RodMaterial, ROD_MATERIAL)
    rod: Any = create_model("RodModel", __base__=Model, __doc__="What makes a body a rod, along its points.", **of_rod)
    keys["rod"] = rod | None, Field(default=None, description="instead of `material`: the body is a thin round rod")
    keys["regions"] = (
        list[region] | None,
        Field(default=None, min_length=1, max_length=1000, description=text),
    )
    return create_model("BodyModel", __base__=BodyEntry, __doc__=BodyEntry.__doc__, **keys)


class _Rigid(Model):
    alternatives = ("density", "mass", "a rigid body needs either `density` or `mass`; give one of them")


def _scaled(body: PlacedBody, scale: list[float]) -> NDArray[np.float64]:
    placed = body.place(body.mesh.vertices)
    corners = placed[body.mesh.tets].mean(axis=1)
    center = body.mesh.volumes @ corners / body.mesh.volume
    return center + (placed - center) * np.array(scale)
