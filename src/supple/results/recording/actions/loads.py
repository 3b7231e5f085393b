"""What a recording keeps of loads whose forces follow from one value at a time; each frame has these values.

`SolverDetails.load_vectors` and `load_values` have the values, by the name of the work and the number of the load.
"""

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
class RecordedLoad:
    """How the forces of a load follow from one value at a time.

    Attributes
    ----------
    kind : "vector", a force w_i f on each vertex, with the value f (3,); "pressure", a third of -p A on each corner of
        a triangle of area vector A, with the value p; "spring", the forces of k / 2 (l - l0)^2,
        l = |sum w_i x_i + offset|, with the value l0; "drag", as of `LoadPattern`
    work : the name of its work
    vertices : (v,), or (t, 3) triangles of a pressure or a drag; weights : (v,) w; of no meaning for triangles
    offset : (3,) [m]; stiffness : k [N/m]; of a drag, density times coefficient [kg/m^3]
    """

    kind: str
    work: str
    vertices: NDArray[np.int32]
    weights: NDArray[np.float64]
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stiffness: float = 0.0


def write_loads(group: h5py.Group, system: System) -> list[dict[str, Any]]:
    """Write the arrays to the group of the physics; returns the entries of the header, one for each load."""
    entries = []
    for k, load in enumerate(system.loads):
        pattern = load.pattern
        if pattern is None:
            entries.append({"kind": None, "work": load.work})
            continue
        vertices = pattern.vertices
        group[f"load_{k}/vertices"] = vertices if vertices.ndim == 2 else vertices[:, None]
        group[f"load_{k}/weights"] = pattern.weights
        own = {"kind": pattern.kind, "offset": list(pattern.offset), "stiffness": float(pattern.stiffness)}
        entries.append({"work": load.work, **own})
    return entries


def read_loads(
    file: CheckedFile, header: dict[str, Any], vertices: int
) -> tuple[dict[str, RecordedLoad], frozenset[str]]:
    """By the name of their values, the loads with a pattern; and the works of loads that have none.

    Raises
    ------
    OutputError : where the data are contradictory.
    """
    patterns, others = {}, set()
    for k, entry in enumerate(header["physics"]["loads"]):
        try:
            kind, work = entry["kind"], str(entry["work"])
            if kind is None:
                others.add(work)
                continue
            x, y, z = map(float, entry["offset"])
            stiffness = float(entry["stiffness"])
        except (KeyError, TypeError, ValueError):
            raise file.broken("its loads are not described as they should be") from None
        if kind not in ("vector", "pressure", "spring", "drag"):
            raise file.of_another_version(f"a load has the unknown kind {kind!r}")
        columns = 3 if kind in ("pressure", "drag") else 1
        rows = file.indices(f"{_GROUP}/load_{k}/vertices", columns, vertices)
        weights = file.array(f"{_GROUP}/load_{k}/weights", "f", (len(rows),))
        if not np.isfinite([*weights, x, y, z, stiffness]).all():
            raise file.broken("a number of a load is not finite")
        rows = rows if columns == 3 else np.ascontiguousarray(rows[:, 0])
        patterns[f"{work}.{k}"] = RecordedLoad(kind, work, rows, weights, (x, y, z), stiffness)
    return patterns, frozenset(others)
