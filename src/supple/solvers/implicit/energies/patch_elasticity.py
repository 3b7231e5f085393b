"""Elastic energy of tets that are averaged over patches; the formulas are in `materials.patches`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.materials.laws.isotropic_law import IsotropicLaw
from supple.materials.patches.domains import Patches
from supple.materials.patches.energy import SERIAL_TETS, edge_gradients, patch_energies, star_states
from supple.materials.patches.kernels import (
    FRAME,
    add_law_models,
    edge_models,
    pair_blocks,
    pressure_hessians,
    slot_gradients,
    volume_gradients,
)
from supple.materials.patches.pairs import Pairs
from supple.numerics.sparse.couplings import Couplings
from supple.runtime.threads import threads_for
from supple.solvers.implicit.energies.potential import HessianBlocks, JointlyEvaluated, Projection


@dataclass(frozen=True, eq=False)
class PatchElasticity(JointlyEvaluated):
    """The sum of the energies of all patches.

    Attributes
    ----------
    pairs : the pairs of vertices that have a block in the Hessian
    """

    patches: Patches
    pairs: Pairs
    label = "elasticity"
    projection = Projection.RELEASED_FIRST

    @classmethod
    def of(cls, patches: Patches) -> PatchElasticity:
        return cls(patches, patches.pairs())

    def value(self, x: NDArray[np.float64]) -> float:
        of_edges, of_stars = patch_energies(self.patches, x)
        return float(of_edges.sum() + of_stars.sum())

    def add_model(
        self, x: NDArray[np.float64], gradient: NDArray[np.float64], hessian: HessianBlocks | None, project: bool
    ) -> float:
        """With `project`, the Hessian is the sum of the projections of the edges' energies, of the products of volume
        gradients, and of half of the pressures' second derivatives: within a star those of its inner facets cancel, so
        that the sum of all their projections, tet by tet, is far too stiff. Without any, it is too soft."""
        patches, edges, stars = self.patches, self.patches.edges, self.patches.stars
        second = hessian is not None
        energies, forces = np.empty(len(edges.volumes)), np.empty((len(edges.vertices), 3))
        frames = np.empty((len(energies) if second else 0, FRAME))
        turned = np.empty_like(forces) if second else forces[:0]
        of_tets = np.empty((len(patches.tets), 4, 3))
        law = edges.kind, edges.mu, edges.lam
        with threads_for(len(patches.tets), SERIAL_TETS):
            edge_models(
                x, edges.start, edges.vertices, edges.gradients, edges.volumes, *law, second, project, energies,
                forces, frames, turned,
            )  # fmt: skip
            for part in edges.laws:
                assert isinstance(part.law, IsotropicLaw)
                F = edge_gradients(edges, x, part.rows)
                U, _, V, values = part.law.decomposed(F, part.parameters)
                add_law_models(
                    part.rows, edges.start, edges.gradients, edges.volumes, U, V, values, second, project, energies,
                    forces, frames,
                )  # fmt: skip
            of_stars, pressures, stiffness = star_states(patches, x)
            pressure = pressures[stars.of_tet]
            volume_gradients(x, patches.tets, patches.Dm_inv, patches.tet_volumes, of_tets)
            if hessian is not None:
                if project:
                    stiffness = np.maximum(stiffness, 0.0)
                self._add_hessian(x, (frames, turned), (pressure, stiffness, of_tets), hessian, project)
        _add_by_vertex(edges.vertices, forces, gradient)
        _add_by_vertex(patches.tets.ravel(), (pressure[:, None, None] * of_tets).reshape(-1, 3), gradient)
        return float(energies.sum() + of_stars.sum())

    def _add_hessian(
        self,
        x: NDArray[np.float64],
        of_edges: tuple[NDArray[np.float64], NDArray[np.float64]],
        of_stars: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
        out: HessianBlocks,
        project: bool,
    ) -> None:
        patches, stars, pairs = self.patches, self.patches.stars, self.pairs
        pressure, stiffness, of_tets = of_stars
        blocks = np.empty((len(patches.tets), 12, 12))
        acting = 0.5 * pressure if project else pressure
        pressure_hessians(x, patches.tets, patches.Dm_inv, patches.tet_volumes, acting, project, blocks)
        out.tets[patches.rows] += blocks
        directions = np.empty((len(stars.vertices), 3))
        slot_gradients(stars.tet_start, stars.tets, stars.start, stars.slots, of_tets, directions)
        sums = np.empty((len(pairs.rows), 3, 3))
        pair_blocks(
            pairs.rows, pairs.columns, pairs.edge_start, pairs.edge_slots, pairs.star_start, pairs.star_slots,
            patches.edges.owner, *of_edges, stars.owner, stiffness, directions, sums,
        )  # fmt: skip
        out.patches.append(Couplings(pairs.rows, pairs.columns, sums))


def _add_by_vertex(vertices: NDArray[np.int32], values: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """Add the rows of `values` (s, 3) to those of their vertices, in their order."""
    for k in range(3):
        out[:, k] += np.bincount(vertices, weights=values[:, k], minlength=len(out))
