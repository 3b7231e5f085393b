"""The classes of all elastic materials: row k is the class whose energy has the kind k (see `kinds.py`)."""

from __future__ import annotations

from supple.materials.elastic import ARAP, FixedCorotated, NeoHookean, StableNeoHookean, StVenantKirchhoff
from supple.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from supple.materials.laws.fibres import FIBRES
from supple.materials.laws.hencky import HENCKY, MAXWELL
from supple.materials.laws.j2 import J2_FLOW
from supple.materials.laws.maxwell import MAXWELL_FLOW
from supple.materials.laws.ogden import OGDEN
from supple.materials.laws.yeoh import YEOH
from supple.materials.material import Elastic, Hyperelastic
from supple.materials.own.energy_material import EnergyMaterial
from supple.materials.per_tet import Flow, Law
from supple.materials.rubber import MooneyRivlin, Ogden, Yeoh

RECORDED_LAWS: dict[str, Law] = {str(law.name): law for law in (OGDEN, YEOH, FIBRES, HENCKY, MAXWELL)}


RECORDED_FLOWS: dict[str, Flow] = {flow.name: flow for flow in (MAXWELL_FLOW, J2_FLOW)}


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
