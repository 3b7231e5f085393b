"""The energy that a shell stores, from its recorded material: the check's own sum.

The membrane's follows from the sides of triangles alone: C in the basis of two sides is g_0^-1 g, with their inner
products g, and g_0 at rest. Bending is the least energy of the turns of edges against the planes of their triangles:
those of two triangles at an edge sum to the angle between them, those at a boundary edge are free, and those of a
triangle that is held are zero. (The solver has the moments of the same minimum, see `supple.materials.shells`.)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from supple.materials.shells.shell_material import ShellMaterial

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StoredByShell:
    """A shell; rest : (n, 3) [m]; triangles : (t, 3); held : (t,) which of them one thing holds at all corners."""

    rest: Floats
    triangles: NDArray[np.int64]
    material: ShellMaterial
    held: NDArray[np.bool_]

    def energy(self, x: Floats) -> float:
        """[J] at positions (n, 3) of its vertices."""
        return self._stretched(x) + (self._bent(x) if self.material.bending_stiffness > 0.0 else 0.0)

    def least_ratio(self, x: Floats) -> float:
        """The smallest area of a triangle over that at rest [-]."""
        areas = np.sqrt(np.maximum(np.linalg.det(_products(x[self.triangles])), 0.0))
        return float((0.5 * areas / self._areas).min())

    @property
    def scale(self) -> float:
        """Its modulus times its volume [J]."""
        return self.material.youngs * self.material.thickness * float(self._areas.sum())

    @cached_property
    def _areas(self) -> Floats:
        return 0.5 * np.sqrt(np.linalg.det(_products(self.rest[self.triangles])))

    def _stretched(self, x: Floats) -> float:
        m = self.material
        mixed = np.linalg.solve(_products(self.rest[self.triangles]), _products(x[self.triangles]))
        trace, det = np.trace(mixed, axis1=1, axis2=2), np.linalg.det(mixed)
        a = m.poisson / (1.0 - m.poisson)
        if m.membrane == "neo_hookean":
            psi = trace - 2.0 + (-np.log(det) if a == 0.0 else (det**-a - 1.0) / a)
            psi *= 0.5 * m.mu
        else:
            psi = m.mu * (0.25 * (trace**2 - 2.0 * det - 2.0 * trace + 2.0) + 0.25 * a * (trace - 2.0) ** 2)
        return m.thickness * float(self._areas @ psi)

    def _bent(self, x: Floats) -> float:
        first, second, to_turns, of_free, factors = self._edges
        turns = np.zeros(self.triangles.size)
        angles = self._angles(x, first, second) - self._angles(self.rest, first, second)
        turns[second] = angles
        held = self.held[first // 3]
        turns[first[held]], turns[second[held]] = 0.0, angles[held]
        held = self.held[second // 3]
        turns[first[held]], turns[second[held]] = angles[held], 0.0
        forces = to_turns @ turns
        free = of_free.T @ forces
        given = float(free @ factors.solve(free)) if len(free) else 0.0
        return 0.5 * (float(turns @ forces) - given)

    @cached_property
    def _edges(self) -> tuple[NDArray[np.int64], NDArray[np.int64], Any, Any, Any]:
        """The sides 3 t + k of both triangles at inner edges, which are not both held; the matrix of the energy in the
        turns of all sides; and the turns that are free, with the factors of the matrix in these."""
        start, end = self.triangles.ravel(), np.roll(self.triangles, -1, axis=1).ravel()
        side = {(int(i), int(j)): row for row, (i, j) in enumerate(zip(start, end, strict=True))}
        pairs = [(row, side[j, i]) for (i, j), row in side.items() if i < j and (j, i) in side]
        pairs = [(p, q) for p, q in pairs if not (self.held[p // 3] and self.held[q // 3])]
        first, second = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
        inner = np.zeros(len(start), dtype=bool)
        inner[first] = inner[second] = True
        free_pairs = np.flatnonzero(~self.held[first // 3] & ~self.held[second // 3])
        alone = np.flatnonzero(~inner & ~self.held[np.arange(len(start)) // 3])
        rows = np.concatenate([first[free_pairs], second[free_pairs], alone])
        number = np.arange(len(free_pairs))
        columns = np.concatenate([number, number, len(number) + np.arange(len(alone))])
        signs = np.concatenate([np.ones(len(number)), -np.ones(len(number)), np.ones(len(alone))])
        of_free = csc_array((signs, (rows, columns)), shape=(len(start), len(number) + len(alone)))
        to_turns = self._stiffness()
        factors = splu((of_free.T @ to_turns @ of_free).tocsc()) if len(rows) else None
        return first, second, to_turns, of_free, factors

    def _stiffness(self) -> Any:
        """D A ((1 - nu) S : S' + nu tr S tr S') of the curvatures S of a unit turn of each side, by triangle."""
        corners = self.rest[self.triangles]
        sides = np.roll(corners, -1, axis=1) - corners
        lengths = np.linalg.norm(sides, axis=2)
        cosines = np.einsum("tki,tli->tkl", sides, sides) / (lengths[:, :, None] * lengths[:, None, :])
        nu, scaled = self.material.poisson, lengths / self._areas[:, None]
        kept = (1.0 - nu) * cosines**2 + nu
        blocks = self._areas[:, None, None] * kept * scaled[:, :, None] * scaled[:, None, :]
        blocks *= self.material.bending_stiffness
        blocks[self.held] = 0.0
        number = np.arange(self.triangles.size).reshape(-1, 3)
        rows, columns = np.broadcast_arrays(number[:, :, None], number[:, None, :])
        shape = self.triangles.size, self.triangles.size
        return csc_array((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=shape)

    def _angles(self, x: Floats, first: NDArray[np.int64], second: NDArray[np.int64]) -> Floats:
        """(e,) between the normals at inner edges, positive where a surface is bent towards its back."""
        corners = x[self.triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        n, m = normals[first // 3], normals[second // 3]
        towards = x[self.triangles.ravel()[second]] - x[self.triangles.ravel()[first]]
        towards /= np.linalg.norm(towards, axis=1)[:, None]
        return np.arctan2(np.einsum("ei,ei->e", np.cross(n, m), towards), np.einsum("ei,ei->e", n, m))


def _products(corners: Floats) -> Floats:
    """(t, 2, 2) inner products of two sides of triangles with corners (t, 3, 3)."""
    sides = corners[:, 1:] - corners[:, :1]
    return sides @ np.swapaxes(sides, 1, 2)
