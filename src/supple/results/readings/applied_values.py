"""What growths, muscles and loads are at the end of a step: what a recording needs to compute their works anew."""

from __future__ import annotations

from dataclasses import replace

from numpy.typing import NDArray

from supple.model.state import SolverDetails
from supple.model.system import System


def with_applied_values(details: SolverDetails, system: System, time: float) -> SolverDetails:
    """The details with the values of growths, muscles and loads at `time` [s]."""
    active = {f"{each.kind}.{k}": each.value for k, each in enumerate(system.laws_at(time).active)}
    vectors: dict[str, NDArray] = {}
    values: dict[str, float] = {}
    for k, load in enumerate(system.loads):
        value = load.value(time)
        if value is None:
            continue
        if value.ndim:
            vectors[f"{load.work}.{k}"] = value
        else:
            values[f"{load.work}.{k}"] = float(value)
    return replace(details, active=active, load_vectors=vectors, load_values=values)
