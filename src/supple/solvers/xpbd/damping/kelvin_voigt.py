"""Kelvin-Voigt damping: viscous forces that are implicit in the velocity, over a cycle of a few substeps.

At the beginning of a cycle of length H the forces f solve

    (M + H K) v_e = M v_0 + H f_0,    f = -K v_e,

with K the viscosity at the present shape, v_0 the velocity, and f_0 all other forces, which are taken from the cycle
before: v_0 + H M^-1 f_0 = 2 v_0 - v_1 - H M^-1 f_1, with v_1 and f_1 the velocity and the viscous forces of that cycle.
In the substeps of the cycle f is constant and acts with the constraints. It follows the solution in time: from that of
the cycle before, f = f_1, v_e = 2 v_0 - v_1, with the residual r = -H (f + K v_e), one step goes

    f <- f + M (a diag(m + H k)^-1 r + c z) / H,    z = Z (Z^T (M + H K_0) Z)^-1 Z^T r,

with k a third of the trace of K's diagonal blocks, Z the interpolation from the nodes of `CoarseSpace`, K_0 the
viscosity of the shape that the scene places, and c the length of a line search along z, at most one that suits this
shape. v_1, f_1 and z turn with the frames of `CoarseSpace`.

Source: Toselli, Widlund, "Domain Decomposition Methods" (2005), chapter 3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System, initial_state
from supple.solvers.xpbd.damping import cycle
from supple.solvers.xpbd.damping.coarse_space import CoarseSpace
from supple.solvers.xpbd.damping.elements import damped_springs, damped_tets
from supple.solvers.xpbd.damping.forces import ViscousElements, viscous_springs, viscous_tets
from supple.solvers.xpbd.sweeps.groups import Groups, make_groups, make_groups_of_one_chunk
from supple.solvers.xpbd.sweeps.ordering import Layout

# The longest cycle, in substeps. A mode of which one step corrects more than .85 grows in cycles of 7; after ones of 6
# bodies fall asleep with forces off by 1.2 %.
LONGEST_CYCLE = 4
# a, and the largest c / a. With both a step corrects at most .68 to .84 of a mode in beams and balls of Poisson's ratio
# 0.3 to 0.49, and a little above .54 of a smooth one.
STEP, COARSE_WEIGHT = 0.135, 4.0
# The power that the line search needs is that of one group of elements in so many, in turn, where a body has enough.
PARTS, ENOUGH_GROUPS = 8, 8
# Change of the rate of strain in a cycle, times H, beyond which a body begins from f = 0: bodies that are released from
# random positions gain energy without limit otherwise.
LARGEST_STRAIN = 0.3
_MOST_MATRICES = 8


@dataclass(frozen=True, eq=False)
class ViscousMemory:
    """What damping must know of the cycle before, in the numbering of the scene.

    Attributes
    ----------
    forces, velocities : (n, 3) f_1 [N] and v_1 [m/s], in the frames of the groups
    interval : time since then [s]
    state_velocities : (n, 3) of the state that this belongs to [m/s]
    """

    forces: NDArray[np.float64]
    velocities: NDArray[np.float64]
    interval: float
    state_velocities: NDArray[np.float64]


def make_damping(system: System, layout: Layout, inverse_masses: NDArray[np.float64]) -> Damping | None:
    """The damping of a system in the solver's numbering; None where nothing is damped.

    Parameters
    ----------
    inverse_masses : (n + a,) of the vertices and of the stitches' anchors [1/kg]
    """
    laws = (viscous_tets, damped_tets), (viscous_springs, damped_springs)
    kinds = [(law, *damped(system, inverse_masses)) for law, damped in laws]
    kinds = [kind for kind in kinds if len(kind[1])]
    return Damping(system, layout, inverse_masses, kinds) if kinds else None


class Damping:
    """The damped elements of a system, and the viscous forces of the present cycle.

    Attributes
    ----------
    tau : the largest Kelvin-Voigt time [s]

    Parameters
    ----------
    kinds : law, vertices and constants of each kind of elements
    """

    def __init__(self, system: System, layout: Layout, inverse_masses: NDArray[np.float64], kinds: list) -> None:
        self._layout, n = layout, len(inverse_masses)
        self.tau = float(max(constants[:, -1].max() for *_, constants in kinds))
        placed = initial_state(system.scene).positions[layout.old_from_new[: system.bodies[-1].vertices.stop]]
        stitched = system.stitching.rigid.positions(placed), system.stitching.anchors.at(0.0)
        self._placed = np.concatenate([placed, *stitched])
        touched = np.unique(np.concatenate([vertices.ravel() for _, vertices, _ in kinds])).astype(np.int64)
        movable = inverse_masses[touched] > 0.0
        rows, self._held = touched[movable], touched[~movable]
        space = self._coarse_space = CoarseSpace.of(rows, self._placed, system.joined_components, system.components)
        self._space = space.rows, space.start, space.blocks, space.offsets, space.nodes, space.weights
        self._masses = np.zeros(n)
        given = system.masses if system.effective_masses is None else system.effective_masses
        self._masses[: len(given)] = given
        self._motion = np.zeros((n, 10))
        self._forces, self._local_forces, self._local_velocities = (np.zeros((len(rows), 3)) for _ in range(3))
        self._frames = np.zeros((len(space.start) - 1, 3, 3))
        self._products = np.zeros((len(space.blocks) - 1, 2))
        self._coarse, self._restricted = (np.zeros(3 * space.node_start[-1]) for _ in range(2))
        body_of = np.full(n, -1, dtype=np.int64)
        body_of[space.rows] = np.repeat(np.arange(len(space.blocks) - 1), np.diff(space.start[space.blocks]))
        self._body_of_row = body_of[space.rows]
        self._kinds = [
            ViscousElements(law, vertices, constants, _groups_of(vertices, layout, system, n))
            for law, vertices, constants in kinds
        ]
        # The body of each group of elements; all vertices of an element that can move belong to one.
        bodies_of = [
            body_of[vertices[made.members[:, 0]]].max(axis=1)
            for made, (_, vertices, _) in zip(self._kinds, kinds, strict=True)
        ]
        counts = sum(np.bincount(bodies, minlength=len(self._products)) for bodies in bodies_of)
        parts = np.clip(counts // ENOUGH_GROUPS, 1, PARTS)
        self._shares = parts.astype(np.float64)
        self._parts = [
            [_places(bodies) % parts[bodies] == part % parts[bodies] for part in range(PARTS)] for bodies in bodies_of
        ]
        self._numbers = 3 * space.node_start
        self._cycle, self._interval = 0, 0.0
        self._prepared: dict[tuple[int, int], NDArray[np.float32]] = {}

    def begin_step(self, memory: ViscousMemory | None, state_velocities: NDArray[np.float64]) -> None:
        """Continue from the memory of a state (its velocities in the scene's numbering), if it belongs to it."""
        self._interval, self._cycle = 0.0, 0
        self._forces[:] = self._local_forces[:] = 0.0
        if memory is not None and np.array_equal(memory.state_velocities, state_velocities):
            old = self._layout.old_from_new[self._coarse_space.rows]
            self._local_forces[:], self._local_velocities[:] = memory.forces[old], memory.velocities[old]
            self._interval = memory.interval

    def choose(self, inverse_masses: NDArray[np.float64]) -> None:
        """Damp only elements with a vertex that can move, of inverse masses (n + a,) [1/kg]."""
        for made in self._kinds:
            made.choose(inverse_masses)

    def begin_cycle(
        self,
        points: NDArray[np.float64],
        velocities: NDArray[np.float64],
        anchor_velocities: NDArray[np.float64],
        substeps: int,
        h: float,
    ) -> None:
        """Find the viscous forces of a cycle of `substeps` substeps of h [s].

        Parameters
        ----------
        points : (n + a, 4) positions [m] at its beginning; velocities : (n, 3), anchor_velocities : (a, 3) [m/s]
        """
        H, motion, last = substeps * h, self._motion, (self._local_forces, self._local_velocities)
        inverses = self._inverses(substeps, h)
        limits = min(1.0, H / self._interval) if self._interval > 0.0 else 0.0, LARGEST_STRAIN / H
        # Positions in the middle of the last substep, at which a rotation has no rate of strain.
        motion[: len(velocities), 3:6], motion[len(velocities) :, 3:6] = velocities, anchor_velocities
        motion[:, :3], motion[:, 6:] = points[:, :3] - 0.5 * h * motion[:, 3:6], 0.0
        cycle.begin(self._space, velocities, limits, last, self._frames, self._forces, motion)
        self._add(h)
        at = self._space, self._frames, H
        cycle.restrict(*at, self._forces, motion, self._restricted)
        motion[self._held, 3:] = 0.0
        matrices = self._numbers, inverses, STEP
        found = self._restricted, self._coarse, self._forces, motion, self._products
        cycle.correct(*at, self._masses, matrices, *found)
        self._add(h, self._cycle % PARTS)
        where = *at, self._masses, STEP * COARSE_WEIGHT, self._shares, self._products
        cycle.step(*where, velocities, motion, self._forces, last)
        self._interval = 0.0
        self._cycle += 1

    def push(self, points: NDArray[np.float64], h: float) -> None:
        """Move points (n, 4) by the viscous forces, in a substep of h [s]: x += h^2 w f."""
        cycle.push(self._coarse_space.rows, points, self._forces, h)
        self._interval += h

    @property
    def acting(self) -> tuple[NDArray[np.integer], NDArray[np.float64]]:
        """The damped vertices (k,) and the present viscous forces on them (k, 3) [N]."""
        return self._coarse_space.rows, self._forces

    def memory(self, state_velocities: NDArray[np.float64]) -> ViscousMemory:
        """Of a state with these velocities (n, 3), in the scene's numbering."""
        old = self._layout.old_from_new[self._coarse_space.rows]
        forces, velocities = np.zeros_like(state_velocities), np.zeros_like(state_velocities)
        forces[old], velocities[old] = self._local_forces, self._local_velocities
        return ViscousMemory(forces, velocities, self._interval, state_velocities)

    def _add(self, h: float, part: int | None = None) -> None:
        """Add K v to `_motion`, of all groups of elements that can move or of a part of those of each body."""
        for made, parts in zip(self._kinds, self._parts, strict=True):
            made.add(self._motion, h, made.active if part is None else made.active & parts[part])

    def _inverses(self, substeps: int, h: float) -> NDArray[np.float32]:
        """The inverses of the coarse matrices, for a length of substeps that is near enough."""
        key = substeps, round(2.0 * np.log2(h))
        if key not in self._prepared:
            if len(self._prepared) == _MOST_MATRICES:
                self._prepared.clear()
            self._prepared[key] = self._made_for(substeps, 2.0 ** (0.5 * key[1]))
        return self._prepared[key]

    def _made_for(self, substeps: int, h: float) -> NDArray[np.float32]:
        """Column after column of the coarse matrices of all bodies at once."""
        space, motion, H, numbers = self._coarse_space, self._motion, substeps * h, self._numbers
        counts = np.diff(numbers)
        matrices = [np.zeros((count, count)) for count in counts]
        self._frames[:], self._forces[:] = np.eye(3), 0.0
        for column in range(counts.max()):
            node, axis = divmod(column, 3)
            motion[:, :3], motion[:, 3:] = self._placed, 0.0
            nodes = (space.node_start[:-1] + node)[self._body_of_row]
            shares = np.where(space.nodes == nodes[:, None], space.weights, 0.0).sum(axis=1)
            motion[space.rows, 3 + axis] = shares
            for made in self._kinds:
                made.add(motion, h, np.ones_like(made.active))
            motion[space.rows, 6 + axis] += self._masses[space.rows] * shares / H
            cycle.restrict(self._space, self._frames, -H, self._forces, motion, self._restricted)
            for matrix, begin, count in zip(matrices, numbers[:-1], counts, strict=True):
                if column < count:
                    matrix[column] = self._restricted[begin : begin + count]
        return space.inverses(matrices)


def _groups_of(vertices: NDArray[np.int32], layout: Layout, system: System, n_vertices: int) -> Groups:
    """Elements of bodies are summed in the layout's chunks; anchors, which have no chunk, are few.

    No group has elements of two joined components.
    """
    if vertices.max() < len(layout.rank) and n_vertices == len(layout.rank):
        return make_groups(replace(layout, body=system.joined_components), vertices)
    return make_groups_of_one_chunk(vertices, system.joined_components, n_vertices)


def _places(bodies: NDArray[np.int64]) -> NDArray[np.int64]:
    """(g,) the place of each group of elements among those of its body (g,)."""
    order, places = np.argsort(bodies, kind="stable"), np.zeros_like(bodies)
    places[order] = np.arange(len(bodies)) - np.searchsorted(bodies[order], bodies[order])
    return places


def cycle_lengths(substeps: int) -> list[int]:
    """The substeps of each cycle of a frame."""
    cycles = -(-substeps // LONGEST_CYCLE)
    return [(k + 1) * substeps // cycles - k * substeps // cycles for k in range(cycles)]
