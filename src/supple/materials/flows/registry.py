"""The flows that recordings know, by their names."""

from __future__ import annotations

from supple.materials.flows.j2 import J2_FLOW
from supple.materials.flows.maxwell import MAXWELL_FLOW
from supple.materials.per_tet import Flow

RECORDED_FLOWS: dict[str, Flow] = {flow.name: flow for flow in (MAXWELL_FLOW, J2_FLOW)}
