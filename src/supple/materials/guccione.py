"""Guccione's material of heart muscle at rest; the energy is in `laws/exponential.py`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.checks import unit_vectors
from supple.kinds.validators import POSITIVE, ListOf, NumberPerTet
from supple.materials.by_law import ByLaw
from supple.materials.laws.exponential import EXPONENTIAL
from supple.materials.laws.ogden import OGDEN
from supple.materials.per_tet import Law, LawTets, TetMaterial, one_per_tet


@dataclass(frozen=True, eq=False, kw_only=True)
class Guccione(ByLaw):
    """Heart muscle: psi = C/2 (exp(Q) - 1) + K/2 (J - 1)^2, with one direction f of the fibres.

    Q = bf E_ff^2 + bt (E_ss^2 + E_nn^2 + 2 E_sn^2) + 2 bfs (E_fs^2 + E_fn^2) of Green's strain E, in axes f, s, n.

    Parameters
    ----------
    c : C [Pa], above zero; bf, bt, bfs : along, across and between [-], above zero.
    bulk : K [Pa]; muscle hardly changes its volume: 100 to 1,000 times C bf.
    directions : (1, 3) the fibres' direction in the mesh's coordinates at rest, or (n_tets, 3), one for every tet; of
        any length above zero [-].

    Raises
    ------
    SceneError : where a value is out of range.

    Source: Guccione, McCulloch, Waldman, "Passive material properties of intact ventricular myocardium determined from
    a cylindrical model" (1991).
    """

    c: Annotated[float | NDArray[np.float64], NumberPerTet(POSITIVE)]
    bf: Annotated[float | NDArray[np.float64], NumberPerTet(POSITIVE)]
    bt: Annotated[float | NDArray[np.float64], NumberPerTet(POSITIVE)]
    bfs: Annotated[float | NDArray[np.float64], NumberPerTet(POSITIVE)]
    directions: Annotated[ArrayLike, ListOf(("vectors",))]

    shear_formula = "C bt / 2"

    def _check(self) -> None:
        directions = np.asarray(self.directions, dtype=np.float64)
        lengths = np.linalg.norm(directions, axis=-1)
        if not (np.isfinite(lengths) & (lengths > 0.0)).all():
            raise SceneError("Guccione: a direction is zero or not finite; give vectors of a length above zero")
        object.__setattr__(self, "directions", unit_vectors(directions))

    def rest_moduli(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Across the fibres."""
        mu = 0.5 * np.asarray(self.c) * np.asarray(self.bt)
        return mu, np.asarray(self.bulk) + 2.0 * mu / 3.0

    def law(self) -> Law:
        """That of the volume; the fibres' law is added for each tet."""
        return OGDEN

    def law_parameters(self) -> tuple[tuple[str, ArrayLike], ...]:
        return ("bulk", self.bulk), ("mu", 0.0), ("alpha", 2.0)

    def per_tet(self, n_tets: int) -> TetMaterial:
        directions = np.asarray(self.directions)
        if len(directions) not in (1, n_tets):
            raise SceneError(f"Guccione: directions has {len(directions)} rows for {n_tets} tets; give 1, or {n_tets}")
        values = [one_per_tet(getattr(self, key), n_tets, f"Guccione: {key}") for key in ("c", "bf", "bt", "bfs")]
        parameters = np.column_stack([*values, np.broadcast_to(directions, (n_tets, 3))])
        return super().per_tet(n_tets).with_laws(LawTets(EXPONENTIAL, np.arange(n_tets), parameters))
