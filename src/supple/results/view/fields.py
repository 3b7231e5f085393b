"""Fields on tets for coloring."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.numerics.deformation import determinants
from supple.results.readings.tet_values import tet_values
from supple.results.view.model import Moment


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
    return _of_laws(moment, "von_mises")


def energy_density(moment: Moment) -> NDArray[np.float64]:
    """Elastic energy per rest volume of every tet (m,) [J/m^3]."""
    return _of_laws(moment, "energy")


def _of_laws(moment: Moment, quantity: str) -> NDArray[np.float64]:
    laws = moment.laws
    if laws is None:
        return np.full(len(moment.model.tets), np.nan)
    return tet_values(laws, moment.positions, quantity, moment.internal)


FIELDS = {
    field.name: field
    for field in (
        Field("J", "volume ratio J", "", 1.0, volume_ratio),
        Field("von_mises", "von Mises stress", "Pa", None, von_mises_stress),
        Field("energy", "energy density", "J/m^3", None, energy_density),
    )
}
