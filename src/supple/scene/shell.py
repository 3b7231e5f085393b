"""A shell: a thin sheet given by its middle surface, its placement and its initial velocity."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError, SceneError
from supple.kinds.validators import Instance
from supple.materials.shells.shell_material import ShellMaterial
from supple.mesh.shell_mesh import ShellMesh
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.scene.body import PlacedBody


@dataclass(frozen=True, eq=False, kw_only=True)
class Shell(PlacedBody):
    """One shell of a scene, such as cloth, a plate or a balloon; `PlacedBody` has its other parameters.

    Parameters
    ----------
    surface : the middle surface at rest, open or closed, plane or curved, in the shell's own coordinates [m]; at most
        two triangles at an edge, which face the same way.
    material : thickness, stretching and bending.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range, or the surface has an edge of three triangles, a
        triangle without area or a vertex without a triangle; the text names the shell.
    """

    kind: ClassVar[str] = "shell"

    surface: Annotated[SurfaceMesh, Instance((SurfaceMesh,), "a SurfaceMesh")] = field(kw_only=False)
    material: Annotated[ShellMaterial, Instance((ShellMaterial,), "a ShellMaterial")] = field(kw_only=False)
    mesh: TetMesh = field(init=False, repr=False)
    skin: SurfaceMesh | None = field(init=False, repr=False, default=None)

    def __post_init__(self) -> None:
        super().__post_init__()
        try:
            mesh = ShellMesh(self.surface)
        except MeshError as error:
            raise SceneError(f"{self.label}: {error}") from None
        object.__setattr__(self, "mesh", mesh)
        self._check_placement(mesh.edges)

    @property
    def offset(self) -> float:
        return 0.5 * self.material.thickness

    def facts(self, scene: Any) -> str:
        amounts = f"{self.surface.area:.6g} m^2, {self.lumped_masses().sum():.6g} kg"
        return f"{self.material.facts(scene)}, {len(self.triangles)} triangles, {amounts}"

    def lumped_masses(self) -> NDArray[np.float64]:
        """(n,) a third of each triangle's mass at each of its corners [kg]."""
        areas = np.linalg.norm(self.surface.area_vectors, axis=1)
        parts = np.repeat(self.material.density * self.material.thickness * areas / 3.0, 3)
        return np.bincount(self.triangles.ravel(), weights=parts, minlength=len(self.points)).astype(np.float64)
