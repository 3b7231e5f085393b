"""Kelvin-Voigt damping: viscous forces that are implicit in the velocity, over a cycle of a few substeps.

At the beginning of a cycle of length H the forces f solve

    (M + H K) v_e = M v_0 + H f_0,    f = -K v_e,

with K the viscosity at the present shape, v_0 the velocity, and f_0 all other forces, which are taken from the cycle
before: v_0 + H M^-1 f_0 = 2 v_0 - v_1 - H M^-1 f_1, with v_1 and f_1 the velocity and the viscous forces of that cycle.
In the substeps of the cycle f is constant and acts with the constraints. The solution is one step of preconditioned
conjugate gradients from that of the cycle before, f = f_1, v_e = 2 v_0 - v_1; so it follows the solution in time.
v_1 and f_1 turn with the frames of `VertexGroups`. The preconditioner is additive and has two levels,

    P^-1 = diag(m + H k)^-1 + Z (Z^T (M + H K_0) Z)^-1 Z^T,

with k a third of the trace of K's diagonal blocks, and K_0 the viscosity of the shape that the scene places.

Sources: Nocedal, Wright, "Numerical Optimization" (2006), section 5.1; Toselli, Widlund, "Domain Decomposition Methods"
(2005), chapter 3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System, initial_state
from supple.solvers.xpbd.assessment.acting import Acting
from supple.solvers.xpbd.damping import cycle
from supple.solvers.xpbd.damping.coarse_space import CoarseMatrix, frames_of_groups, vertex_groups
from supple.solvers.xpbd.damping.elements import matrices_of_springs, matrices_of_tets, viscous_springs, viscous_tets
from supple.solvers.xpbd.damping.force_sum import ForceSum
from supple.solvers.xpbd.damping.forces import forces_of_springs, forces_of_tets, powers_of_springs, powers_of_tets
from supple.solvers.xpbd.sweeps.groups import Groups, make_groups, make_groups_of_one_chunk
from supple.solvers.xpbd.sweeps.ordering import Layout

# Substeps of a cycle. The extrapolated forces need H to be short against the time in which the stiffest tets answer:
# with exact solutions cycles of 4 have the accuracy of cycles of 1, and cycles of 6 let modes grow.
LONGEST_CYCLE = 4
# Of the conjugate gradients. The largest eigenvalue of P^-1 (M + H K) is 2.5 to 5. Longer steps, which one solution
# may take where modes of small eigenvalues dominate, let the highest modes overshoot, cycle after cycle.
LONGEST_STEP = 0.4
# The power that the step needs is estimated from one group of elements in this many, in turn, where a body has enough
# groups. It may be wrong by some per cent; `LONGEST_STEP` keeps the iteration stable for any value.
PARTS, ENOUGH_GROUPS = 4, 64
# Change of strain in a cycle beyond which a body begins from f = 0: bodies that are released from random positions gain
# energy without limit otherwise.
LARGEST_STRAIN = 0.3
# Tets whose matrices are in memory at the same time: 50 MB.
_BATCH = 40_000
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
    damping = Damping(system, layout, inverse_masses)
    return damping if damping.tau > 0.0 else None


class Damping:
    """The damped elements of a system, and the viscous forces of the present cycle.

    Attributes
    ----------
    tau : the largest Kelvin-Voigt time [s]
    acting : the viscous forces of the present cycle. Vertices and anchors that are held come last; the forces on them
        are those of the velocities that the cycle began with.
    """

    acting: Acting

    def __init__(self, system: System, layout: Layout, inverse_masses: NDArray[np.float64]) -> None:
        tets, springs = viscous_tets(system, inverse_masses), viscous_springs(system, inverse_masses)
        self._elements = [
            (kind.vertices, kind.constants(), matrices)
            for kind, matrices in ((tets, matrices_of_tets), (springs, matrices_of_springs))
            if len(kind.tau)
        ]
        self.tau = float(max(tets.tau.max(initial=0.0), springs.tau.max(initial=0.0)))
        if not self._elements:
            return
        self._layout = layout
        laws = (tets, forces_of_tets, powers_of_tets), (springs, forces_of_springs, powers_of_springs)
        self._sums = [
            ForceSum(
                (forces, powers),
                kind.vertices,
                kind.constants(),
                _groups_of(kind.vertices, layout, system, len(inverse_masses)),
            )
            for kind, forces, powers in laws
            if len(kind.tau)
        ]
        n = len(system.masses)
        placed = initial_state(system.scene).positions[layout.old_from_new[: system.bodies[-1].vertices.stop]]
        self._placed = np.concatenate(
            [placed, system.stitching.rigid.positions(placed), system.stitching.anchors.at(0.0)]
        )
        touched = np.unique(np.concatenate([vertices.ravel() for vertices, *_ in self._elements])).astype(np.int64)
        movable = inverse_masses[touched] > 0.0
        rows, self._held = touched[movable], touched[~movable]
        self._rows = np.concatenate([rows, self._held])
        self._groups = vertex_groups(rows, self._placed, system.joined_components, system.components)
        self._masses = np.zeros(len(inverse_masses))
        self._masses[:n] = system.masses if system.effective_masses is None else system.effective_masses
        self._motion = np.zeros((len(inverse_masses), 6))
        self._viscous = np.zeros((len(inverse_masses), 4))
        r, g = len(rows), len(self._groups.start) - 1
        self.acting = Acting(["damping"], [self._rows])
        self._forces, self._forces_on_held = self.acting.forces[:r], self.acting.forces[r:]
        self._local_forces, self._local_velocities = np.zeros((2, r, 3))
        self._frames, self._products = np.zeros((g, 3, 3)), np.zeros((g, 2))
        self._coarse = np.zeros(12 * g)
        body_of_group = np.repeat(np.arange(len(self._groups.blocks) - 1), np.diff(self._groups.blocks))
        # The body of each group of elements; all vertices of an element that can move belong to one.
        group_of_element = [self._groups.group_of[vertices].max(axis=1) for vertices, *_ in self._elements]
        self._bodies = [
            body_of_group[group_of[made.members[:, 0]]]
            for made, group_of in zip(self._sums, group_of_element, strict=True)
        ]
        self._weights = [_weights_of_parts(bodies) for bodies in self._bodies]
        self._cycle = 0
        self._interval = 0.0
        self._prepared: dict[tuple[int, int], tuple[NDArray[np.float64], CoarseMatrix]] = {}

    def begin_step(self, memory: ViscousMemory | None, state_velocities: NDArray[np.float64]) -> None:
        """Continue from the memory of a state (its velocities in the scene's numbering), if it belongs to it."""
        known = memory is not None and np.array_equal(memory.state_velocities, state_velocities)
        if memory is not None and known:
            old = self._layout.old_from_new[self._groups.rows]
            self._local_forces[:], self._local_velocities[:] = memory.forces[old], memory.velocities[old]
            self._interval = memory.interval
        else:
            self._local_forces[:] = 0.0
            self._interval = 0.0
        self._forces[:], self.acting.works[:] = 0.0, 0.0
        self._cycle = 0

    def choose(self, inverse_masses: NDArray[np.float64]) -> None:
        """Damp only elements with a vertex that can move, of inverse masses (n + a,) [1/kg]."""
        for made in self._sums:
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
        groups, motion = self._groups, self._motion
        H = substeps * h
        k, coarse = self._preconditioner(substeps, h)
        cycle.place(points, velocities, anchor_velocities, h, motion)
        frames_of_groups(groups.start, groups.rows, motion, groups.offsets, self._frames)
        shape = groups.start, groups.rows, groups.fields, self._frames
        ratio = min(1.0, H / self._interval) if self._interval > 0.0 else 0.0
        cycle.extrapolate(*shape, motion, self._forces, self._local_forces, self._local_velocities, ratio)
        self._apply(h)
        fast = self._fast_bodies(H)
        if fast.any():
            cycle.forget(groups.start, groups.rows, groups.blocks, fast, velocities, self._forces, motion)
            self._apply(h)
        cycle.restrict(*shape, H, self._forces, self._viscous, self._coarse)
        coarse.solve(self._coarse)
        motion[self._held, 3:] = 0.0
        where = groups.blocks, H, self._masses
        cycle.correct(*shape, *where, k, self._forces, self._viscous, self._coarse, motion, self._products)
        found = self._products, self._powers(h)
        cycle.step(
            groups.start, groups.rows, groups.blocks, H, LONGEST_STEP, self._masses, motion, *found, self._forces
        )
        cycle.keep(*shape, velocities, self._forces, self._local_forces, self._local_velocities)
        np.negative(self._viscous[self._held, :3], out=self._forces_on_held)
        self._interval = 0.0
        self._cycle += 1

    def push(self, points: NDArray[np.float64], h: float) -> None:
        """Move points (n, 4) by the viscous forces, in a substep of h [s]: x += h^2 w f."""
        cycle.push(self._groups.rows, points, self._forces, h)
        self._interval += h

    def memory(self, state_velocities: NDArray[np.float64]) -> ViscousMemory:
        """Of a state with these velocities (n, 3), in the scene's numbering."""
        old = self._layout.old_from_new[self._groups.rows]
        forces, velocities = np.zeros_like(state_velocities), np.zeros_like(state_velocities)
        forces[old], velocities[old] = self._local_forces, self._local_velocities
        return ViscousMemory(forces, velocities, self._interval, state_velocities)

    def _fast_bodies(self, H: float) -> NDArray[np.bool_]:
        """(b,) where the strain of an element changes so much in a cycle that f_1 and v_1 are not guesses for it."""
        fast = np.zeros(len(self._groups.blocks) - 1, dtype=np.bool_)
        for made, bodies in zip(self._sums, self._bodies, strict=True):
            fast[bodies[made.rates > (LARGEST_STRAIN / H) ** 2]] = True
        return fast

    def _apply(self, h: float) -> None:
        self._viscous[:] = 0.0
        for made in self._sums:
            made.add(self._motion, h, self._viscous)

    def _powers(self, h: float) -> NDArray[np.float64]:
        """(b,) forces times velocities in `_motion` of each body, from the part of its groups whose turn it is [W]."""
        total = np.zeros(len(self._groups.blocks) - 1)
        for made, bodies, weights in zip(self._sums, self._bodies, self._weights, strict=True):
            made.find_powers(self._motion, h, weights[self._cycle % PARTS])
            total += np.bincount(bodies, made.powers, len(total))
        return total

    def _preconditioner(self, substeps: int, h: float) -> tuple[NDArray[np.float64], CoarseMatrix]:
        """The diagonal k of the rows and the coarse matrix, for a length of substeps that is near enough."""
        key = substeps, round(2.0 * np.log2(h))
        if key not in self._prepared:
            if len(self._prepared) == _MOST_MATRICES:
                self._prepared.clear()
            near = 2.0 ** (0.5 * key[1])
            diagonal = np.zeros(len(self._placed))
            coarse = CoarseMatrix(self._groups, self._masses, self._matrices(near, diagonal), substeps * near)
            self._prepared[key] = diagonal[self._groups.rows], coarse
        return self._prepared[key]

    def _matrices(
        self, h: float, diagonal: NDArray[np.float64]
    ) -> Iterator[tuple[NDArray[np.int32], NDArray[np.float64]]]:
        """Elements and their matrices in batches; adds their part of k to `diagonal` (n + a,)."""
        for vertices, constants, matrices in self._elements:
            for low in range(0, len(vertices), _BATCH):
                batch = slice(low, low + _BATCH)
                K = matrices(self._placed, vertices[batch], constants[batch], h)
                shares = np.einsum("mcc->mc", K).reshape(len(K), -1, 3).mean(axis=2)
                np.add.at(diagonal, vertices[batch], shares)
                yield vertices[batch], K


def _groups_of(vertices: NDArray[np.int32], layout: Layout, system: System, n_vertices: int) -> Groups:
    """Elements of bodies are summed in the layout's chunks; anchors, which have no chunk, are few.

    No group has elements of two joined components.
    """
    if len(vertices) and vertices.max() < len(layout.rank) and n_vertices == len(layout.rank):
        return make_groups(replace(layout, body=system.joined_components), vertices)
    return make_groups_of_one_chunk(vertices, system.joined_components, n_vertices)


def _weights_of_parts(bodies: NDArray[np.int64]) -> NDArray[np.float64]:
    """(PARTS, g) how much each group of elements counts in a sum over one part that stands for all of its body (g,)."""
    weights = np.ones((PARTS, len(bodies)))
    for body in np.unique(bodies):
        own = np.flatnonzero(bodies == body)
        if len(own) >= ENOUGH_GROUPS:
            weights[:, own] = 0.0
            for part in range(PARTS):
                weights[part, own[part::PARTS]] = len(own) / len(own[part::PARTS])
    return weights


def cycle_lengths(substeps: int) -> list[int]:
    """The substeps of each cycle of a frame."""
    cycles = -(-substeps // LONGEST_CYCLE)
    return [(k + 1) * substeps // cycles - k * substeps // cycles for k in range(cycles)]
