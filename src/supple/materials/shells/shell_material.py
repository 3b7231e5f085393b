"""The material of shells: moduli in the plane, thickness, bending stiffness."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from supple.kinds.validators import NON_NEGATIVE, POSITIVE, Choice, Number
from supple.materials.material import Material
from supple.materials.per_tet import NOT_ELASTIC, TetMaterial

MEMBRANES = ("neo_hookean", "st_venant_kirchhoff")


@dataclass(frozen=True, eq=False, kw_only=True)
class ShellMaterial(Material):
    """A thin isotropic sheet in plane stress, which stretches and bends.

    Parameters
    ----------
    youngs : Young's modulus E of small strains [Pa].
    poisson : Poisson's ratio nu [-], above -1 and at most 0.5, of an incompressible sheet.
    thickness : t at rest [m].
    bending : stiffness D in bending, the moment per length of a unit curvature [N m]. None: E t^3 / (12 (1 - nu^2)),
        that of a homogeneous sheet; woven cloth has less.
    membrane : energy of stretches in the plane, "neo_hookean", which goes to infinity where a triangle loses its area,
        or "st_venant_kirchhoff", which is quadratic in the Green strain and lets triangles collapse.
    density : mass density at rest [kg/m^3], above zero.
    damping : Kelvin-Voigt time tau [s]: the stress at strain e and strain rate e' is that of strain e + tau e', and
        the moment likewise. Acts on deformation only, never on rigid motion.

    Raises
    ------
    SceneError : where a value is not finite or out of range.

    Sources: the membrane is the compressible neo-Hookean material of Ogden (1984), section 7.2, whose thickness follows
    from plane stress; bending is Koiter's (1966).
    """

    youngs: Annotated[float, POSITIVE]
    poisson: Annotated[float, Number(above=-1.0, most=0.5)]
    thickness: Annotated[float, POSITIVE]
    bending: Annotated[float | None, NON_NEGATIVE] = None
    membrane: Annotated[Literal["neo_hookean", "st_venant_kirchhoff"], Choice(MEMBRANES)] = "neo_hookean"
    density: Annotated[float, POSITIVE] = 1000.0
    damping: Annotated[float, NON_NEGATIVE] = 0.0

    @property
    def mu(self) -> float:
        """Shear modulus [Pa]."""
        return self.youngs / (2.0 * (1.0 + self.poisson))

    @property
    def bending_stiffness(self) -> float:
        """D [N m]: `bending`, or that of a homogeneous sheet."""
        if self.bending is not None:
            return self.bending
        return self.youngs * self.thickness**3 / (12.0 * (1.0 - self.poisson**2))

    def facts(self, scene: Any) -> str:
        return f"{self.membrane} shell {self.thickness:.3g} m thick, bending stiffness {self.bending_stiffness:.3g} N m"

    def per_tet(self, n_tets: int) -> TetMaterial:
        return self._tet_material(n_tets, NOT_ELASTIC, 0.0, 0.0)
