"""A rigid body: a solid with a mass, its placement and its initial velocity.

Its four control points move; they are the vertices of one tet (see `ControlPoints`). The energy

    kappa V |F^T F - 1|^2

of that tet, with the body's volume V, keeps it rigid. With the Green strain E = (F^T F - 1) / 2 this is
4 kappa V |E|^2, which is St. Venant-Kirchhoff's energy of the tet's volume V_t for mu = 4 kappa V / V_t and lam = 0.
The points of its surface are combinations of the control points. They touch, are drawn, and have positions in a frame.

Source: Lan et al., "Affine Body Dynamics" (2022), section 3.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.validators import POSITIVE, Instance, Vector
from supple.materials.elastic import StVenantKirchhoff
from supple.materials.material import Material
from supple.mesh.skin import Skin
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.scene.body import PlacedBody
from supple.scene.rigid.mass_properties import Inertia, MassProperties, of_solid, with_inertia, with_mass
from supple.scene.rigid.pose import deformation_of

_CORNERS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0]])


class ControlPoints(NamedTuple):
    """The control points, and the points of a surface as combinations of them.

    An affine motion x = A X + t is that of four points, and every point of the body is a combination of them. They lie
    at

        c + S^(1/2) v_k,   v = (1, 1, 1), (1, -1, -1), (-1, -1, 1), (-1, 1, -1),

    with the center c and the second moment per mass S, and each has a quarter of the mass. Since sum v_k = 0 and
    sum v_k v_k^T = 4 1, their mass, center and second moment are the body's, and so are the kinetic energy, the
    momentum and the angular momentum of every affine motion.

    Source: Lan et al., "Affine Body Dynamics" (2022), section 3, with points instead of the coefficients A and t.

    Attributes
    ----------
    mesh : one tet with the control points as its vertices
    weights : (s, 4); each row sums to 1
    """

    mesh: TetMesh
    weights: NDArray[np.float64]


def control_points(properties: MassProperties, surface: NDArray[np.float64]) -> ControlPoints:
    """The control points of a body, and the weights of points (s, 3) given in its own coordinates [m]."""
    squares, axes = np.linalg.eigh(properties.second_moment / properties.mass)
    lengths = np.sqrt(squares)
    root, inverse = (axes * lengths) @ axes.T, (axes / lengths) @ axes.T
    mesh = TetMesh(properties.center + _CORNERS @ root, [[0, 1, 2, 3]])
    return ControlPoints(mesh, 0.25 + 0.25 * (surface - properties.center) @ inverse @ _CORNERS.T)


# Positions that are given for the surface must be a rigid motion of it, up to round-off in what a user computed and the
# orthogonality error of a solver.
_MISFIT = 1e-6
_STRAIN = 1e-2


@dataclass(frozen=True, eq=False, kw_only=True)
class RigidBody(PlacedBody):
    """One rigid body of a scene; `PlacedBody` has its other parameters.

    Parameters
    ----------
    shape : a closed surface that faces outwards, or a tet mesh, whose surface is then used; in the body's own
        coordinates [m].
    density : [kg/m^3].
    mass : instead of `density` [kg].
    inertia : about the center of mass, in the body's own coordinates, (3, 3) or its diagonal (3,) [kg m^2]; needs
        `mass`. None: that of a homogeneous solid, exact for the given triangles or tets.
    center : (3,) of mass, in the body's own coordinates [m]; needs `inertia`. None: that of a homogeneous solid.
    stiffness : kappa [Pa] of the energy that keeps the body rigid in `Implicit`; in `XPBD` it is exactly rigid. None:
        from the heaviest load of the scene, see `supple.scene.rigid.stiffness` and docs/theory/rigid_bodies.md.

    Attributes
    ----------
    kappa : `stiffness`, or that of its scene [Pa]
    surface : the shape's surface, without vertices that no triangle uses
    properties : mass, center of mass and second moment
    mesh, material : the tet of the control points, and the energy that keeps it rigid

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range, a surface is open, inside out or flat, or no body
        has the inertia; the text names the body.
    """

    kind: ClassVar[str] = "rigid_body"
    exactly_one: ClassVar[tuple[str, ...]] = ("density", "mass")

    shape: Annotated[SurfaceMesh | TetMesh, Instance((SurfaceMesh, TetMesh), "a SurfaceMesh or a TetMesh")] = field(
        kw_only=False
    )
    density: Annotated[float | None, POSITIVE] = None
    mass: Annotated[float | None, POSITIVE] = None
    inertia: Annotated[ArrayLike | None, Inertia()] = None
    center: Annotated[ArrayLike | None, Vector()] = None
    stiffness: Annotated[float | None, POSITIVE] = None
    kappa: float = field(init=False, repr=False)
    surface: SurfaceMesh = field(init=False, repr=False)
    properties: MassProperties = field(init=False, repr=False)
    mesh: TetMesh = field(init=False, repr=False)
    material: Material = field(init=False, repr=False)
    skin: SurfaceMesh = field(init=False, repr=False)
    weights: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        owner = self.label
        properties = self._properties(owner)
        if isinstance(self.shape, TetMesh) and self.shape.order == 2:
            raise SceneError(f"{owner}: shape has quadratic tets; give its surface or mesh.to_order(1)")
        surface = (self.shape.surface if isinstance(self.shape, TetMesh) else self.shape).compact()
        control = control_points(properties, surface.vertices)
        # The drawn surface is the one that touches.
        derived = {"surface": surface, "skin": surface, "properties": properties}
        for key, value in (derived | {"mesh": control.mesh, "weights": control.weights}).items():
            object.__setattr__(self, key, value)
        self._check_placement(surface.edges)
        self._set_stiffness(self.stiffness or 1.0)  # without one, a scene sets it, from its heaviest load

    def facts(self, scene: Any) -> str:
        p = self.properties
        inertia = ", ".join(f"{value:.6g}" for value in np.linalg.eigvalsh(p.inertia))
        return (
            f"rigid, {len(self.triangles)} triangles, {p.volume:.6g} m^3, {p.mass:.6g} kg, principal moments of "
            f"inertia {inertia} kg m^2, stiffness {self.kappa:.3g} Pa"
        )

    @property
    def points(self) -> NDArray[np.float64]:
        """(s, 3) the surface's vertices, in the body's own coordinates [m]."""
        return self.surface.vertices

    @property
    def triangles(self) -> NDArray[np.int32]:
        """(t, 3) the surface's triangles."""
        return self.surface.triangles

    @property
    def embedded(self) -> EmbeddedPoints:
        """The surface's vertices as combinations of the control points."""
        corners = np.broadcast_to(np.arange(4, dtype=np.int32), (len(self.weights), 4))
        return EmbeddedPoints.in_rows(corners, self.weights)

    @cached_property
    def attached_skin(self) -> Skin:
        corners = np.tile(np.arange(4, dtype=np.int32), (len(self.weights), 1))
        return Skin(corners, self.weights, self.surface.triangles)

    @property
    def touches_with_skin(self) -> bool:
        return True

    def weights_of(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, 4) the weights of the control points in places (k, 3), given in the body's own coordinates [m]."""
        return control_points(self.properties, places).weights

    def with_stiffness(self, kappa: float) -> RigidBody:
        """The same body, kept rigid by another kappa [Pa]."""
        other = copy(self)
        other._set_stiffness(kappa)
        return other

    def control_values(self, values: NDArray[np.float64], what: str, *, places: bool) -> NDArray[np.float64]:
        """The control points' positions, or velocities, (4, 3) from those of the surface's vertices (s, 3).

        Parameters
        ----------
        places : whether the values are positions, which must be those of a rigid motion

        Raises
        ------
        SceneError : where the values are not those of one rigid body; the text begins with `what`.
        """
        found = np.linalg.lstsq(self.weights, values, rcond=None)[0].astype(np.float64)
        misfit = float(np.abs(self.weights @ found - values).max())
        F = deformation_of(self.mesh.vertices, found)
        deformed = places and (np.abs(F.T @ F - np.eye(3)).max() > _STRAIN or np.linalg.det(F) < 0.0)
        size = float(np.ptp(values, axis=0).max() if places else np.abs(values).max())
        if misfit > _MISFIT * size or deformed:
            raise SceneError(f"{what} is not a rigid motion of its surface; give those of all its vertices in one")
        return found

    def _properties(self, owner: str) -> MassProperties:
        solid = of_solid(self.shape, owner)
        if self.mass is None:
            if self.inertia is not None:
                raise SceneError(f"{owner}: inertia needs a mass [kg] instead of the density; give mass=...")
            if self.center is not None:
                raise SceneError(f"{owner}: center needs a mass and an inertia; give both")
            return with_mass(solid, solid.volume * (self.density or 0.0), owner)
        if self.inertia is None and self.center is not None:
            raise SceneError(f"{owner}: center needs an inertia [kg m^2] about it; give inertia=...")
        homogeneous = with_mass(solid, self.mass, owner)
        if self.inertia is None:
            return homogeneous
        properties = with_inertia(homogeneous, self.mass, self.inertia, owner)
        if self.center is None:
            return properties
        return replace(properties, center=self.center)

    def _set_stiffness(self, kappa: float) -> None:
        object.__setattr__(self, "kappa", kappa)
        volume = self.mesh.volume
        youngs = 8.0 * kappa * self.properties.volume / volume  # E = 2 mu where nu = 0
        material = StVenantKirchhoff(youngs=youngs, poisson=0.0, density=self.properties.mass / volume)
        object.__setattr__(self, "material", material)
