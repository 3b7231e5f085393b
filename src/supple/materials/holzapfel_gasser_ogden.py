"""The Holzapfel-Gasser-Ogden material: a soft ground with families of fibres; the energy is in `laws/fibres.py`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.checks import unit_vectors
from supple.kinds.validators import NON_NEGATIVE, POSITIVE, ListOf, Number, NumberPerTet
from supple.materials.by_law import ByLaw
from supple.materials.laws.fibres import FIBRES
from supple.materials.laws.ogden import OGDEN
from supple.materials.per_tet import Law, LawTets, TetMaterial, one_per_tet


@dataclass(frozen=True, eq=False, kw_only=True)
class HolzapfelGasserOgden(ByLaw):
    """Tissue: psi = c10 (I1 - 3) + K/2 (J - 1)^2 + sum over families k1 / (2 k2) (exp(k2 E^2) - 1), where E > 0.

    I1 of the ground is that of F / J^(1/3); E = kappa (I1 - 3) + (1 - 3 kappa) (I4 - 1) of a family with the mean
    direction a, I4 = |F a|^2, is its strain. Fibres carry no pressure.

    Parameters
    ----------
    c10 : of the ground [Pa], above zero; its shear modulus is 2 c10. bulk : K [Pa].
    k1 : stiffness of the fibres [Pa]; k2 : how fast they stiffen [-], above zero.
    kappa : dispersion of their directions [-], from 0 (parallel) to 1/3 (in all directions alike).
    directions : (families, 3) mean directions in the mesh's coordinates at rest, or (n_tets, families, 3), one of each
        family for every tet; of any length above zero [-].

    Raises
    ------
    SceneError : where a value is out of range.

    Source: Gasser, Ogden, Holzapfel, "Hyperelastic modelling of arterial layers with distributed collagen fibre
    orientations" (2006).
    """

    c10: Annotated[float | NDArray[np.float64], NumberPerTet(POSITIVE)]
    k1: Annotated[float | NDArray[np.float64], NumberPerTet(NON_NEGATIVE)]
    k2: Annotated[float | NDArray[np.float64], NumberPerTet(POSITIVE)]
    kappa: Annotated[float | NDArray[np.float64], NumberPerTet(Number(least=0.0, most=1.0 / 3.0))] = 0.0
    directions: Annotated[ArrayLike, ListOf(("vectors",), most=100)]

    shear_formula = "2 c10"

    def _check(self) -> None:
        name = type(self).__name__
        try:
            directions = np.asarray(self.directions, dtype=np.float64)
        except (TypeError, ValueError):
            directions = np.zeros(0)
        if directions.ndim not in (2, 3) or directions.shape[-1] != 3 or not directions.size:
            raise SceneError(
                f"{name}: directions has shape {directions.shape}; give (families, 3) or (n_tets, families, 3)"
            )
        lengths = np.linalg.norm(directions, axis=-1)
        if not (np.isfinite(lengths) & (lengths > 0.0)).all():
            raise SceneError(f"{name}: a direction is zero or not finite; give vectors of a length above zero")
        object.__setattr__(self, "directions", unit_vectors(directions))

    def rest_moduli(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Of the ground, without fibres."""
        return 2.0 * np.asarray(self.c10), np.asarray(self.bulk)

    def law(self) -> Law:
        return OGDEN

    def law_parameters(self) -> tuple[tuple[str, ArrayLike], ...]:
        return ("bulk", self.bulk), ("c10", 2.0 * np.asarray(self.c10)), ("alpha", 2.0)

    def per_tet(self, n_tets: int) -> TetMaterial:
        name, directions = type(self).__name__, np.asarray(self.directions)
        if directions.ndim == 3 and len(directions) != n_tets:
            raise SceneError(f"{name}: directions has {len(directions)} rows for {n_tets} tets; give one per tet")
        values = [one_per_tet(getattr(self, key), n_tets, f"{name}: {key}") for key in ("k1", "k2", "kappa")]
        families = np.broadcast_to(directions, (n_tets, *directions.shape[-2:]))
        rows = np.arange(n_tets)
        fibres = [LawTets(FIBRES, rows, np.column_stack([*values, a])) for a in families.transpose(1, 0, 2)]
        return super().per_tet(n_tets).with_laws(*fibres)
