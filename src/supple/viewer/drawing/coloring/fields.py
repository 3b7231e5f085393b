"""Numbers of every tet that the page can color by."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.diagnostics import determinants
from supple.materials.material import Elastic
from supple.viewer.drawing.moments.model import Moment


@dataclass(frozen=True)
class Field:
    """Something to color by.

    Attributes
    ----------
    key : what simulations call it; name, unit : as they stand at the color bar
    center : what the middle color means, or None where 0 is the lowest
    measure : of every tet (m,), NaN where it is not known
    """

    key: str
    name: str
    unit: str
    center: float | None
    measure: Callable[[Moment], NDArray[np.float64]]

    def values(self, moment: Moment) -> NDArray[np.float64]:
        """Of every tet (m,), NaN where it is not known: as the simulation says, or else measured here."""
        known = moment.tet_values.get(self.key)
        return self.measure(moment) if known is None else known


def volume_ratio(moment: Moment) -> NDArray[np.float64]:
    """J = det F of every tet (m,)."""
    return determinants(moment.deformation_gradients)


@np.errstate(all="ignore")
def von_mises_stress(moment: Moment) -> NDArray[np.float64]:
    """Of the Cauchy stress sigma = P F^T / J of every tet (m,) [Pa]: sqrt(3/2 s : s) with s its deviator."""
    out = np.full(len(moment.model.tets), np.nan)
    J = volume_ratio(moment)
    for body in moment.model.bodies:
        if isinstance(body.material, Elastic):
            F = moment.deformation_gradients[body.tets]
            sigma = body.material.first_piola(F) @ np.swapaxes(F, 1, 2) / J[body.tets, None, None]
            deviator = sigma - np.trace(sigma, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
            out[body.tets] = np.sqrt(1.5 * np.einsum("eij,eij->e", deviator, deviator))
    return out


@np.errstate(all="ignore")
def energy_density(moment: Moment) -> NDArray[np.float64]:
    """Elastic energy per volume at rest of every tet (m,) [J/m^3]."""
    out = np.full(len(moment.model.tets), np.nan)
    for body in moment.model.bodies:
        if isinstance(body.material, Elastic):
            out[body.tets] = body.material.energy_density(moment.deformation_gradients[body.tets])
    return out


FIELDS = {
    field.name: field
    for field in (
        Field("J", "volume ratio J", "", 1.0, volume_ratio),
        Field("von_mises", "von Mises stress", "Pa", None, von_mises_stress),
        Field("energy", "energy density", "J/m³", None, energy_density),
    )
}
