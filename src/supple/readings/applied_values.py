"""What growths, muscles and loads are at the end of a step: what a recording needs to compute their works anew."""

from __future__ import annotations

from dataclasses import replace

from numpy.typing import NDArray

from supple.state import SolverDetails
from supple.system import System


def with_applied_values(details: SolverDetails, system: System, time: float) -> SolverDetails:
    """The details with the values of growths, muscles and loads at `time` [s]."""
    active = {f"{each.kind}.{k}": each.value for k, each in enumerate(system.laws_at(time).active)}
    vectors: dict[str, NDArray] = {}
    values: dict[str, float] = {}
    for k, load in enumerate(system.loads):
        if load.pattern is None:
            continue
        if load.pattern.kind == "vector":
            vectors[f"{load.work}.{k}"] = load.value(time)
        else:
            values[f"{load.work}.{k}"] = float(load.value(time))
    return replace(details, active=active, load_vectors=vectors, load_values=values)
