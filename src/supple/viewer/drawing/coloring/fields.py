"""Fields on tets for coloring."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.materials.material import Elastic
from supple.materials.per_tet import NO_REGION
from supple.numerics.deformation import determinants
from supple.viewer.drawing.moments.model import Moment
from supple.viewer.engine.measurement.tet_values import von_mises


@dataclass(frozen=True)
class Field:
    """A field with one value for each tet.

    Attributes
    ----------
    key : its name in messages of the simulation; name, unit : for the color bar
    center : the value of the middle color, or None where 0 is the lowest value
    measure : computes the values (m,), NaN where they are not known
    """

    key: str
    name: str
    unit: str
    center: float | None
    measure: Callable[[Moment], NDArray[np.float64]]

    def values(self, moment: Moment) -> NDArray[np.float64]:
        """Values (m,), NaN where they are not known: from the simulation, otherwise computed here."""
        known = moment.tet_values.get(self.key)
        return self.measure(moment) if known is None else known


def volume_ratio(moment: Moment) -> NDArray[np.float64]:
    """J = det F of every tet (m,)."""
    return determinants(moment.deformation_gradients)


def von_mises_stress(moment: Moment) -> NDArray[np.float64]:
    """Von Mises stress of every tet (m,) [Pa]."""
    return _of_materials(moment, lambda material, F: von_mises(material.first_piola(F), F, determinants(F)))


def energy_density(moment: Moment) -> NDArray[np.float64]:
    """Elastic energy per rest volume of every tet (m,) [J/m^3]; not known for those that are averaged over patches."""
    return _of_materials(moment, _own_energy_density)


def _own_energy_density(material: Elastic, F: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(material.per_tet(len(F)).region == NO_REGION, material.energy_density(F), np.nan)


@np.errstate(all="ignore")
def _of_materials(
    moment: Moment, compute: Callable[[Elastic, NDArray[np.float64]], NDArray[np.float64]]
) -> NDArray[np.float64]:
    """(m,) computed from the material of each body and its deformation gradients."""
    out = np.full(len(moment.model.tets), np.nan)
    for body in moment.model.bodies:
        if isinstance(body.material, Elastic):
            out[body.tets] = compute(body.material, moment.deformation_gradients[body.tets])
    return out


FIELDS = {
    field.name: field
    for field in (
        Field("J", "volume ratio J", "", 1.0, volume_ratio),
        Field("von_mises", "von Mises stress", "Pa", None, von_mises_stress),
        Field("energy", "energy density", "J/m³", None, energy_density),
    )
}
