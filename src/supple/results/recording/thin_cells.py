"""The triangles of shells and the edges of rods, which follow the tets among the cells of a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from supple.scene.rod import Rod
from supple.scene.rows import BodyRows
from supple.scene.shell import Shell


@dataclass(frozen=True, eq=False)
class ThinCells:
    """Those of the shells and rods among bodies."""

    bodies: Sequence[BodyRows]

    @cached_property
    def parts(self) -> list[tuple[BodyRows, NDArray[np.int32]]]:
        """Each of them, and its cells."""
        return [(part, cells) for part in self.bodies if (cells := thin_cells(part)) is not None]

    @cached_property
    def owners(self) -> NDArray[np.int32]:
        """(k,) numbers of the cells' bodies."""
        numbers, counts = [part.number for part, _ in self.parts], [len(cells) for _, cells in self.parts]
        return np.repeat(np.array(numbers, dtype=np.int32), counts)

    def ratios(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k,) see `ratios_of`, at vertices x (n, 3) of all bodies."""
        return np.concatenate([np.zeros(0), *(ratios_of(part, x[part.vertices]) for part, _ in self.parts)])

    def with_nothing(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values (m, ...) of tets, and NaN (m + k, ...) of these cells."""
        return np.concatenate([values, np.full((len(self.owners), *values.shape[1:]), np.nan)])


def thin_cells(part: BodyRows) -> NDArray[np.int32] | None:
    """(t, 3) triangles of a shell, or (e, 2) edges of a rod, rows of its own vertices; None of another body."""
    body = part.body
    return body.mesh.line if isinstance(body, Rod) else part.boundary if isinstance(body, Shell) else None


def ratios_of(part: BodyRows, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k,) areas of a shell's triangles, or lengths of a rod's edges, at its vertices x (n, 3), over those at rest [-]:
    what J is of tets."""
    cells = thin_cells(part)
    assert cells is not None
    now, rest = (np.diff(points[cells], axis=1).transpose(1, 0, 2) for points in (x, part.body.points))
    sizes = [np.linalg.norm(np.cross(*sides) if len(sides) == 2 else sides[0], axis=1) for sides in (now, rest)]
    return sizes[0] / sizes[1]
