"""What a recording keeps of cavities and cables: what they act on. Their pressures and tensions are in the details."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.results.recording.checked_hdf5 import CheckedFile

_GROUP = "supple/physics"


@dataclass(frozen=True, eq=False)
class RecordedCavity:
    """A cavity; triangles : (t, 3) vertices of the surface around it, seen counter-clockwise from inside."""

    name: str
    triangles: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class RecordedCable:
    """A cable through points W x + offset, of some vertices.

    Attributes
    ----------
    vertices : (v,); weights : (p, v); offsets : (p, 3) [m]
    """

    name: str
    vertices: NDArray[np.int32]
    weights: NDArray[np.float64]
    offsets: NDArray[np.float64]


def write_actuators(group: h5py.Group, system: System) -> list[dict[str, str]]:
    """Write the arrays to the group of the physics; returns the entries of the header, one for each actuator."""
    for k, each in enumerate(system.actuators):
        for name, values in each.coordinate.described().items():
            group[f"actuator_{k}/{name}"] = values
    return [{"kind": each.kind, "name": each.name} for each in system.actuators]


def read_actuators(
    file: CheckedFile, header: dict[str, Any], vertices: int
) -> tuple[tuple[RecordedCavity, ...], tuple[RecordedCable, ...]]:
    """The cavities and the cables.

    Raises
    ------
    OutputError : where the data are contradictory.
    """
    cavities, cables = [], []
    for k, entry in enumerate(header["physics"]["actuators"]):
        try:
            kind, name = entry["kind"], str(entry["name"])
        except (KeyError, TypeError):
            raise file.broken("its cavities and cables are not described as they should be") from None
        own = f"{_GROUP}/actuator_{k}"
        if kind == "cavity":
            cavities.append(RecordedCavity(name, file.indices(f"{own}/triangles", 3, vertices)))
        elif kind == "cable":
            rows = np.ascontiguousarray(file.indices(f"{own}/vertices", 1, vertices)[:, 0])
            weights = file.array(f"{own}/weights", "f", (None, len(rows)))
            offsets = file.array(f"{own}/offsets", "f", (len(weights), 3))
            if len(weights) < 2 or not (np.isfinite(weights).all() and np.isfinite(offsets).all()):
                raise file.broken("a cable has no span, or a number of it is not finite")
            cables.append(RecordedCable(name, rows, weights, offsets))
        else:
            raise file.of_another_version(f"an actuator has the unknown kind {kind!r}")
    return tuple(cavities), tuple(cables)
