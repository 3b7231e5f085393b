"""How the parameters of each kind of rubber enter its law, and where a fit begins."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.materials.by_law import ByLaw
from supple.materials.laws.isotropic_law import IsotropicLaw
from supple.materials.laws.ogden import OGDEN
from supple.materials.laws.yeoh import YEOH
from supple.materials.rubber import MooneyRivlin, Ogden, Yeoh

# Exponents that a fit of Ogden's energy begins with.
_EXPONENTS = (-2.0, 1.5, 4.0, 8.0)
# With no volume change the bulk modulus has no effect.
_ANY_BULK = 1.0


@dataclass(frozen=True, eq=False)
class Family:
    """The parameters of one kind.

    Attributes
    ----------
    names : of the parameters; is_modulus : (q,) whether each is a modulus [Pa], or a number
    law, row : the law, and its parameters from the values (q,)
    arguments : the arguments of the class from the values; shear_modulus : at rest [Pa]
    exponents : groups of those to begin with; none of a kind whose stress is linear in its parameters
    """

    names: tuple[str, ...]
    is_modulus: NDArray[np.bool_]
    law: IsotropicLaw
    row: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    arguments: Callable[[NDArray[np.float64]], dict[str, Any]]
    shear_modulus: Callable[[NDArray[np.float64]], float]
    exponents: tuple[tuple[float, ...], ...] = ((),)

    def starts(
        self, residuals: Callable[[NDArray[np.float64]], NDArray[np.float64]], units: NDArray[np.float64]
    ) -> Iterator[NDArray[np.float64]]:
        """Values (q,) to begin with, divided by `units`: the best moduli for each group of exponents."""
        for group in self.exponents:
            base = np.zeros(len(units))
            base[~self.is_modulus] = group
            zero = residuals(base)
            columns = []
            for k in np.flatnonzero(self.is_modulus):
                step = base.copy()
                step[k] = 1.0
                columns.append(residuals(step) - zero)
            base[self.is_modulus] = np.linalg.lstsq(np.column_stack(columns), -zero, rcond=None)[0]
            yield base


def family_of(kind: type[ByLaw], terms: int) -> Family:
    """How to fit a kind of material; `terms` of Ogden.

    Raises
    ------
    SceneError : for a kind that cannot be fitted, or another number of terms.
    """
    moduli = np.ones(4, dtype=np.bool_)
    if kind is MooneyRivlin:
        return Family(
            ("c10", "c01"),
            moduli[:2],
            OGDEN,
            lambda v: np.array([_ANY_BULK, 2.0 * v[0], 2.0, -2.0 * v[1], -2.0]),
            lambda v: {"c10": float(v[0]), "c01": float(v[1])},
            lambda v: float(2.0 * (v[0] + v[1])),
        )
    if kind is Yeoh:
        names = ("c10", "c20", "c30")
        return Family(
            names,
            moduli[:3],
            YEOH,
            lambda v: np.array([_ANY_BULK, *v]),
            lambda v: dict(zip(names, map(float, v), strict=True)),
            lambda v: float(2.0 * v[0]),
        )
    if kind is Ogden:
        if terms not in (1, 2, 3):
            raise SceneError(f"fit_material: terms is {terms!r}; give 1, 2 or 3")
        return Family(
            tuple(f"{name}_{k + 1}" for k in range(terms) for name in ("mu", "alpha")),
            np.tile([True, False], terms),
            OGDEN,
            lambda v: np.array([_ANY_BULK, *v]),
            lambda v: {"mu": v[::2].tolist(), "alpha": v[1::2].tolist()},
            lambda v: float(0.5 * v[::2] @ v[1::2]),
            tuple(combinations(_EXPONENTS, terms)),
        )
    name = getattr(kind, "__name__", repr(kind))
    raise SceneError(f"fit_material: {name} cannot be fitted; give MooneyRivlin, Yeoh or Ogden")
