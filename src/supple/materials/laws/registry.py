"""The laws and the flows that recordings keep, by their names."""

from __future__ import annotations

from supple.materials.laws.fibres import FIBRES
from supple.materials.laws.hencky import HENCKY, MAXWELL
from supple.materials.laws.j2 import J2_FLOW
from supple.materials.laws.maxwell import MAXWELL_FLOW
from supple.materials.laws.ogden import OGDEN
from supple.materials.laws.yeoh import YEOH
from supple.materials.per_tet import Flow, Law

RECORDED_LAWS: dict[str, Law] = {str(law.name): law for law in (OGDEN, YEOH, FIBRES, HENCKY, MAXWELL)}


RECORDED_FLOWS: dict[str, Flow] = {flow.name: flow for flow in (MAXWELL_FLOW, J2_FLOW)}
