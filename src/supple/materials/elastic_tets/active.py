"""Tets that act by themselves: growth, a stretch of the stress-free shape, and the fibres of muscles.

With the growth F_g the elastic law sees F_e = F F_g^-1, and the volume that it is an energy of is J_g times that at
rest: a tet that grows is one of another rest shape. Growths of the same tet follow each other in their order.

Source: Rodriguez, Hoger, McCulloch, "Stress-dependent finite growth in soft elastic tissues" (1994).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.quadratic import QuadraticTets

Floats = NDArray[np.float64]
GROWTH, MUSCLE = "growth", "muscle"


@dataclass(frozen=True, eq=False)
class ActiveTets:
    """One growth or muscle, at one time.

    Attributes
    ----------
    kind : `GROWTH` or `MUSCLE`
    rows : (k,) numbers of the tets; directions : (k, 3) unit vectors at rest, or (0, 3) for all directions
    value : stretch of the growth, or activation of the muscle [-]
    strength : of the muscle [Pa]; curve : (c, 2) its stretches and shares of the strength
    """

    kind: str
    rows: NDArray[np.int64]
    directions: Floats
    value: float = 1.0
    strength: float = 0.0
    curve: Floats = field(default_factory=lambda: np.ones((1, 2)))

    def at(self, value: float) -> ActiveTets:
        """The same with another value."""
        return replace(self, value=value)


@dataclass(frozen=True, eq=False)
class Growth:
    """What all growths together have made of m tets: F_g^-1 (m, 3, 3), and J_g (m,) [-]."""

    inverses: Floats
    ratios: Floats

    @classmethod
    def of(cls, active: Sequence[ActiveTets], m: int) -> Growth | None:
        """None where nothing grows."""
        growths = [load for load in active if load.kind == GROWTH]
        if not growths:
            return None
        inverses, ratios = np.tile(np.eye(3), (m, 1, 1)), np.ones(m)
        for load in growths:
            s, d = load.value, load.directions
            if len(d):
                own = np.eye(3) + (1.0 / s - 1.0) * d[:, :, None] * d[:, None, :]
                inverses[load.rows] = own @ inverses[load.rows]
                ratios[load.rows] *= s
            else:
                inverses[load.rows] /= s
                ratios[load.rows] *= s**3
        return cls(inverses, ratios)

    def equals(self, other: Growth | None) -> bool:
        """Whether nothing has grown since."""
        return other is not None and np.array_equal(self.inverses, other.inverses)

    def shapes(self, Dm_inv: Floats, volumes: Floats) -> tuple[Floats, Floats]:
        """Dm^-1 (m, 3, 3) and volumes (m,) of the stress-free shapes, from those at rest."""
        return np.ascontiguousarray(Dm_inv @ self.inverses), volumes * self.ratios

    def quadratic(self, tets: QuadraticTets | None) -> QuadraticTets | None:
        """The quadratic tets with the stress-free shapes."""
        if tets is None:
            return None
        points, rows = tets.quadrature, tets.rows
        gradients = np.ascontiguousarray(points.gradients @ self.inverses[rows, None])
        volumes = points.volumes * self.ratios[rows, None]
        return replace(tets, quadrature=replace(points, gradients=gradients, volumes=volumes))


def add_active_piolas(active: Sequence[ActiveTets], F: Floats, out: Floats) -> None:
    """Add a S f(s) (F d / s) d^T of all fibres to `out` (m, 3, 3) [Pa], with s = |F d|; F (m, 3, 3)."""
    for load in active:
        if load.kind == MUSCLE:
            fibres = np.einsum("kij,kj->ki", F[load.rows], load.directions)
            s = np.linalg.norm(fibres, axis=1)
            pull = load.value * load.strength * np.interp(s, *load.curve.T) / np.where(s > 0.0, s, np.inf)
            out[load.rows] += pull[:, None, None] * fibres[:, :, None] * load.directions[:, None, :]
