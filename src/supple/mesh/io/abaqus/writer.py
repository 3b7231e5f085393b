"""Writing a tet mesh as an Abaqus deck of one part."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def written(vertices: NDArray[np.float64], tets: NDArray[np.int32]) -> bytes:
    """One part with its nodes and elements, and the set ALL of the latter."""
    name = "C3D4" if tets.shape[1] == 4 else "C3D10"
    out = ["*HEADING", "written by supple", "*NODE"]
    out += [f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(vertices.tolist(), start=1)]
    out.append(f"*ELEMENT, TYPE={name}, ELSET=ALL")
    out += [f"{k}, " + ", ".join(str(i + 1) for i in row) for k, row in enumerate(tets.tolist(), start=1)]
    return ("\n".join(out) + "\n").encode()
