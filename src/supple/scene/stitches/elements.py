"""Stitches as flat arrays, as solvers use them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Pairs:
    """The pairs of a stitch.

    Attributes
    ----------
    vertices : (k,) of the first side; rows : (k,) numbers of triangles, edges or vertices of the second
    distances : (k,) between the two at the start [m]
    """

    vertices: NDArray[np.int32]
    rows: NDArray[np.int32]
    distances: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PairNames:
    """Which pairs all stitches of a scene have: those of tets, then those of springs.

    Attributes
    ----------
    labels : names of the stitches, or what messages call them; owner : (k,) which stitch a pair is of
    pairs : (k, 2) vertex of its first side, number of the partner in the second; strength : (k,) [N], inf: never breaks
    """

    labels: tuple[str, ...]
    owner: NDArray[np.int32]
    pairs: NDArray[np.int32]
    strength: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.owner)

    @property
    def breakable(self) -> bool:
        """Whether one of them can break."""
        return bool(np.isfinite(self.strength).any())

    def named(self, rows: NDArray[np.integer]) -> dict[str, NDArray[np.int32]]:
        """Some pairs (b, 2), by the name of their stitch, or what messages call it."""
        owner, pairs = self.owner[rows], self.pairs[rows]
        labels = np.array(self.labels, dtype=object)[owner]
        return {label: pairs[labels == label] for label in dict.fromkeys(labels.tolist())}


@dataclass(frozen=True, eq=False)
class _Elements:
    """Arrays with one row per stitch. The first of its `vertices` is of the first side, the others of the second."""

    vertices: NDArray[np.int32]

    def __len__(self) -> int:
        return len(self.vertices)

    def numbered(self, first: NDArray[np.int32], second: NDArray[np.int32]) -> Self:
        """The same in other numbers: each side's by its table."""
        vertices = np.column_stack([first[self.vertices[:, 0]], second[self.vertices[:, 1:]]])
        return replace(self, vertices=vertices.astype(np.int32))

    def chosen(self, rows: NDArray[np.bool_]) -> Self:
        """Some of them."""
        return type(self)(**{key: getattr(self, key)[rows] for key in self.__dataclass_fields__})

    @classmethod
    def joined(cls, parts: list[Self]) -> Self:
        """Several as one."""
        return cls(**{key: np.concatenate([getattr(part, key) for part in parts]) for key in cls.__dataclass_fields__})


@dataclass(frozen=True, eq=False)
class StitchTets(_Elements):
    """Tetrahedra of stable Neo-Hookean material: a vertex, and the three of a triangle.

    Attributes
    ----------
    vertices : (k, 4); rest_shape_inverse : (k, 3, 3) Dm^-1 [1/m]; rest_volumes : (k,) [m^3]
    mu, lam : (k,) as in the energy density [Pa]; damping : (k,) Kelvin-Voigt time [s]
    offset : (k,) whether the rest vertex was moved away from its triangle
    """

    rest_shape_inverse: NDArray[np.float64]
    rest_volumes: NDArray[np.float64]
    mu: NDArray[np.float64]
    lam: NDArray[np.float64]
    damping: NDArray[np.float64]
    offset: NDArray[np.bool_]

    @classmethod
    def none(cls) -> StitchTets:
        zero = np.zeros(0)
        return cls(np.zeros((0, 4), np.int32), np.zeros((0, 3, 3)), zero, zero, zero, zero, np.zeros(0, dtype=np.bool_))


@dataclass(frozen=True, eq=False)
class Springs(_Elements):
    """Springs from a vertex to a point of an edge, k/2 (|d| - l)^2 with d = x_0 - (1 - t) x_1 - t x_2.

    Attributes
    ----------
    vertices : (k, 3), the last two the same where the point is a vertex; place : (k,) t
    stiffness : (k,) [N/m]; rest_lengths : (k,) [m]; damping : (k,) Kelvin-Voigt time [s]
    """

    place: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    rest_lengths: NDArray[np.float64]
    damping: NDArray[np.float64]

    @classmethod
    def none(cls) -> Springs:
        zero = np.zeros(0)
        return cls(np.zeros((0, 3), np.int32), zero, zero, zero, zero)

    def extensions(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, 3) d at positions `points` [m]."""
        a, b, c = points[self.vertices].transpose(1, 0, 2)
        t = self.place[:, None]
        return a - (1.0 - t) * b - t * c
