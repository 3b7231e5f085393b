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
    SHAPE,
    Pairs,
    copy_pairs,
    describe_pairs,
    hand_on,
    loaded_pairs,
    mean_square_speed,
    near_pairs,
)
from supple.solvers.xpbd.contact.search.expected import Expected, fastest_square
from supple.solvers.xpbd.contact.search.overlaps import Overlaps
from supple.solvers.xpbd.contact.search.surface import RowSurface
from supple.solvers.xpbd.contact.shapes import RowShapes

# Of the mean edge: how far nodes may leave their expected places; and the share of it from which lists are renewed
# before a substep rather than after it, and from which a node is searched together with those that must be.
WIDE, NEAR = 0.13, 0.05
SOON, TOGETHER = 0.7, 0.5
# Of the mean edge: how far the fastest node goes while the wide list is valid, and at most where that has fewer pairs
# than the surfaces have points, so that a search costs more than the list. The number of substeps of the near list. A
# part of the list is made again for at most so many times as long as a list by the present velocities would be valid:
# where falling boxes meet boxes that lie, a tenth of the list remains.
WAY, LONGEST, STEPS, LATER = 0.35, 1.0, 6, 2.0


class Lists:
    """The lists of a scene. `pairs` have the impulses that are kept, `near` (m,) the numbers of the near ones.

    `loaded`: whether any pair may have an impulse.

    Parameters
    ----------
    surface, shapes : what may touch
    """

    def __init__(self, surface: RowSurface, shapes: RowShapes) -> None:
        self._surface, self._shapes, self._edge = surface, shapes, surface.edge_length
        self._widest = float(surface.simplices.gaps[surface.simplices.nodes].max(initial=0.0))
        self._search = PatchSearch(surface.parts, surface.patches)
        excluded = surface.parts.excluded_triangles, surface.parts.excluded_edges
        self._excluded = sum(len(lists.items) for lists in excluded)
        self._every = np.ones(surface.count, dtype=np.bool_)
        self._collide, self._on_shapes = surface.simplices.collide.copy(), shapes.collide
        self._fixed = shapes.described()
        self._any = bool(self._collide.any()) or bool(self._on_shapes.any())
        self._number = np.zeros(surface.count, dtype=np.int64)
        self._number[surface.simplices.nodes] = np.arange(len(surface.simplices.nodes))
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
        count, s = self._surface.count, self._surface.simplices
        self._deep = overlaps
        np.logical_and(self._collide & ~overlaps.crossing, ~(still[:, None] & still), out=s.collide)
        self._on_shapes = self._shapes.collide & ~still[:, None]
        self.wide, self.tight = Expected(count), Expected(count)
        self._points = self._edges = self._on_walls = np.zeros((0, 2), dtype=np.int32)
        self.pairs = Pairs.room(0 if memory is None else len(memory.keys))
        if memory is not None:
            self.pairs.keys[:], self.pairs.normals[:] = memory.keys, memory.normals
            self.pairs.impulses[:] = h * h * memory.forces
        self.near = np.zeros(0, dtype=np.int64)
        self.loaded = memory is not None and len(memory.keys) > 0
        self._deviations = np.inf, np.inf
        known = None if memory is None else memory.lists
        if known is not None and not len(overlaps.normals) and self._is_of(known):
            self.wide.x, self.wide.v = known.x - origin, known.v.copy()
            self.wide.age, self.wide.until = known.age, known.until
            self._on_walls = known.walls
            self._describe(None, known.points, known.edges)
            self.pairs.reached[: len(known.reached)] = known.reached
            self._deviations = self._deviation(self.wide, x), np.inf

    def _is_of(self, known: ListMemory) -> bool:
        """Whether a list is of this scene, with the same things at rest."""
        s = self._surface.simplices
        same = [
            known.excluded == self._excluded,
            known.x.shape == self.wide.x.shape == known.v.shape,
            np.array_equal(known.collide, s.collide),
            np.array_equal(known.on_shapes, self._on_shapes),
            np.array_equal(known.shapes, self._fixed),
            known.reached.shape == (len(known.points) + len(known.edges),),
        ]
        ends = (
            (known.points, (len(s.nodes), len(s.triangles))),
            (known.edges, (len(s.edges), len(s.edges))),
            (known.walls, (len(self._number), len(self._shapes))),
        )
        return all(same) and all(
            pairs.dtype == np.int32 and pairs.shape[1:] == (2,) and bool(((pairs >= 0) & (pairs < np.array(end))).all())
            for pairs, end in ends
        )

    def memory(self, x: NDArray[np.float64], origin: NDArray[np.float64], h: float) -> ContactMemory:
        """What the next frame begins with, after substeps of h [s]; x (n, 3) are the vertices in the world [m]."""
        k, wide = loaded_pairs(self.pairs.impulses), self.wide
        k = k[np.argsort(self.pairs.keys[k])]
        masks = self._surface.simplices.collide.copy(), self._on_shapes, self._fixed
        first = len(self._deep.normals)
        reached = self.pairs.reached[first : first + len(self._points) + len(self._edges)].copy()
        pairs = self._points, self._edges, self._on_walls, reached
        lists = ListMemory(*pairs, wide.x + origin, wide.v.copy(), wide.age, wide.until, *masks, self._excluded)
        return ContactMemory(self.pairs.keys[k], self.pairs.impulses[k] / (h * h), self.pairs.normals[k], x, lists)

    def renew(self, x: NDArray[np.float64], v: NDArray[np.float64], h: float, frames: NDArray[np.float64]) -> None:
        """Make the lists valid for the substep of h [s] that begins at x (N, >= 3) with velocities v (N, 3).

        frames : of the shapes then
        """
        wide, tight, least = self.wide, self.tight, h * (1.0 - 1e-9)
        limits = SOON * WIDE * self._edge, SOON * NEAR * self._edge
        if wide.age + least > wide.until:
            self._find(x, v, self._time(v, h), frames, None)
        elif not self._deviations[0] <= limits[0]:
            wide.until = min(wide.until, wide.age + LATER * self._time(v, h))
            self._find(x, v, 0.0, frames, self._nodes_off(wide, x, TOGETHER * WIDE))
        elif tight.age + least <= tight.until and self._deviations[1] <= limits[1]:
            return
        if tight.age + least > tight.until:
            self._choose(x, v, min(wide.until - wide.age, STEPS * h))
        else:
            self._choose_again(x, v)

    def end_substep(self, h: float) -> None:
        """Note that a substep of h [s] ends."""
        self.wide.age += h
        self.tight.age += h

    def cover(
        self, begin: NDArray[np.float64], end: NDArray[np.float64], h: float, frames: NDArray[np.float64]
    ) -> bool:
        """Whether the lists hold for the motion of the substep that ends; otherwise they are made again for it."""
        wide, tight = self.wide, self.tight
        self._deviations = self._deviation(wide, end), self._deviation(tight, end)
        inside = [d <= margin * self._edge for d, margin in zip(self._deviations, (WIDE, NEAR), strict=True)]
        if all(inside):
            return True
        v = (end[:, :3] - begin[:, :3]) / h
        nodes = self._nodes_off(tight, end, TOGETHER * NEAR)
        off = self._nodes_off(wide, end, TOGETHER * WIDE)
        wide.age -= h
        tight.age -= h
        if not inside[0]:
            self._find(begin, v, 0.0, frames, off)
        self._choose_again(begin, v, nodes)
        wide.age += h
        tight.age += h
        self._deviations = self._deviation(wide, end), self._deviation(tight, end)
        return False

    def _deviation(self, expected: Expected, x: NDArray[np.float64]) -> float:
        return expected.deviation(x, self._surface.simplices.nodes)

    def _nodes_off(self, expected: Expected, x: NDArray[np.float64], share: float) -> NDArray[np.bool_]:
        return expected.off(x, self._surface.simplices.nodes, share * self._edge)

    def _find(
        self,
        x: NDArray[np.float64],
        v: NDArray[np.float64],
        time: float,
        frames: NDArray[np.float64],
        nodes: NDArray[np.bool_] | None,
    ) -> None:
        """Search the pairs of some nodes (N,), or a new list of all that holds for a time [s]."""
        p, wide = self._surface.patches, self.wide
        asked = None
        if nodes is None:
            wide.begin(x, v, time)
        else:
            wide.correct(nodes, x, v)
            asked = _asked(nodes[self._surface.simplices.nodes], p.corners)
        at, way = wide.places, (wide.until - wide.age) * wide.v
        found = self._search.find(at, way, self._widest + 2.0 * WIDE * self._edge, asked)
        self._on_walls = np.column_stack(self._walls(at, way, frames))
        self._describe(asked, *found)

    def _describe(self, asked: NDArray[np.bool_] | None, points: NDArray[np.int32], edges: NDArray[np.int32]) -> None:
        """Make the pairs of the lists: the old ones without patches that are asked, and those that are found.

        Pairs that push keep their impulses.
        """
        s, deep, p, old = self._surface.simplices, self._deep, self._surface.patches, self.pairs
        stays = [np.zeros(0, dtype=np.int64)] * 2
        if asked is not None:
            points_asked, triangles_asked, edges_asked = asked[p.of_point], asked[p.of_triangle], asked[p.of_edge]
            parts = (self._points, points_asked, triangles_asked), (self._edges, edges_asked, edges_asked)
            stays = [np.flatnonzero(~(one[of[:, 0]] | other[of[:, 1]])) for of, one, other in parts]
        d, listed = len(deep.normals), len(self._points)
        self._points = np.concatenate([self._points[stays[0]], points])
        self._edges = np.concatenate([self._edges[stays[1]], edges])
        first = d + len(self._points)
        new = Pairs.room(first + len(self._edges) + len(self._on_walls))
        nothing = deep.points[:0]
        describe_pairs(0, deep.points, deep.edges, s, new)
        new.deep[:d], new.normals[:d] = True, deep.normals
        kept = np.concatenate([d + stays[0], d + listed + stays[1]])
        copy_pairs(old, kept[: len(stays[0])], new, d)
        copy_pairs(old, kept[len(stays[0]) :], new, first)
        describe_pairs(d + len(stays[0]), points, nothing, s, new)
        describe_pairs(first + len(stays[1]), nothing, edges, s, new)
        self._describe_walls(new, first + len(self._edges), *self._on_walls.T)
        hand_on(old, kept, new)
        self.pairs = new

    def _walls(
        self, x: NDArray[np.float64], way: NDArray[np.float64], frames: NDArray[np.float64]
    ) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """The nodes and shapes (k,) that may touch."""
        s = self._surface.simplices
        nodes = s.nodes[s.owner[s.nodes] < len(self._shapes.collide)]
        reach = s.gaps[nodes] + WIDE * self._edge + np.sqrt(np.einsum("ij,ij->i", way[nodes], way[nodes]))
        points, shapes = [np.zeros(0, dtype=np.int32)], [np.zeros(0, dtype=np.int32)]
        for o in range(len(self._shapes)):
            every = np.full(len(nodes), o, dtype=np.int32)
            gaps = self._shapes.walls(x, nodes, every, frames, frames).gaps
            near = self._on_shapes[s.owner[nodes], o] & ((gaps < reach) | self._shapes.moving[o])
            points.append(nodes[near])
            shapes.append(every[near])
        return np.concatenate(points), np.concatenate(shapes)

    def _describe_walls(self, pairs: Pairs, first: int, nodes: NDArray[np.int32], shapes: NDArray[np.int32]) -> None:
        s, mine = self._surface.simplices, slice(first, None)
        pairs.nodes[mine] = nodes[:, None]
        pairs.kinds[mine], pairs.shapes[mine], pairs.pushes[mine] = SHAPE, shapes, True
        pairs.keys[mine] = 1 << 62 | shapes.astype(np.int64) << 31 | self._number[nodes]
        pairs.gaps[mine] = s.gaps[nodes]
        pairs.friction[mine] = self._shapes.friction[s.owner[nodes], shapes]

    def _choose(self, x: NDArray[np.float64], v: NDArray[np.float64], time: float) -> None:
        """Choose the near pairs for a time [s]."""
        self.tight.begin(x, v, time)
        self._choose_of(self._every)

    def _choose_again(
        self, x: NDArray[np.float64], v: NDArray[np.float64], nodes: NDArray[np.bool_] | None = None
    ) -> None:
        """Choose again the near ones among the pairs of nodes (N,), or of those that have left their place."""
        off = self._nodes_off(self.tight, x, TOGETHER * NEAR) if nodes is None else nodes
        self.tight.correct(off, x, v)
        self._choose_of(off)

    def _choose_of(self, nodes: NDArray[np.bool_]) -> None:
        tight, room = self.tight, np.empty(len(self.pairs.keys) + 1, dtype=np.int64)
        reach, time = 2.0 * NEAR * self._edge, tight.until - tight.age
        near = room[: near_pairs(tight.places, tight.v, self.pairs, time, reach, nodes, room)]
        # One order for any history of the lists, and whatever else is in the scene; those with shapes last.
        self.near = near[np.lexsort((self.pairs.keys[near], self.pairs.kinds[near]))]
        self._deviations = self._deviations[0], 0.0

    def _time(self, v: NDArray[np.float64], h: float) -> float:
        """For how long to search ahead: while the fastest node, seen from its body, goes `WAY` edges or more."""
        s, pairs = self._surface.simplices, len(self._points) + len(self._edges)
        way = min(LONGEST, WAY * max(1.0, len(s.nodes) / max(1, pairs))) * self._edge
        fastest = math.sqrt(max(fastest_square(v, s.nodes, s.owner, len(s.collide)), mean_square_speed(v, self.pairs)))
        return max(h, way / max(fastest, way / (200.0 * h)))


@njit(cache=True)
def _asked(left, corners):
    """(q,) the patches with a corner that has left its place (s,)."""
    out = np.zeros(len(corners.start) - 1, dtype=np.bool_)
    for q in range(len(out)):
        for k in range(corners.start[q], corners.start[q + 1]):
            out[q] = out[q] or left[corners.items[k]]
    return out
