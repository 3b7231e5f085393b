"""All elastic materials, and the number by which kernels know each. A new material is one file, and one line here."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.materials.arap import ARAP
from supple.materials.fixed_corotated import FixedCorotated
from supple.materials.material import Elastic
from supple.materials.neo_hookean import NeoHookean
from supple.materials.st_venant_kirchhoff import StVenantKirchhoff
from supple.materials.stable_neo_hookean import StableNeoHookean

ELASTIC_MATERIALS: tuple[type[Elastic], ...] = (
    StableNeoHookean,
    NeoHookean,
    FixedCorotated,
    ARAP,
    StVenantKirchhoff,
)


def needs_positive_volume(kind: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(m,) whether each tet's material has no energy for J <= 0, from its kind (m,)."""
    wanted = [k for k, material in enumerate(ELASTIC_MATERIALS) if material.needs_positive_volume]
    return np.isin(kind, wanted)


def kind_of(material: type[Elastic]) -> int:
    """The number by which kernels know a material's class, or the class that it takes its stretch functions from.

    Raises
    ------
    SceneError : where the class is not registered.
    """
    for kind, registered in enumerate(ELASTIC_MATERIALS):
        if material.stretch_functions is registered.stretch_functions:
            return kind
    raise SceneError(f"{material.__name__} is not registered; add it to ELASTIC_MATERIALS in {__name__}")
