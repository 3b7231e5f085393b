"""Bodies of a scene; the soft body: a tetrahedral mesh, its material, its placement and its initial velocity."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.checks import float_array
from supple.kinds.kind import Kind
from supple.kinds.validators import NON_NEGATIVE, Choice, Instance, Name, OneOf, Vector
from supple.materials.material import Material
from supple.materials.registry import MATERIALS
from supple.mesh.closed_surfaces import require_closed
from supple.mesh.quadratic import node_volumes
from supple.mesh.skin import Skin
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.scene.rotation import rotation_matrix

LOOKS = ("rubber", "gummy", "foam", "steel")
_FOAM = 250.0  # what is lighter looks like foam [kg/m^3]


@dataclass(frozen=True, eq=False, kw_only=True)
class PlacedBody(Kind):
    """What every body of a scene has: vertices that move, and points on them that touch, are drawn and measured.

    Parameters
    ----------
    name : unique in its scene; frames and recordings are indexed by it.
    position : (3,) of the mesh's or shape's origin [m].
    rotation : (3,) rotation vector that turns it about that origin before it is placed [rad].
    velocity : (3,) initial velocity of the center of mass [m/s].
    angular_velocity : (3,) initial spin about the center of mass [rad/s].
    friction : Coulomb coefficient against other bodies, and of a soft one against itself; a pair uses the geometric
        mean of its two.
    look : how it is drawn, "rubber", "gummy", "foam" or "steel"; None: "foam" where its material is light, otherwise
        "rubber".

    Attributes
    ----------
    mesh : the tets whose vertices move; material : of these tets
    skin : the surface that is drawn instead of the mesh's own; None where that is drawn
    """

    name: Annotated[str, Name()] = field(kw_only=False)
    position: Annotated[ArrayLike, Vector()] = (0.0, 0.0, 0.0)
    rotation: Annotated[ArrayLike, Vector()] = (0.0, 0.0, 0.0)
    velocity: Annotated[ArrayLike, Vector()] = (0.0, 0.0, 0.0)
    angular_velocity: Annotated[ArrayLike, Vector()] = (0.0, 0.0, 0.0)
    friction: Annotated[float, NON_NEGATIVE] = 0.0
    look: Annotated[str | None, Choice(LOOKS)] = None
    mesh: TetMesh = field(init=False, repr=False)
    skin: SurfaceMesh | None = field(init=False, repr=False)

    if TYPE_CHECKING:  # a field of every body, at its own place among the arguments

        @property
        def material(self) -> Material: ...

    @property
    def drawn_look(self) -> str:
        """One of `LOOKS`: the given one, or foam where its material is light, otherwise rubber."""
        return self.look or "rubber"

    @property
    def points(self) -> NDArray[np.float64]:
        """(k, 3) the points that a frame has the positions of, at rest in the body's own coordinates [m]."""
        return self.mesh.vertices

    @property
    def triangles(self) -> NDArray[np.int32]:
        """(t, 3) the surface, rows of `points`, counter-clockwise from outside."""
        return self.mesh.surface.triangles

    @property
    def embedded(self) -> EmbeddedPoints:
        """`points` as combinations of the mesh's vertices."""
        return EmbeddedPoints.at_vertices(np.arange(len(self.mesh.vertices), dtype=np.int32))

    @property
    def touching(self) -> tuple[EmbeddedPoints, NDArray[np.int32]]:
        """The points of contact as combinations of the mesh's vertices, and triangles (t, 3) of them."""
        return self.embedded, self.triangles

    @cached_property
    def attached_skin(self) -> Skin | None:
        """`skin`, whose vertices follow those of the mesh."""
        return None if self.skin is None else Skin.of(self.mesh, self.skin)

    @property
    def touches_with_skin(self) -> bool:
        """Whether what touches is `skin`."""
        return False

    @property
    def offset(self) -> float:
        """How far its surface is from the triangles or edges that touch: half of a thickness, a radius, or 0 [m]."""
        return 0.0

    def with_clamped(self, rows: NDArray[np.int32]) -> NDArray[np.int32]:
        """Vertices (k,), with those that one thing holds where it holds all of these."""
        return rows

    def place(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """World positions (k, 3) [m] at the start of points (k, 3) given in the body's own coordinates."""
        return points @ rotation_matrix(self.rotation).T + np.asarray(self.position)

    def changed(self, **values: Any) -> Self:
        """The same body with other values of its parameters."""
        this: Any = self
        return replace(this, **values)

    def lumped_masses(self) -> NDArray[np.float64]:
        """(n,) of the mesh's vertices [kg]: of each tet's mass rho V, a quarter to each corner, or the parts of a
        quadratic tet's nodes."""
        mesh = self.mesh
        density = np.broadcast_to(np.asarray(self.material.density, dtype=np.float64), len(mesh.tets))
        if mesh.order == 2:
            parts = density[:, None] * node_volumes(mesh.vertices, mesh.nodes)
        else:
            parts = np.repeat(density * mesh.volumes / 4.0, 4)
        masses = np.bincount(mesh.nodes.ravel(), weights=parts.ravel(), minlength=len(mesh.vertices))
        return masses.astype(np.float64, copy=False)

    def velocities_at(self, placed: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, 3) velocities at the start [m/s] of the mesh's vertices, which are placed at (n, 3) [m]."""
        masses = self.lumped_masses()
        center = masses @ placed / masses.sum()
        return np.asarray(self.velocity) + np.cross(np.asarray(self.angular_velocity), placed - center)

    def vertex_values(self, value: ArrayLike, what: str, *, places: bool) -> NDArray[np.float64]:
        """Positions, or velocities, (n, 3) of the mesh's vertices from those of `points` (k, 3).

        Parameters
        ----------
        what : for messages; places : whether the values are positions

        Raises
        ------
        SceneError : where the values have another shape, are not finite, or do not fit a rigid body.
        """
        array, count = float_array(value, what), len(self.points)
        if array.shape != (count, 3):
            raise SceneError(f"{what} has shape {array.shape}; the body's mesh needs ({count}, 3)")
        if not np.isfinite(array).all():
            row = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
            raise SceneError(f"{what}: row {row} is not finite")
        return self.control_values(array, what, places=places)

    def control_values(self, values: NDArray[np.float64], what: str, *, places: bool) -> NDArray[np.float64]:
        """`vertex_values` of values that are as they should be."""
        return values

    def _check_placement(self, edges: NDArray[np.int32]) -> None:
        """Raise `SceneError` where it is so far away that double precision cannot tell the ends of an edge from each
        other; edges (e, 2) : rows of `points`."""
        ends = self.points[edges]
        shortest = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).min())
        reach = float(np.abs(np.asarray(self.position)).max())
        if np.spacing(reach) > 1e-6 * shortest:
            raise SceneError(
                f"{self.label}: position is {reach:g} m from the origin, too far for edges of {shortest:.3g} m in "
                "double precision; move the scene nearer to the origin"
            )


@dataclass(frozen=True, eq=False, kw_only=True)
class Body(PlacedBody):
    """One soft body of a scene; `PlacedBody` has its other parameters.

    Parameters
    ----------
    mesh : rest shape, in the body's own coordinates [m].
    material : one material, or `Regions`.
    skin : a finer surface, in the mesh's coordinates, that follows the body in pages and exports.
    collide : what touches other things: the surface of the "tets", or the "skin", closed and outward, which then may
        reach out of the tets. Pins, forces and loads act on the tets in both cases.

    Raises
    ------
    SceneError : where a value is of the wrong kind, not finite or out of range; the text names the body.
    """

    kind: ClassVar[str] = "body"

    mesh: Annotated[TetMesh, Instance((TetMesh,), "a TetMesh (see tetrahedralize)")] = field(kw_only=False)
    material: Annotated[Material, OneOf(MATERIALS, "a material such as StableNeoHookean(...)", Material)] = field(
        kw_only=False
    )
    skin: Annotated[SurfaceMesh | None, Instance((SurfaceMesh,), "a SurfaceMesh")] = None
    collide: Annotated[Literal["tets", "skin"], Choice(("tets", "skin"))] = "tets"

    def __post_init__(self) -> None:
        super().__post_init__()
        owner = self.label
        if self.collide == "skin" and self.skin is None:
            raise SceneError(f"{owner}: collide is 'skin', and it has no skin; give skin=SurfaceMesh(...)")
        if self.collide == "skin" and self.skin is not None:
            require_closed(self.skin, f"{owner}: skin")
            if self.skin.volume <= 0.0:
                raise SceneError(f"{owner}: skin: its surface is inside out; give surface.flipped()")
        self._check_placement(self.mesh.edges)
        self._require_one_value_per_tet(owner)

    def facts(self, scene: Any) -> str:
        mesh, kind = self.mesh, "tets" if self.mesh.order == 1 else "quadratic tets"
        amounts = f"{mesh.volume:.6g} m^3, {self.lumped_masses().sum():.6g} kg"
        return f"{self.material.facts(scene)}, {len(mesh.tets)} {kind}, {amounts}"

    @property
    def drawn_look(self) -> str:
        return self.look or ("foam" if float(np.mean(self.material.density)) < _FOAM else "rubber")

    @cached_property
    def touching(self) -> tuple[EmbeddedPoints, NDArray[np.int32]]:
        skin = self.attached_skin if self.touches_with_skin else None
        if skin is None:
            return super().touching
        return EmbeddedPoints.in_rows(skin.corners, skin.weights), skin.triangles

    @property
    def touches_with_skin(self) -> bool:
        return self.collide == "skin"

    def _require_one_value_per_tet(self, owner: str) -> None:
        try:
            self.material.per_tet(len(self.mesh.tets))
        except SceneError as error:
            raise SceneError(f"{owner}: {error}") from None
