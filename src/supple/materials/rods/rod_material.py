"""The material of rods: moduli and the radius of their round cross section."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

from supple.kinds.validators import NON_NEGATIVE, POSITIVE, Number
from supple.materials.material import Material
from supple.materials.per_tet import NOT_ELASTIC, TetMaterial


@dataclass(frozen=True, eq=False, kw_only=True)
class RodMaterial(Material):
    """An elastic rod with a round cross section, which stretches, bends and twists.

    Parameters
    ----------
    youngs : Young's modulus E of small strains [Pa].
    poisson : Poisson's ratio nu [-], above -1 and at most 0.5; it makes the stiffness in twist.
    radius : r of the cross section at rest [m].
    bending : stiffness B in bending, the moment of a unit curvature [N m^2]. None: E pi r^4 / 4, that of a solid rod;
        a rope of many fibres has less.
    density : mass density at rest [kg/m^3], above zero.
    damping : Kelvin-Voigt time tau [s]: the force at strain e and strain rate e' is that of strain e + tau e', and the
        moments likewise. Acts on deformation only, never on rigid motion.

    Raises
    ------
    SceneError : where a value is not finite or out of range.

    Source: Bergou et al., "Discrete Elastic Rods" (2008), section 4.
    """

    youngs: Annotated[float, POSITIVE]
    poisson: Annotated[float, Number(above=-1.0, most=0.5)] = 0.5
    radius: Annotated[float, POSITIVE]
    bending: Annotated[float | None, POSITIVE] = None
    density: Annotated[float, POSITIVE] = 1000.0
    damping: Annotated[float, NON_NEGATIVE] = 0.0

    @property
    def area(self) -> float:
        """Of the cross section [m^2]."""
        return math.pi * self.radius**2

    @property
    def bending_stiffness(self) -> float:
        """B [N m^2]: `bending`, or that of a solid rod."""
        return 0.25 * self.youngs * self.area * self.radius**2 if self.bending is None else self.bending

    @property
    def twisting_stiffness(self) -> float:
        """C = B / (1 + nu), which of a solid rod is G pi r^4 / 2: the torque of a unit twist [N m^2]."""
        return self.bending_stiffness / (1.0 + self.poisson)

    def facts(self, scene: Any) -> str:
        return f"rod of radius {self.radius:.3g} m, bending stiffness {self.bending_stiffness:.3g} N m^2"

    def per_tet(self, n_tets: int) -> TetMaterial:
        return self._tet_material(n_tets, NOT_ELASTIC, 0.0, 0.0)
