"""The laws that recordings keep, by their names."""

from __future__ import annotations

from supple.materials.laws.fibres import FIBRES
from supple.materials.laws.hencky import HENCKY, MAXWELL
from supple.materials.laws.ogden import OGDEN
from supple.materials.laws.yeoh import YEOH
from supple.materials.per_tet import Law

RECORDED_LAWS: dict[str, Law] = {str(law.name): law for law in (OGDEN, YEOH, FIBRES, HENCKY, MAXWELL)}
