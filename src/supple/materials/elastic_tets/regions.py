"""Several materials in one body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.materials.material import Elastic, Hyperelastic
from supple.materials.per_tet import TetMaterial


@dataclass(frozen=True, eq=False, kw_only=True)
class Regions(Elastic):
    """A body of several elastic materials: each tet has one of them.

    Parameters
    ----------
    materials : the elastic materials, of the same kind or not.
    index : (n_tets,) of each tet of the mesh, which of `materials` it is made of: indices from 0.

    Attributes
    ----------
    youngs, poisson, density, damping : (n_tets,) of each tet's material, as for any material.

    Raises
    ------
    SceneError : where a material is not elastic or is itself a `Regions`, or `index` is out of range.
    """

    materials: Sequence[Hyperelastic]
    index: ArrayLike
    youngs: NDArray[np.float64] = field(init=False)
    poisson: NDArray[np.float64] = field(init=False)
    density: NDArray[np.float64] = field(init=False)  # pyright: ignore[reportIncompatibleVariableOverride]
    damping: NDArray[np.float64] = field(init=False)  # pyright: ignore[reportIncompatibleVariableOverride]

    def __post_init__(self) -> None:
        materials = tuple(self.materials)
        if not materials:
            raise SceneError("Regions: materials is empty; give at least one elastic material")
        for k, material in enumerate(materials):
            if not isinstance(material, Hyperelastic) or isinstance(material, Regions):
                raise SceneError(f"Regions: materials[{k}] is a {type(material).__name__}; give an elastic material")
        index = np.asarray(self.index)
        if index.ndim != 1 or index.dtype.kind not in "iu":
            raise SceneError(f"Regions: index is {index.dtype} of shape {index.shape}; give one whole number per tet")
        bad = np.flatnonzero((index < 0) | (index >= len(materials)))
        if len(bad):
            raise SceneError(
                f"Regions: index of tet {bad[0]} is {index[bad[0]]}; there are materials 0 to {len(materials) - 1}"
            )
        object.__setattr__(self, "materials", materials)
        object.__setattr__(self, "index", index.astype(np.int32))
        for name in ("youngs", "poisson", "density", "damping"):
            values = [getattr(material, name) for material in materials]
            object.__setattr__(self, name, self._values_per_tet(values, name))
        super().__post_init__()

    def _values_per_tet(self, values: Sequence[ArrayLike], name: str) -> NDArray[np.float64]:
        index = np.asarray(self.index)
        out = np.empty(len(index))
        for k, value in enumerate(values):
            given = np.asarray(value, dtype=np.float64)
            if given.ndim and len(given) != len(index):
                raise SceneError(
                    f"Regions: {name} of materials[{k}] has {len(given)} values for {len(index)} tets; give one "
                    "number, or one per tet of the whole body"
                )
            here = index == k
            out[here] = np.broadcast_to(given, len(index))[here]
        return out

    def per_tet(self, n_tets: int) -> TetMaterial:
        index = np.asarray(self.index)
        if len(index) != n_tets:
            raise SceneError(f"Regions: index has {len(index)} values for {n_tets} tets; give one per tet")
        kind = np.empty(n_tets, dtype=np.int32)
        mu, lam = np.empty(n_tets), np.empty(n_tets)
        laws = []
        for k, material in enumerate(self.materials):
            here, part = index == k, material.per_tet(n_tets)
            for out, values in ((kind, part.kind), (mu, part.mu), (lam, part.lam)):
                out[here] = values[here]
            laws += [tets.selected(here) for tets in part.laws]
        return TetMaterial(self.density, self.damping, kind, mu, lam, tuple(laws))
