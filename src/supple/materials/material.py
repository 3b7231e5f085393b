"""What every material says of itself: its density, its damping, and the checks of what a user typed."""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.materials.lame import lame_from_engineering


@dataclass(frozen=True, eq=False, kw_only=True)
class Material(ABC):
    """Base of all materials.

    Parameters
    ----------
    density : mass density at rest [kg/m^3], above zero.
    damping : Kelvin-Voigt time tau [s]: the stress at strain e and strain rate e' is that of strain e + tau e'.
        Acts on deformation only, never on rigid motion.
    """

    density: float = 1000.0
    damping: float = 0.0

    def __post_init__(self) -> None:
        self._require_finite("density", positive=True, unit="kg/m^3")
        self._require_finite("damping", positive=False, unit="s")

    def _require_finite(self, field: str, *, positive: bool, unit: str) -> None:
        value = getattr(self, field)
        kind = type(self).__name__
        try:
            values = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise SceneError(f"{kind}: {field} is {value!r}; give a number in {unit}") from None
        if values.ndim > 1:
            raise SceneError(f"{kind}: {field} has shape {values.shape}; give one number, or one per tetrahedron")
        low = values <= 0.0 if positive else values < 0.0
        bad = ~np.isfinite(values) | low
        if bad.any():
            first = values.reshape(-1)[np.flatnonzero(bad.reshape(-1))[0]]
            at = f" (tet {np.flatnonzero(bad)[0]})" if values.ndim else ""
            must = "above zero" if positive else "zero or more"
            raise SceneError(f"{kind}: {field} is {first:g}{at}; it must be finite and {must} [{unit}]")


@dataclass(frozen=True, eq=False, kw_only=True)
class Elastic(Material):
    """A hyperelastic material given by its engineering constants.

    Parameters
    ----------
    youngs : Young's modulus E of small strains [Pa]; one number, or one per tetrahedron of the body.
    poisson : Poisson's ratio nu [-], from above -1 to below 0.5; one number, or one per tetrahedron.

    Raises
    ------
    SceneError : where a value is not finite or out of range.
    """

    youngs: float | NDArray[np.float64]
    poisson: float | NDArray[np.float64]

    def __post_init__(self) -> None:
        super().__post_init__()
        self._require_finite("youngs", positive=True, unit="Pa")
        kind = type(self).__name__
        try:
            nu = np.atleast_1d(np.asarray(self.poisson, dtype=np.float64))
        except (TypeError, ValueError):
            raise SceneError(f"{kind}: poisson is {self.poisson!r}; give a number from 0 to below 0.5") from None
        bad = ~((nu > -1.0) & (nu < 0.5))
        if bad.any():
            raise SceneError(
                f"{kind}: poisson is {nu[bad][0]:g}; it must be above -1 and below 0.5 (0.49 is nearly incompressible)"
            )

    def lame_parameters(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The mu and lam [Pa] that stand in this material's own energy density (scalars or per tet)."""
        return lame_from_engineering(self.youngs, self.poisson)
