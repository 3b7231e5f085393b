"""A rod: a thin round body given by its middle line, its placement and its initial velocity."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import MeshError, SceneError
from supple.kinds.validators import VECTORS, Choice, Instance, ListOf, Number
from supple.materials.rods.elements import RodElements, elements_of_rod
from supple.materials.rods.rod_material import RodMaterial
from supple.mesh.rod_mesh import RodMesh
from supple.mesh.surface import SurfaceMesh
from supple.scene.body import PlacedBody


@dataclass(frozen=True, eq=False, kw_only=True)
class Rod(PlacedBody):
    """One rod of a scene, such as a rope, a wire, a hair or a net; `PlacedBody` has its other parameters.

    Its points are followed by two material points of each edge, on the rod's surface, which carry its twist; frames
    have all of them, in this order. Pins of both ends of an edge also hold its material points: they clamp it.

    Parameters
    ----------
    centerline : (n, 3) points of its middle line, in the rod's own coordinates [m]; each is joined with the next.
    material : stiffness and radius.
    edges : (e, 2) pairs of points that are joined instead, of a closed or a branching rod; at a point that several
        edges share, they keep their angles as a welded joint does.
    rest : the shape without stress: "given", that of the points; or "straight".
    twist : of the shape without stress, beyond that of the points [rad/m].

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range, an edge has no length, a point has no edge, or two
        edges at a point lie on each other; the text names the rod.
    """

    kind: ClassVar[str] = "rod"

    centerline: Annotated[ArrayLike, VECTORS] = field(kw_only=False)
    material: Annotated[RodMaterial, Instance((RodMaterial,), "a RodMaterial")] = field(kw_only=False)
    edges: Annotated[ArrayLike | None, ListOf(("rows",))] = None
    rest: Annotated[Literal["given", "straight"], Choice(("given", "straight"))] = "given"
    twist: Annotated[float, Number()] = 0.0
    mesh: RodMesh = field(init=False, repr=False)
    skin: SurfaceMesh | None = field(init=False, repr=False, default=None)

    def __post_init__(self) -> None:
        super().__post_init__()
        try:
            mesh = RodMesh(self.centerline, self.edges, self.material.radius)
        except MeshError as error:
            raise SceneError(f"{self.label}: {error}") from None
        object.__setattr__(self, "mesh", mesh)
        self._check_placement(mesh.line)
        self.elements(np.zeros(len(mesh.line), dtype=np.bool_))  # raises for edges that lie on each other

    @property
    def offset(self) -> float:
        return self.material.radius

    def with_clamped(self, rows: NDArray[np.int32]) -> NDArray[np.int32]:
        line, carried = self.mesh.line, self.mesh.material_points
        clamped = carried[np.isin(line, rows).all(axis=1)].ravel()
        return np.union1d(rows, clamped).astype(np.int32)

    def facts(self, scene: Any) -> str:
        amounts = f"{self.lengths.sum():.6g} m, {self.lumped_masses().sum():.6g} kg"
        return f"{self.material.facts(scene)}, {len(self.lengths)} edges, {amounts}"

    def elements(self, held: NDArray[np.bool_]) -> RodElements:
        """Its edges and joints; held : (e,) which edges one thing holds at both ends."""
        own, x = self.material, self.mesh.vertices
        stiffness = own.youngs * own.area, own.bending_stiffness, own.twisting_stiffness
        nodes = np.column_stack([self.mesh.line, self.mesh.material_points])
        try:
            straight = self.rest == "straight"
            return elements_of_rod(x, nodes, stiffness, own.radius, own.damping, straight, self.twist, held)
        except ValueError as error:
            raise SceneError(f"{self.label}: {error}; move their points apart, or remove one of them") from None

    @property
    def lengths(self) -> NDArray[np.float64]:
        """(e,) of its edges at rest [m]."""
        a, b = self.points[self.mesh.line].transpose(1, 0, 2)
        return np.linalg.norm(b - a, axis=1)

    def lumped_masses(self) -> NDArray[np.float64]:
        """(n,) a quarter of each edge's mass at each end and material point [kg]: so it turns about its axis as a solid
        cylinder does."""
        rows = np.column_stack([self.mesh.line, self.mesh.material_points])
        parts = np.repeat(0.25 * self.material.density * self.material.area * self.lengths, 4)
        return np.bincount(rows.ravel(), weights=parts, minlength=len(self.points)).astype(np.float64)
