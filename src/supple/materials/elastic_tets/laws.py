"""The elastic laws of all tets of a scene, or of a recording, in one place: what stresses and energies follow from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.edge_springs import EdgeSprings
from supple.materials.patches.domains import Patches, patches_of
from supple.materials.per_tet import NO_REGION, NOT_ELASTIC, TetMaterial


@dataclass(frozen=True, eq=False)
class TetLaws:
    """The elastic laws of m tets.

    Attributes
    ----------
    tets : (m, 4); Dm_inv : (m, 3, 3) Dm^-1 [1/m]; volumes : (m,) at rest [m^3]
    material : of the tets; its kind is `NOT_ELASTIC` where a tet is of none of the elastic materials
    springs : of the tets of bodies that are made of edges and volumes
    """

    tets: NDArray[np.int32]
    Dm_inv: NDArray[np.float64]
    volumes: NDArray[np.float64]
    material: TetMaterial
    springs: tuple[EdgeSprings, ...] = ()

    @cached_property
    def patches(self) -> Patches | None:
        """The patches of the tets whose material is averaged over such; None where there is none."""
        if not (self.material.region != NO_REGION).any():
            return None
        # Patches must not reach from body to body or into another region of the same body.
        return patches_of(self.tets, self.Dm_inv, self.volumes, self.material)

    @cached_property
    def known(self) -> NDArray[np.bool_]:
        """(m,) whether a tet has a law."""
        known = self.material.kind != NOT_ELASTIC
        for springs in self.springs:
            known[springs.rows] = True
        return known

    @cached_property
    def stressed(self) -> NDArray[np.bool_]:
        """(m,) whether the stress of a tet follows from positions: not where something in it is rigid."""
        stressed = self.known.copy()
        for springs in self.springs:
            stressed[springs.rows] = not springs.is_rigid
        return stressed


def joined_materials(parts: list[TetMaterial]) -> TetMaterial:
    """The materials of several bodies as one, in their order."""
    names = ("density", "damping", "kind", "mu", "lam", "region")
    joined = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    laws, begin = [], 0
    for part in parts:
        laws += [tets.shifted(begin) for tets in part.laws]
        begin += len(part.kind)
    return replace(parts[0], **joined, laws=tuple(laws))
