"""One value for each tet, for coloring."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.laws import TetLaws
from supple.materials.elastic_tets.stress import (
    cauchy_of_tets,
    energy_densities,
    first_piolas,
    mean_deformation_gradients,
    volume_ratios,
    von_mises,
)
from supple.materials.flows.internal import NEVER_FLOWED

QUANTITIES = ("J", "von_mises", "energy")


@np.errstate(all="ignore")
def tet_values(
    laws: TetLaws, positions: NDArray[np.float64], quantity: str, internal: NDArray[np.float64] = NEVER_FLOWED
) -> NDArray[np.float64]:
    """(m,) of every tet: "J" [-], "von_mises" stress [Pa], or "energy" density per rest volume [J/m^3].

    internal : of the state, see `State`

    NaN where the tet has no law, or holds something rigid and a stress is asked for.
    """
    x = np.ascontiguousarray(positions)
    F = mean_deformation_gradients(laws, x)
    if quantity == "J":
        return volume_ratios(laws, x, F)
    if quantity == "energy":
        return energy_densities(laws, x, F, internal)
    return von_mises(cauchy_of_tets(laws, x, first_piolas(laws, x, F, internal), F, internal))
