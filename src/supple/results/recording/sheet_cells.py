"""The triangles of shells, which follow the tets among the cells of a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from supple.mesh.surface import SurfaceMesh
from supple.scene.rows import BodyRows
from supple.scene.shell import Shell


@dataclass(frozen=True, eq=False)
class SheetCells:
    """Those of the shells among bodies."""

    bodies: Sequence[BodyRows]

    @cached_property
    def shells(self) -> list[BodyRows]:
        return [part for part in self.bodies if isinstance(part.body, Shell)]

    @cached_property
    def triangles(self) -> NDArray[np.int32]:
        """(t, 3) rows of the vertices of all bodies."""
        rows = [part.boundary + np.int32(part.vertices.start) for part in self.shells]
        return np.concatenate([np.zeros((0, 3), dtype=np.int32), *rows])

    @cached_property
    def owners(self) -> NDArray[np.int32]:
        """(t,) numbers of their bodies."""
        numbers, counts = [part.number for part in self.shells], [len(part.boundary) for part in self.shells]
        return np.repeat(np.array(numbers, dtype=np.int32), counts)

    def area_ratios(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(t,) areas at vertices x (n, 3) over those at rest [-]: what J is of tets."""
        return np.concatenate([np.zeros(0), *(area_ratios(part, x[part.vertices]) for part in self.shells)])

    def with_nothing(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values (m, ...) of tets, and NaN (m + t, ...) of these triangles."""
        return np.concatenate([values, np.full((len(self.triangles), *values.shape[1:]), np.nan)])


def area_ratios(shell: BodyRows, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """(t,) areas of the triangles of a shell at its vertices x (n, 3), over those at rest [-]."""
    areas = (np.linalg.norm(SurfaceMesh(p, shell.boundary).area_vectors, axis=1) for p in (x, shell.body.points))
    now, rest = areas
    return now / rest
