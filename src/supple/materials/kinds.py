"""The energies of all elastic materials, and the number by which kernels know each.

A new material is one file in `stretch_energies/` and one line here, and its class in `elastic.py`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.materials.per_tet import TetMaterial
from supple.materials.stretch_energies import (
    arap,
    fixed_corotated,
    neo_hookean,
    st_venant_kirchhoff,
    stable_neo_hookean,
)
from supple.materials.stretch_energies.stretches import StretchFunctions, no_volume_term

STRETCH_ENERGIES: tuple[StretchFunctions, ...] = (
    stable_neo_hookean.FUNCTIONS,
    neo_hookean.FUNCTIONS,
    fixed_corotated.FUNCTIONS,
    arap.FUNCTIONS,
    st_venant_kirchhoff.FUNCTIONS,
)


def needs_positive_volume(kind: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(m,) whether the energy of each tet's material is infinite for J <= 0, from its kind (m,)."""
    wanted = [k for k, energy in enumerate(STRETCH_ENERGIES) if energy.needs_positive_volume]
    return np.isin(kind, wanted)


def has_volume_term(kind: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(m,) whether lam is the factor of a function of J alone in the energy of a tet, from its kind (m,)."""
    return np.isin(kind, [k for k, energy in enumerate(STRETCH_ENERGIES) if energy.volume_term is not no_volume_term])


def without_inversion(material: TetMaterial) -> NDArray[np.bool_]:
    """(m,) whether a tet has no energy for J <= 0."""
    refused = needs_positive_volume(material.kind)
    for tets in material.laws:
        refused[tets.rows] = True
    return refused


def infinite_when_flat(material: TetMaterial) -> NDArray[np.bool_]:
    """(m,) whether the energy of a tet goes to infinity wherever J goes to zero."""
    infinite = needs_positive_volume(material.kind)
    for tets in material.laws:
        if tets.law.infinite_when_flat:
            infinite[tets.rows] = True
    return infinite
