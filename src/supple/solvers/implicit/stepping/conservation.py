"""Conservation of momentum and energy by the midpoint rule, completed after each step.

The rule conserves linear and angular momentum exactly where its equations are solved exactly. Newton's method leaves a
residual; the total impulse and moment of it are removed here from every free piece.

The rule conserves the energy of a linear system. Of another one, a step of x_n to x makes the energy

    e = V(x) - V(x_n) - grad V((x_n + x) / 2) . (x - x_n),

of third order in the step, whatever loads, contacts and pins act besides. Where forces are stiff and their directions
turn far within a step, it adds up. The sum is followed for every piece. Beyond a share of the piece's energy, it is
removed from the velocities relative to the piece's rigid motion, which changes neither momentum. With smaller steps the
sum stays below that share, so that the order of the method is that of the midpoint rule. Where the velocities do not
have that energy, as in a stiff body that hardly moves but turns far in a step, the step is too long. It is also too
long where the forces of damping, which are those at the midpoint, give energy to a piece.

Sources: Hairer, Lubich, Wanner, "Geometric Numerical Integration" (2006), section IV.4 (projection); Simo, Tarnow,
Wong, "Exact energy-momentum conserving algorithms" (1992) for what the midpoint rule conserves.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from supple.model.state import State
from supple.model.system import System
from supple.solvers.implicit.energies.elasticity import Elasticity
from supple.solvers.implicit.energies.potential import Potential
from supple.solvers.implicit.energies.stitches import StitchEnergy
from supple.solvers.implicit.newton.free_motion import FreeMotion

# The energy that the integrator may add, as a share of a piece's elastic, stitch and relative kinetic energy.
_ALLOWED = 0.01
# Energies below that of this strain everywhere are round-off.
_LEAST_STRAIN = 1e-6
# The largest share of the relative kinetic energy that one step removes.
_MOST_TAKEN = 0.9
# The share of a piece's energy, that of its rigid motion included, that may remain without a source after a step.
_MOST_MADE = 0.1


@dataclass(frozen=True, eq=False)
class EnergyMade:
    """The memory of the steps so far: made : (p,) energy that the integrator has added to each piece [J]."""

    made: NDArray[np.float64]


@dataclass(eq=False)
class Conservation:
    """The pieces of a system, joined by tets and stitches.

    Attributes
    ----------
    piece : (n,) number of each vertex's piece; free : see `FreeMotion`
    latest : positions (n, 3) [m], and the energy (p,) that each piece stores there [J], which the next step needs again
    """

    system: System
    elasticity: Elasticity
    stitches: StitchEnergy | None
    piece: NDArray[np.int32]
    free: FreeMotion
    latest: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None

    @classmethod
    def of(
        cls, system: System, elasticity: Elasticity, stitches: StitchEnergy | None, free: FreeMotion
    ) -> Conservation:
        return cls(system, elasticity, stitches, system.joined_components, free)

    def restore_momentum(self, before: State, end: State, residual: NDArray[np.float64]) -> None:
        """Remove from the velocities at the end, in place, the momenta that the residual (n, 3) [N] added."""
        h = end.time - before.time
        for k in range(len(self.free.totals)):
            rows = np.flatnonzero(self.free.piece == k)
            m, x = self.system.masses[rows], end.positions[rows]
            center = m @ x / m.sum()
            # The forces of a step act in the middle of it.
            arms = 0.5 * (before.positions[rows] + x) - center
            impulses = h * residual[rows]
            moment = np.cross(arms, impulses).sum(axis=0)
            end.velocities[rows] -= _rigid(m, x - center, impulses.sum(axis=0), moment)

    def limit_energy(self, before: State, end: State) -> EnergyMade:
        """Remove from the velocities at the end, in place, the added energy beyond the allowed share."""
        v = end.velocities
        if self.latest is None or not np.array_equal(self.latest[0], before.positions):
            self.latest = before.positions, self._stored(before.positions)
        stored = self._stored(end.positions)
        made = stored - self.latest[1] - self._work(before.positions, end.positions)
        self.latest = end.positions, stored
        if isinstance(before.memory, EnergyMade) and len(before.memory.made) == len(made):
            made += before.memory.made
        for k in np.flatnonzero(made > _ALLOWED * stored):
            rows = np.flatnonzero(self.piece == k)
            m, x = self.system.masses[rows], end.positions[rows]
            r = x - m @ x / m.sum()
            momenta = m[:, None] * v[rows]
            relative = v[rows] - _rigid(m, r, momenta.sum(axis=0), np.cross(r, momenta).sum(axis=0))
            kinetic = 0.5 * float(m @ np.einsum("ij,ij->i", relative, relative))
            taken = min(made[k] - _ALLOWED * (stored[k] + kinetic), _MOST_TAKEN * kinetic)
            if taken > 0.0:
                v[rows] -= (1.0 - np.sqrt(1.0 - taken / kinetic)) * relative
                made[k] -= taken
        return EnergyMade(made)

    def gained(self, before: State, end: State, damping: Iterable[Potential], place: float) -> tuple[float, str] | None:
        """The share of its energy that a piece has without a source after `limit_energy`, and one of its bodies.

        None where no share is too large.

        Parameters
        ----------
        damping : the energies whose gradients at the end are the forces of damping; place : see `Plan`
        """
        if not isinstance(end.memory, EnergyMade) or self.latest is None:
            return None
        n, gradient = len(self.piece), np.zeros_like(end.positions)
        for term in damping:
            term.add_gradient(end.positions, gradient)
        works = -place * np.einsum("ij,ij->i", gradient[:n], (end.positions - before.positions)[:n])
        made = end.memory.made + np.maximum(np.bincount(self.piece, weights=works), 0.0)
        m, v = self.system.masses, end.velocities
        kinetic = 0.5 * np.bincount(self.piece, weights=m * np.einsum("ij,ij->i", v, v))
        least = _LEAST_STRAIN**2 * self._stiffness + np.finfo(np.float64).tiny
        shares = made / (self.latest[1] + kinetic + least)
        share, name = max((float(shares[self.piece[part.vertices]].max()), part.name) for part in self.system.bodies)
        return (share, name) if share > _MOST_MADE else None

    @cached_property
    def _stiffness(self) -> NDArray[np.float64]:
        """(p,) sum of moduli times volume of each piece [J]."""
        material, count = self.elasticity.material, int(self.piece.max()) + 1
        of_tets = (np.abs(material.mu) + np.abs(material.lam)) * self.system.rest_volumes
        return np.bincount(self.piece[self.system.tets[:, 0]], weights=of_tets, minlength=count).astype(np.float64)

    def _stored(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(p,) elastic and stitch energy of each piece [J]."""
        count = int(self.piece.max()) + 1
        out = np.bincount(self.piece[self.system.tets[:, 0]], weights=self.elasticity.energies(x), minlength=count)
        if self.stitches is not None:
            owner = self.piece[self.stitches.stitching.elements()[:, 0]]
            out += np.bincount(owner, weights=self.stitches.energies(x), minlength=count)
        return out.astype(np.float64)

    def _work(self, start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
        """(p,) work against the elastic and stitch forces at the midpoint, along the displacement of the step [J]."""
        gradient = np.zeros_like(start)
        middle = 0.5 * (start + end)
        self.elasticity.add_gradient(middle, gradient)
        if self.stitches is not None:
            self.stitches.add_gradient(middle, gradient)
        return np.bincount(self.piece, weights=np.einsum("ij,ij->i", gradient, end - start)).astype(np.float64)


def _rigid(
    m: NDArray[np.float64], r: NDArray[np.float64], momentum: NDArray[np.float64], moment: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(k, 3) the velocities of a rigid motion with these momenta about the center of mass; r (k, 3) from there."""
    inertia = np.einsum("i,ij,ij->", m, r, r) * np.eye(3) - np.einsum("i,ij,ik->jk", m, r, r)
    return momentum / m.sum() + np.cross(np.linalg.lstsq(inertia, moment, rcond=None)[0], r)
