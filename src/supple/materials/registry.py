"""The classes of all elastic materials: row k is the class whose energy has the kind k (see `kinds.py`)."""

from __future__ import annotations

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
