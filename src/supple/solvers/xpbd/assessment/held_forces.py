"""The sum of all forces on what pins and obstacles hold: vertices, welded ones included, and anchors of stitches.

What is left of the changes of momenta is the impulse of what holds them, and the same sum times their displacements is
its work.

Between substeps, elastic and viscous forces on what is held are those of its elements; what a sweep has delivered to
the other vertices of the piece differs from them, by a few per cent where a body is as soft as `accuracy` allows. In
sum, it follows from their change of momentum less all that acts on them from outside, and its opposite acts on what is
held. The difference is shared as the stiffness of the elements there.

Where held vertices move, elastic forces are the mean of those before and after that, at the places of all others at the
beginning and at the end of the substep.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic import EdgesAndVolume
from supple.model.pin_reactions import pin_labels, pin_reactions
from supple.model.system import System
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.assessment.held_elements import HeldElements

Floats = NDArray[np.float64]


class HeldForces:
    """The forces on what is held in the substeps of one frame, in the solver's numbering.

    Attributes
    ----------
    is_needed : whether anything is held by a pin, or by an obstacle that moves
    vertices : (k,) those that are held, of n
    elements : those with a node that is held
    outside, inside : (n + a, 3) of the present substep, to be set to zero before it is summed [N]: forces of the
        world, of other bodies and of loads; and those that elements exert on each other
    reactions : of the pins, by label, at the end of a frame, (3,) [N]; see `SolverDetails.reaction_forces`
    """

    def __init__(self, system: System) -> None:
        self._system, anchors = system, len(system.stitching.anchors)
        n = len(system.masses)
        self.vertices = _with_welded(system, np.unique(system.pinned_vertices)).astype(np.int64)
        self._held = np.concatenate([self.vertices, n + np.arange(anchors)])
        moves = any(each.motion is not None for each in (*(pin.pin for pin in system.pins), *system.obstacles))
        self.is_needed = len(self.vertices) > 0 or (anchors > 0 and moves)
        self._places = 4 if moves else 1
        mask = np.isin(np.arange(n + anchors), self._held)
        self.elements = HeldElements(system, mask)
        self._free, self._pieces = ~mask[:n], _pieces(system)
        own, count = self._pieces[self._held], int(self._pieces.max()) + 1
        stiffness = self.elements.stiffness(n + anchors)[self._held]
        stiffness[np.bincount(own, stiffness, count)[own] == 0.0] = 1.0
        self._shares = stiffness / np.bincount(own, stiffness, count)[own]
        self.reactions = {label: np.zeros(3) for label in _known_pins(system, self._pieces, self._held)}
        self.outside, self.inside = np.zeros((n + anchors, 3)), np.zeros((n + anchors, 3))
        self._weight = np.zeros((n + anchors, 3))
        self._weight[:n] = system.masses[:, None] * system.gravity
        self._momenta, self._from_inside = np.zeros((count, 3)), np.zeros((count, 3))
        self._impulses, self._begun = np.zeros((len(self._held), 3)), np.zeros((len(self.vertices), 3))

    def begin_frame(self, velocities: Floats) -> None:
        """Begin a frame with velocities (n, 3) [m/s]."""
        self._impulses[:], self._begun = 0.0, velocities[self.vertices]
        _sum_momenta(velocities, self._system.masses, self._free, self._pieces, self._momenta)

    def end_substep(self, extended: Floats, begun: Floats, velocities: Floats, h: float) -> dict[str, float]:
        """End a substep of h [s], of which all forces but elastic ones are known; the works by name [J].

        Parameters
        ----------
        extended, begun : (n + a, >= 3) places at its end and at its beginning [m]; velocities : (n, 3) at its end [m/s]
        """
        held = self._held
        moved = extended[held, :3] - begun[held, :3]
        self._add_elastic_forces(extended, begun, moved, h)
        of_free = self._system.masses, self._free, self._pieces
        _balance(velocities, *of_free, self.outside, self._weight, h, self._momenta, self._from_inside)
        sums = self.outside, self.inside, self._weight
        pinned = len(self.vertices)
        of_held = held, self._pieces, self._shares, moved, pinned
        works = _end_held(*of_held, *sums, self._from_inside, h, self._impulses)
        return ({"pins": works[0]} if pinned else {}) | ({"anchors": works[1]} if len(held) > pinned else {})

    def end_frame(self, velocities: Floats, dt: float) -> dict[str, float]:
        """End a frame of dt [s] with velocities (n, 3) [m/s]; the works of inertia by name [J]."""
        rows = self.vertices
        if not len(rows):
            return {}
        m, v = self._system.masses[rows], velocities[rows]
        unbalanced = np.zeros_like(velocities)
        changes = m[:, None] * (v - self._begun)
        unbalanced[rows] = (changes - self._impulses[: len(rows)]) / dt - self._weight[rows]
        totals, _ = pin_reactions(self._system, self._system.welding.reduced(unbalanced))
        self.reactions = {label: totals[label] for label in self.reactions}
        return {"pins": 0.5 * float(np.einsum("ij,ij->", changes, v + self._begun))}

    def impulses(self, n: int) -> Floats:
        """(n, 3) of all forces on held vertices in the frame, zero for others [N s]."""
        out = np.zeros((n, 3))
        out[self.vertices] = self._impulses[: len(self.vertices)]
        return out

    def _add_elastic_forces(self, extended: Floats, begun: Floats, moved: Floats, h: float) -> None:
        places = [extended]
        if self._places > 1:
            before, after = begun.copy(), extended[:, :3].copy()
            before[self._held] += moved
            after[self._held] -= moved
            places += [begun, before, after]
        for x in places:
            self.elements.add_forces(x, h, 1.0 / self._places, self.inside)


def _with_welded(system: System, vertices: NDArray[np.integer]) -> NDArray[np.integer]:
    """These vertices, and those that are welded to them."""
    welding = system.welding
    return np.concatenate([vertices, welding.vertices[np.isin(welding.control[:, 0], vertices)]])


def _pieces(system: System) -> NDArray[np.int32]:
    """(n + a,) of vertices, and of anchors, which belong to what is stitched to them."""
    pieces, stitching = system.joined_components, system.stitching
    out = np.concatenate([pieces, np.zeros(len(stitching.anchors), dtype=pieces.dtype)])
    joins = stitching.joins()
    to_anchor = joins[joins[:, 1] >= len(pieces)]
    out[to_anchor[:, 1]] = pieces[to_anchor[:, 0]]
    return out


def _known_pins(system: System, pieces: NDArray[np.int32], held: NDArray[np.int64]) -> list[str]:
    """The labels of all pins but those that share a piece with other ones, or anchors, and with a body that has rigid
    edges or volumes: what goes to which of them is not known."""
    rigid = set()
    for part in system.bodies:
        law = part.body.material
        if isinstance(law, EdgesAndVolume) and 0.0 in (law.edge_compliance, law.volume_compliance):
            rigid |= set(pieces[part.vertices].tolist())
    labels = []
    for label, pin in zip(pin_labels(system), system.pins, strict=True):
        piece = int(pieces[pin.vertices[0]])
        others = np.setdiff1d(held[pieces[held] == piece], _with_welded(system, pin.vertices))
        labels += [label] if piece not in rigid or not len(others) else []
    return labels


@njit(cache=True)
def _sum_momenta(velocities, masses, free, pieces, momenta):
    """Of the vertices (n,) of each piece (p, 3) that are free [kg m/s]."""
    momenta[:] = 0.0
    for i in range(len(masses)):
        if free[i]:
            for j in range(3):
                momenta[pieces[i], j] += masses[i] * velocities[i, j]


@njit(cache=True)
def _balance(velocities, masses, free, pieces, outside, weight, h, momenta, inside):
    """Set `inside` (p, 3) to what acts on the free vertices of each piece beside outer forces and weight, in a substep
    of h from `momenta` (p, 3), which are those at its end afterwards."""
    inside[:] = -momenta / h
    _sum_momenta(velocities, masses, free, pieces, momenta)
    inside += momenta / h
    for i in range(len(masses)):
        if free[i]:
            for j in range(3):
                inside[pieces[i], j] -= outside[i, j] + weight[i, j]


@njit(cache=True)
def _end_held(held, pieces, shares, moved, pinned, outside, inside, weight, from_inside, h, impulses):
    """Add the impulses of a substep of h to those of what is held (k, 3), of which the first `pinned` are vertices.

    Returns minus the works of the forces on vertices and on anchors, over the displacements `moved` (k, 3).
    """
    works = np.zeros(2)
    for k in range(len(held)):
        for j in range(3):
            from_inside[pieces[held[k]], j] += inside[held[k], j]
    for k in range(len(held)):
        i = held[k]
        for j in range(3):
            force = outside[i, j] + inside[i, j] - shares[k] * from_inside[pieces[i], j]
            impulses[k, j] += h * force
            works[0 if k < pinned else 1] -= (force + weight[i, j]) * moved[k, j]
    return works[0], works[1]
