"""Lists of the pairs that may touch, valid while nodes keep their velocities.

The wide list holds what may come near for a while, if every node goes straight on with its velocity; only relative
motion counts, so things that fly or turn together stay in it. Where a node has left its expected place by its margin,
its pairs are searched again. Of the wide list, the near list holds what may come near within the next few substeps.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.contact.search.patch_search import PatchSearch
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.memory import ContactMemory, ListMemory
from supple.solvers.xpbd.contact.pairs import (
    EDGES,
    PART,
    POINT,
    SHAPE,
    describe_pairs,
    keys_of,
    mean_square_speed,
    near_pairs,
    pairs_with_keys,
    parts_of,
)
from supple.solvers.xpbd.contact.search.expected import Expected, deviating, fastest_square
from supple.solvers.xpbd.contact.search.overlaps import Overlaps
from supple.solvers.xpbd.contact.search.surface import RowSurface
from supple.solvers.xpbd.contact.shapes import RowShapes

# Of the mean edge: how far nodes may leave their expected places; and the share of it from which lists are renewed
# before a substep rather than after it, and from which a node is searched together with those that must be.
WIDE, NEAR = 0.13, 0.05
SOON, TOGETHER = 0.7, 0.5
# Of the mean edge: how far the fastest node goes while the wide list is valid. By how much this and the margin of that
# list are larger at most where it has fewer pairs than the surfaces have points, so that a search costs more than the
# list. The number of substeps of the near list. A part of the list is made again for at most so many times as long as a
# list by the present velocities would be valid: where falling boxes meet boxes that lie, a tenth of the list remains.
WAY, LARGEST, STEPS, LATER = 0.35, 3.0, 6, 2.0

# Of the speed of a node seen from its body: that seen from what is near it, in a sheet, whose neighbours move alike. A
# cloth of 10,000 triangles that falls beside a ball is searched 5 times a frame, and 8 times with .5.
ALIKE = 0.3


class Lists:
    """The lists of a scene. `pairs` have the impulses that are kept.

    `loaded`: whether any pair may have an impulse where the frame begins. `wide` and `tight` are the lists of all pairs
    and of the near ones, `deviations` (2,) how far nodes are from where these expect them and `margins` (2,) how far
    they may be [m].

    Parameters
    ----------
    surface, shapes : what may touch
    """

    def __init__(self, surface: RowSurface, shapes: RowShapes) -> None:
        self._surface, self._shapes, self._edge = surface, shapes, surface.edge_length
        s = surface.simplices
        nodes, offsets = s.nodes, s.offsets[s.nodes]
        self._compact, self._sheets = nodes[offsets == 0.0], nodes[offsets > 0.0]
        self._widest = float(s.gaps[nodes].max(initial=0.0))
        if offsets.any():
            # Of two things, the smaller gap counts.
            widest, added = np.zeros((2, len(s.collide)))
            np.maximum.at(widest, s.owner[nodes], s.gaps[nodes])
            np.maximum.at(added, s.owner[nodes], offsets)
            reach = np.minimum(widest[:, None], widest) + added[:, None] + added
            self._widest = float(reach[s.collide].max(initial=0.0))
        self._search = PatchSearch(surface.parts, surface.patches)
        excluded = surface.parts.excluded_triangles, surface.parts.excluded_edges
        self._excluded = sum(len(lists.items) for lists in excluded)
        self._collide, self._on_shapes = surface.simplices.collide.copy(), shapes.collide
        self._fixed = shapes.described()
        self._any = bool(self._collide.any()) or bool(self._on_shapes.any())
        self.wide, self.tight, self.deviations = Expected(surface.count), Expected(surface.count), np.zeros(2)
        self.margins = np.array([WIDE, NEAR]) * self._edge
        nobody = np.zeros(len(self._collide), dtype=np.bool_), Overlaps.none(len(self._collide))
        self.begin_frame(None, np.zeros((surface.count, 3)), np.zeros(3), 1.0, *nobody)

    def __bool__(self) -> bool:
        """Whether anything may touch."""
        return self._any

    def begin_frame(
        self,
        memory: ContactMemory | None,
        x: NDArray[np.float64],
        origin: NDArray[np.float64],
        h: float,
        still: NDArray[np.bool_],
        overlaps: Overlaps,
    ) -> None:
        """Begin a frame in substeps of h [s], with the lists and forces of the frame before.

        Parameters
        ----------
        x : (N, >= 3) the nodes about an origin (3,) [m]
        still : (p,) things that do not move; overlaps : of things that begin in each other
        """
        s = self._surface.simplices
        np.logical_and(self._collide & ~overlaps.crossing, ~(still[:, None] & still), out=s.collide)
        self._on_shapes = self._shapes.collide & ~still[:, None]
        for expected in (self.wide, self.tight):
            expected.begin(np.full(expected.x.shape, np.inf), np.zeros(expected.v.shape), 0.0)
        self.deviations[:] = np.inf
        self.loaded = memory is not None and len(memory.keys) > 0
        loaded = pairs_with_keys(np.zeros(0, np.int64) if memory is None else memory.keys)
        if memory is not None:
            loaded["normals"], loaded["impulses"] = memory.normals, h * h * memory.forces
        known = None if memory is None else memory.lists
        nothing = np.zeros(len(loaded), dtype=np.bool_)
        if known is not None and not len(overlaps.normals) and self._is_of(known):
            self.wide.x[:], self.wide.v[:] = known.x - origin, known.v
            self.wide.clock[:], self.margins[0] = (known.age, known.until), known.margin
            self.deviations[0] = self._deviation(self.wide, x)
            self._describe(known.keys, loaded, nothing)
            self.pairs["reached"] = known.reached
            return
        deep = np.concatenate([keys_of(POINT, *overlaps.points.T), keys_of(EDGES, *overlaps.edges.T)])
        self._describe(np.union1d(deep, loaded["keys"][self._are_parts(loaded["keys"])]), loaded, nothing)
        rows = np.searchsorted(self.pairs["keys"], deep)
        self.pairs["deep"][rows], self.pairs["normals"][rows] = True, overlaps.normals

    def _is_of(self, known: ListMemory) -> bool:
        """Whether a list is of this scene, with the same things at rest."""
        s, keys = self._surface.simplices, known.keys
        same = [
            known.excluded == self._excluded,
            known.x.shape == self.wide.x.shape == known.v.shape,
            np.array_equal(known.collide, s.collide),
            np.array_equal(known.on_shapes, self._on_shapes),
            np.array_equal(known.shapes, self._fixed),
            keys.ndim == 1 and known.reached.shape == keys.shape,
            keys.dtype == np.int64 and bool((np.diff(keys) > 0).all() and self._are_parts(keys).all()),
        ]
        return all(same)

    def _are_parts(self, keys: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Which keys (k,) are of parts of this scene: a memory may be one of a scene with other obstacles."""
        s, (kinds, first, second) = self._surface.simplices, parts_of(keys)
        ends = {
            POINT: (len(s.nodes), len(s.triangles)),
            EDGES: (len(s.edges), len(s.edges)),
            SHAPE: (len(self._shapes), len(s.nodes)),
        }
        fits = [(kinds == kind) & (first < most[0]) & (second < most[1]) for kind, most in ends.items()]
        return np.logical_or.reduce(fits)

    def memory(self, x: NDArray[np.float64], origin: NDArray[np.float64], h: float) -> ContactMemory:
        """What the next frame begins with, after substeps of h [s]; x (n, 3) are the vertices in the world [m]."""
        pairs, wide = self.pairs, self.wide
        k = np.flatnonzero(pairs["impulses"].any(axis=1))
        masks = self._surface.simplices.collide.copy(), self._on_shapes, self._fixed
        listed = ~pairs["deep"]
        held = pairs["keys"][listed], pairs["reached"][listed], wide.x + origin, wide.v.copy()
        until = float(wide.clock[1])
        lists = ListMemory(*held, wide.age, until, float(self.margins[0]), *masks, self._excluded)
        return ContactMemory(pairs["keys"][k], pairs["impulses"][k] / (h * h), pairs["normals"][k], x, lists)

    def renew(self, x: NDArray[np.float64], v: NDArray[np.float64], h: float, frames: NDArray[np.float64]) -> bool:
        """Make the wide list valid for the substep of h [s] that begins at x (N, >= 3) with velocities v (N, 3).

        frames : of the shapes then

        Returns whether there are other pairs.
        """
        wide = self.wide
        if wide.ends_within(h):
            self._find(x, v, self._time(v, h), frames, None)
        elif not self.deviations[0] <= SOON * self.margins[0]:
            wide.clock[1] = min(wide.clock[1], wide.age + LATER * self._time(v, h))
            self._find(x, v, 0.0, frames, self._nodes_off(wide, x, TOGETHER * self.margins[0]))
        else:
            return False
        return True

    def search_again(
        self, begin: NDArray[np.float64], end: NDArray[np.float64], h: float, frames: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """Make the lists again for the motion of the substep that ends.

        Returns the nodes (N,) whose near pairs are to be chosen again.
        """
        wide, tight = self.wide, self.tight
        v = (end[:, :3] - begin[:, :3]) / h
        nodes = self._nodes_off(tight, end, TOGETHER * self.margins[1])
        off = self._nodes_off(wide, end, TOGETHER * self.margins[0])
        wide.clock[0] -= h
        tight.clock[0] -= h
        if not self.deviations[0] <= self.margins[0]:
            self._find(begin, v, 0.0, frames, off)
        tight.correct(nodes, begin, v)
        wide.clock[0] += h
        return nodes

    def measure(self, x: NDArray[np.float64]) -> None:
        """Set how far nodes at x (N, >= 3) are from where they are expected."""
        self.deviations[:] = self._deviation(self.wide, x), self._deviation(self.tight, x)

    @property
    def hold(self) -> bool:
        """Whether nodes are where the lists expect them."""
        return bool((self.deviations <= self.margins).all())

    def _deviation(self, expected: Expected, x: NDArray[np.float64]) -> float:
        return expected.deviation(x, self._surface.simplices.nodes)

    def _nodes_off(self, expected: Expected, x: NDArray[np.float64], most: float) -> NDArray[np.bool_]:
        return expected.off(x, self._surface.simplices.nodes, most)

    def _find(
        self,
        x: NDArray[np.float64],
        v: NDArray[np.float64],
        time: float,
        frames: NDArray[np.float64],
        nodes: NDArray[np.bool_] | None,
    ) -> None:
        """Search the pairs of some nodes (N,), or a new list of all that holds for a time [s]."""
        wide, old = self.wide, self.pairs
        asked, kept = None, old["deep"]
        if nodes is None:
            wide.begin(x, v, time)
            self.margins[0] = WIDE * self._scale() * self._edge
        else:
            wide.correct(nodes, x, v)
            patches, surface = self._surface.patches, self._surface.simplices.nodes
            asked, kept = np.zeros(len(patches.owner), dtype=np.bool_), np.zeros(len(old), dtype=np.bool_)
            _ask(nodes[surface], patches.corners, asked)
            _keep(old, asked, patches.of_point, patches.of_triangle, patches.of_edge, kept)
        at, way = wide.places, wide.left * wide.v
        points, edges = self._search.find(at, way, self._widest + 2.0 * self.margins[0], asked)
        found = keys_of(POINT, *points.T), keys_of(EDGES, *edges.T), self._walls(at, way, frames)
        self._describe(np.sort(np.concatenate([old["keys"][kept], *found])), old, kept)

    def _describe(self, keys: NDArray[np.int64], old: NDArray[np.void], kept: NDArray[np.bool_]) -> None:
        """Take the pairs with these keys (k,), and of the `old` ones (o,) what is known of them, where it is `kept`."""
        self.pairs = pairs_with_keys(keys)
        describe_pairs(self.pairs, self._surface.simplices, self._shapes.friction, old, kept)

    def _walls(
        self, x: NDArray[np.float64], way: NDArray[np.float64], frames: NDArray[np.float64]
    ) -> NDArray[np.int64]:
        """The keys (k,) of points and shapes that may touch."""
        s = self._surface.simplices
        mine = np.flatnonzero(s.owner[s.nodes] < len(self._shapes.collide))
        nodes = s.nodes[mine]
        reach = (
            s.gaps[nodes] + s.offsets[nodes] + self.margins[0] + np.sqrt(np.einsum("ij,ij->i", way[nodes], way[nodes]))
        )
        keys = [np.zeros(0, dtype=np.int64)]
        for o in range(len(self._shapes)):
            every = np.full(len(nodes), o, dtype=np.int32)
            gaps = self._shapes.walls(x, nodes, every, frames, frames).gaps
            near = self._on_shapes[s.owner[nodes], o] & ((gaps < reach) | self._shapes.moving[o])
            keys.append(keys_of(SHAPE, every[near], mine[near]))
        return np.concatenate(keys)

    def _time(self, v: NDArray[np.float64], h: float) -> float:
        """For how long to search ahead: while the fastest node, seen from its body, goes `WAY` edges or more."""
        s, way = self._surface.simplices, WAY * self._scale() * self._edge
        fastest = max(fastest_square(v, self._compact, s.owner, len(s.collide)), mean_square_speed(v, self.pairs))
        if len(self._sheets):
            fastest = max(fastest, ALIKE * ALIKE * fastest_square(v, self._sheets, s.owner, len(s.collide)))
        fastest = math.sqrt(fastest)
        return max(h, way / max(fastest, way / (200.0 * h)))

    def _scale(self) -> float:
        """By how much longer and wider a list is than in a scene with many pairs, where a search costs less."""
        return min(LARGEST, max(1.0, len(self._surface.simplices.nodes) / max(1, len(self.pairs))))


@njit
def choose_near(tight, left, begin, v, pairs, found, deviations, margins, surface, h, off, places, near):
    """Make the list of the near pairs valid for a substep of h [s]; returns their number, -1 where they are known.

    Parameters
    ----------
    tight : the list; left : how long the wide one still holds [s]; found : whether that is another one
    begin, v : (N, 3) x_n and velocities; surface : (s,) nodes; off, places : (N,) and (N, 3) scratch memory
    """
    x, u, clock = tight.x, tight.v, tight.clock
    if clock[0] + h * (1.0 - 1e-9) > clock[1]:
        for i in range(len(off)):
            off[i] = True
            for j in range(3):
                x[i, j], u[i, j] = begin[i, j], v[i, j]
        clock[0], clock[1] = 0.0, min(left, STEPS * h)
    elif found or not deviations[1] <= SOON * margins[1]:
        for i in range(len(off)):
            off[i] = False
        deviating(begin, x, u, clock[0], surface, TOGETHER * margins[1], off)
        for i in range(len(off)):
            if off[i]:
                for j in range(3):
                    u[i, j] = v[i, j]
                    x[i, j] = begin[i, j] - clock[0] * v[i, j]
    else:
        return -1
    return choose_of(tight, pairs, deviations, margins, off, places, near)


@njit
def choose_of(tight, pairs, deviations, margins, off, places, near):
    """Choose again the near ones among the pairs of the nodes that are `off`; returns the number of near pairs."""
    for i in range(len(places)):
        for j in range(3):
            places[i, j] = tight.x[i, j] + tight.clock[0] * tight.v[i, j]
    deviations[1] = 0.0
    return near_pairs(places, tight.v, pairs, tight.clock[1] - tight.clock[0], 2.0 * margins[1], off, near)


@njit(cache=True)
def _ask(left, corners, asked):
    """Ask the patches (q,) with a corner that has left its place (s,)."""
    for q in range(len(asked)):
        for k in range(corners.start[q], corners.start[q + 1]):
            asked[q] = asked[q] or left[corners.items[k]]


@njit(cache=True)
def _keep(pairs, asked, of_point, of_triangle, of_edge, kept):
    """Keep the pairs (k,) of which no side is in a patch that is asked (q,), and those that are deep."""
    for k in range(len(kept)):
        first, second = pairs.keys[k] >> 30 & PART, pairs.keys[k] & PART
        if pairs.kinds[k] == POINT:
            kept[k] = not (asked[of_point[first]] or asked[of_triangle[second]])
        elif pairs.kinds[k] == EDGES:
            kept[k] = not (asked[of_edge[first]] or asked[of_edge[second]])
        kept[k] = kept[k] or pairs.deep[k]
