"""The classes of all elastic materials: row k is the class whose energy has the kind k (see `kinds.py`)."""

from __future__ import annotations

from supple.materials.elastic import ARAP, FixedCorotated, NeoHookean, StableNeoHookean, StVenantKirchhoff
from supple.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from supple.materials.material import Elastic, Hyperelastic
from supple.materials.own.energy_material import EnergyMaterial
from supple.materials.rubber import MooneyRivlin, Ogden, Yeoh

ELASTIC_MATERIALS: tuple[type[Elastic], ...] = (
    StableNeoHookean,
    NeoHookean,
    FixedCorotated,
    ARAP,
    StVenantKirchhoff,
)

# Those that neither relax nor flow.
UNRELAXED: tuple[type[Hyperelastic], ...] = (
    *ELASTIC_MATERIALS,
    MooneyRivlin,
    Yeoh,
    Ogden,
    HolzapfelGasserOgden,
    EnergyMaterial,
)
