"""The classes of all elastic materials: row k is the class whose energy has the kind k (see `kinds.py`)."""

from __future__ import annotations

from supple.materials.arap import ARAP
from supple.materials.fixed_corotated import FixedCorotated
from supple.materials.hyperelastic.holzapfel_gasser_ogden import HolzapfelGasserOgden
from supple.materials.hyperelastic.mooney_rivlin import MooneyRivlin
from supple.materials.hyperelastic.ogden import Ogden
from supple.materials.hyperelastic.yeoh import Yeoh
from supple.materials.material import Elastic, Hyperelastic
from supple.materials.neo_hookean import NeoHookean
from supple.materials.own.energy_material import EnergyMaterial
from supple.materials.st_venant_kirchhoff import StVenantKirchhoff
from supple.materials.stable_neo_hookean import StableNeoHookean

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
