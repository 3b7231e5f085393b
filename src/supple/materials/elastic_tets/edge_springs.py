"""Bodies of edges and volumes: energy and stress of their tets.

The energy is 1/2 C^2 / alpha for each edge, C = l - l0, and each tet, C = V - V0. An edge belongs to its tets in
proportion to their rest volumes, with shares s that add up to 1. For an edge with the rest vector X and the unit vector
d along it, the motion of its ends changes l by d . dF X in each of these tets. The virtual work is sum V_e P : dF with

    P = 1 / V_e sum s (C / alpha) d X^T + p cof F,    p = (V - V0) / alpha,

the first sum over the six edges of a tet: a stress whose nodal forces are exactly those of edges and volumes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


@dataclass(frozen=True, eq=False)
class EdgeSprings:
    """The edges and volumes of one body of m tets.

    Attributes
    ----------
    rows : which of the laws' tets these are
    ends : (m, 6, 2) vertices of each tet's edges; rest : (m, 6, 3) from the first to the second at rest [m]
    shares : (m, 6) the part of each edge that belongs to the tet
    edge_compliance [m/N], volume_compliance [m^5/N] : 0 is rigid
    """

    rows: slice
    ends: NDArray[np.int32]
    rest: NDArray[np.float64]
    shares: NDArray[np.float64]
    edge_compliance: float
    volume_compliance: float

    @classmethod
    def of(
        cls,
        compliances: tuple[float, float],
        rows: slice,
        rest_positions: NDArray[np.float64],
        tets: NDArray[np.int32],
        volumes: NDArray[np.float64],
    ) -> EdgeSprings:
        """Those of a body with `tets` (m, 4) of these rest volumes (m,); `rest_positions` (n, 3) [m].

        compliances : of edges [m/N] and of volumes [m^5/N]
        """
        ends = np.sort(tets[:, _EDGES], axis=2)
        keys = ends[:, :, 0].astype(np.int64) * len(rest_positions) + ends[:, :, 1]
        _, edge = np.unique(keys.ravel(), return_inverse=True)
        six = np.repeat(volumes, 6)
        shares = six / np.bincount(edge, weights=six)[edge]
        rest = rest_positions[ends[:, :, 1]] - rest_positions[ends[:, :, 0]]
        return cls(rows, ends.astype(np.int32), rest, shares.reshape(-1, 6), *compliances)

    @property
    def is_rigid(self) -> bool:
        """Whether a compliance is 0: the forces then do not follow from positions."""
        return self.edge_compliance == 0.0 or self.volume_compliance == 0.0

    def energies(self, x: NDArray[np.float64], J: NDArray[np.float64], volumes: NDArray[np.float64]) -> NDArray:
        """(m,) energy of every tet with its shares of edges [J]; rigid edges and volumes have none.

        Parameters
        ----------
        x : (n, 3) [m]; J : (m,) of the tets; volumes : (m,) at rest [m^3]
        """
        energies = np.zeros(len(J))
        if self.edge_compliance > 0.0:
            stretch = self._stretches(x)[0]
            energies += (self.shares * stretch**2).sum(axis=1) / (2.0 * self.edge_compliance)
        if self.volume_compliance > 0.0:
            energies += ((J - 1.0) * volumes) ** 2 / (2.0 * self.volume_compliance)
        return energies

    def first_piolas(
        self, x: NDArray[np.float64], F: NDArray[np.float64], J: NDArray[np.float64], volumes: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """(m, 3, 3) [Pa]; NaN where something is rigid. F : (m, 3, 3), others as of `energies`."""
        if self.is_rigid:
            return np.full_like(F, np.nan)
        stretch, along = self._stretches(x)
        forces = self.shares * stretch / self.edge_compliance
        P = np.einsum("es,esi,esj->eij", forces, along, self.rest) / volumes[:, None, None]
        pressure = (J - 1.0) * volumes / self.volume_compliance
        return P + pressure[:, None, None] * cofactors(F)

    def _stretches(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(m, 6) l - l0 [m] and (m, 6, 3) unit vectors along the edges; zero where the ends coincide."""
        edges = x[self.ends[:, :, 1]] - x[self.ends[:, :, 0]]
        length = np.linalg.norm(edges, axis=2)
        along = edges / np.where(length > 0.0, length, 1.0)[:, :, None]
        return length - np.linalg.norm(self.rest, axis=2), along


def cofactors(F: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, 3, 3) d J / d F = J F^-T, also of singular F (m, 3, 3)."""
    a, b, c = F[:, 0], F[:, 1], F[:, 2]
    return np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
