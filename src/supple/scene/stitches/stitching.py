"""All stitches of a scene: their pairs and rest shapes, in the vertex numbers of the whole scene.

Vertices of bodies come first, in the order of the scene. Then follow the points of rigid bodies that something is
stitched to, and the anchors, which are such vertices of obstacles. Anchors move with their obstacle; forces on them
have no effect.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from supple.mesh.topology import graph_components
from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.scene.body import PlacedBody
from supple.scene.located import at
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.stitches.elements import PairNames, Pairs, Springs, StitchTets
from supple.scene.stitches.side import Side, side_of
from supple.scene.stitches.stitch import Stitch


@dataclass(frozen=True, eq=False)
class StitchRange:
    """One stitch of the scene, its pairs with their strength (k,) [N], and the rows of its tets or springs."""

    stitch: Stitch
    pairs: Pairs
    strength: NDArray[np.float64]
    tets: slice
    springs: slice


@dataclass(frozen=True, eq=False)
class RigidNodes:
    """Points of rigid bodies that something is stitched to.

    Attributes
    ----------
    numbers : (r,) of these nodes, consecutive
    control, weights : (r, 4) the control points of their bodies, and of what combination of these each one is
    points : (r,) rows of `System.points`
    """

    numbers: NDArray[np.int32]
    control: NDArray[np.int32]
    weights: NDArray[np.float64]
    points: NDArray[np.int32]

    def __len__(self) -> int:
        return len(self.numbers)

    def positions(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(r, 3) where they are, or how they move, with the vertices of bodies x (n, 3)."""
        return np.einsum("rk,rki->ri", self.weights, x[self.control])


@dataclass(frozen=True, eq=False)
class Anchors:
    """Vertices of obstacles that something is stitched to.

    Attributes
    ----------
    obstacles : all of the scene; owner : (a,) the number of each anchor's obstacle
    vertices : (a,) rows of its surface's vertices; points : (a, 3) in the obstacle's own coordinates [m]
    """

    obstacles: tuple[Obstacle, ...]
    owner: NDArray[np.int32]
    vertices: NDArray[np.int32]
    points: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.points)

    def at(self, time: float) -> NDArray[np.float64]:
        """(a, 3) where they are at `time` [m]."""
        out = self.points.copy()
        for k in np.unique(self.owner):
            R, t = self.obstacles[k].pose(time)
            own_rows = self.owner == k
            out[own_rows] = self.points[own_rows] @ R.T + t
        return out


@dataclass(frozen=True, eq=False)
class Stitching:
    """See the module.

    Attributes
    ----------
    body_vertices : n, how many vertices the bodies have; in a solver, whose system has the points of rigid bodies as
        vertices too (see `supple.model.stitched_points`), also these
    ranges : of each stitch of the scene, before any pair has broken
    tets, springs : of all pairs that hold
    rigid : points of rigid bodies; anchors : vertices of obstacles, whose numbers are the last ones
    broken : (b,) numbers of the pairs that have broken, of all of the scene, ascending
    old_nodes : (b, 4) their `nodes`
    separated : (c,) those of them whose sides collide
    """

    body_vertices: int
    ranges: tuple[StitchRange, ...]
    tets: StitchTets
    springs: Springs
    rigid: RigidNodes
    anchors: Anchors
    broken: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    old_nodes: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 4), dtype=np.int32))
    separated: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def __len__(self) -> int:
        return len(self.tets) + len(self.springs)

    @cached_property
    def names(self) -> PairNames:
        """Of all pairs of the scene, broken or not."""
        numbers = [np.concatenate([_rows(part.tets), self._tet_count + _rows(part.springs)]) for part in self.ranges]
        order = np.argsort(np.concatenate([np.zeros(0, dtype=np.int64), *numbers]))

        def every(parts: Iterable[NDArray], empty: NDArray) -> NDArray:
            return np.concatenate([empty, *parts])[order]

        pairs = (np.column_stack([part.pairs.vertices, part.pairs.rows]) for part in self.ranges)
        return PairNames(
            tuple(part.stitch.name or part.stitch.label for part in self.ranges),
            every((np.full(len(rows), k, np.int32) for k, rows in enumerate(numbers)), np.zeros(0, np.int32)),
            every(pairs, np.zeros((0, 2), np.int32)),
            every((part.strength for part in self.ranges), np.zeros(0)),
        )

    @property
    def _tet_count(self) -> int:
        """Of the scene, before any has broken."""
        return max((part.tets.stop for part in self.ranges), default=0)

    def without(self, broken: NDArray[np.int64], separated: NDArray[np.int64]) -> Stitching:
        """All stitches of a scene but the pairs that have `broken`; see `Stitching`."""
        if not len(broken):
            return self
        holds = np.ones(len(self), dtype=np.bool_)
        holds[broken] = False
        tets, springs = self.tets.chosen(holds[: len(self.tets)]), self.springs.chosen(holds[len(self.tets) :])
        return replace(
            self, tets=tets, springs=springs, broken=broken, old_nodes=self.nodes()[broken], separated=separated
        )

    @property
    def apart(self) -> RigidNodes:
        """The points of rigid bodies that are not among the vertices."""
        return self.rigid if (self.rigid.numbers >= self.body_vertices).any() else _rigid_nodes([])

    @property
    def first_anchor(self) -> int:
        """The number of the first anchor."""
        return self.body_vertices + len(self.apart)

    def points(self, x: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        """(q, 3) all nodes: the bodies' vertices x (n, 3), what is on rigid bodies, and the anchors at `time` [m]."""
        if not len(self.anchors) and not len(self.apart):
            return x
        return np.concatenate([x, self.apart.positions(x), self.anchors.at(time)])

    def nodes(self) -> NDArray[np.int32]:
        """(k, 4) of tets, then springs: the vertex, and what it is stitched to; -1 where that has fewer corners."""
        springs = np.concatenate([self.springs.vertices, np.full((len(self.springs), 1), -1, np.int32)], axis=1)
        alone = springs[:, 1] == springs[:, 2]
        springs[alone, 2] = -1
        return np.concatenate([self.tets.vertices, springs]).astype(np.int32)

    def seams(self) -> NDArray[np.int32]:
        """(q, 4) as `nodes`, also of broken pairs that touch yet: what they join, or joined, does not collide."""
        return np.concatenate([self.nodes(), self.old_nodes[~np.isin(self.broken, self.separated)]])

    @property
    def seamed(self) -> list[Stitch]:
        """The stitches with a pair that is not separated."""
        owners = np.unique(np.delete(self.names.owner, self.separated))
        return [self.ranges[k].stitch for k in owners]

    def elements(self) -> NDArray[np.int32]:
        """(k, 4) the nodes as solvers assemble them; -1 also for nodes that are not vertices of bodies."""
        nodes = self.nodes()
        return np.where(nodes < self.body_vertices, nodes, -1).astype(np.int32)

    def on_vertices(self, obstacle_vertices: Mapping[int, NDArray[np.int32]], count: int) -> Stitching:
        """The same stitches where obstacles' vertices are among `count` vertices, those of bodies first.

        Parameters
        ----------
        obstacle_vertices : by an obstacle's number, the number of each of its vertices
        """
        owned = zip(self.anchors.owner.tolist(), self.anchors.vertices.tolist(), strict=True)
        numbers = [obstacle_vertices[owner][vertex] for owner, vertex in owned]
        new = np.concatenate([np.arange(self.first_anchor, dtype=np.int32), np.array(numbers, dtype=np.int32)])
        return replace(self._with_numbers(new), body_vertices=count, anchors=_anchors((), []))

    def with_rigid_vertices(self) -> Stitching:
        """The same stitches where the points of rigid bodies are vertices, after those of bodies."""
        return replace(self, body_vertices=self.first_anchor)

    def renumbered(self, new: NDArray[np.int32]) -> Stitching:
        """The same stitches of bodies whose vertices have new numbers (n,)."""
        own = self.body_vertices + np.arange(len(self.apart) + len(self.anchors), dtype=new.dtype)
        return self._with_numbers(np.concatenate([new, own]))

    def _with_numbers(self, numbers: NDArray[np.int32]) -> Stitching:
        tets = replace(self.tets, vertices=np.ascontiguousarray(numbers[self.tets.vertices]))
        springs = replace(self.springs, vertices=np.ascontiguousarray(numbers[self.springs.vertices]))
        rigid = replace(self.rigid, numbers=numbers[self.rigid.numbers], control=numbers[self.rigid.control])
        old_nodes = np.append(numbers, -1)[self.old_nodes].astype(np.int32)
        return replace(self, tets=tets, springs=springs, rigid=rigid, old_nodes=old_nodes)

    def joins(self) -> NDArray[np.int32]:
        """(q, 2) each stitch's first vertex with each of the others, anchors included.

        Points of rigid bodies that are not among the vertices count as a control point.
        """
        parts = [self.tets.vertices[:, [0, k]] for k in (1, 2, 3)] + [self.springs.vertices[:, [0, k]] for k in (1, 2)]
        vertex = np.arange(self.first_anchor + len(self.anchors), dtype=np.int32)
        vertex[self.body_vertices : self.first_anchor] = self.apart.control[:, 0]
        return vertex[np.concatenate(parts)]

    def anchored_vertices(self) -> NDArray[np.int32]:
        """Vertices of bodies that are stitched to an obstacle."""
        joins = self.joins()
        return np.unique(joins[joins[:, 1] >= self.first_anchor, 0])

    def points_of_nodes(self, points: EmbeddedPoints) -> NDArray[np.int32]:
        """(q,) the point of a system that each node is, of all its points; -1 for inner vertices and anchors."""
        out = np.full(self.first_anchor + len(self.anchors), -1, dtype=np.int32)
        alone = np.flatnonzero(points.single >= 0)
        out[points.single[alone]] = alone
        out[self.rigid.numbers] = self.rigid.points
        return out

    def joined_components(self, components: NDArray[np.int32]) -> NDArray[np.int32]:
        """(n,) pieces of bodies (n,); pieces that stitches join, also through one vertex of an obstacle, are one."""
        if not len(self):
            return components
        pieces = int(components.max()) + 1
        own = components[: self.body_vertices]
        of_point = np.concatenate([own, own[self.apart.control[:, 0]], pieces + np.arange(len(self.anchors))])
        ends = of_point[self.joins()]
        count = pieces + len(self.anchors)
        labels = graph_components(count, ends[:, 0], ends[:, 1])
        return np.unique(labels[components], return_inverse=True)[1].reshape(-1).astype(np.int32)


def no_stitching(body_vertices: int) -> Stitching:
    """Of a scene without stitches."""
    nothing = StitchTets.none(), Springs.none(), _rigid_nodes([]), _anchors((), [])
    return Stitching(body_vertices, (), *nothing)


def stitch_together(
    bodies: Sequence[PlacedBody], obstacles: Sequence[Obstacle], stitches: Sequence[Stitch]
) -> Stitching:
    """Find the pairs of all stitches, and number them. All names must exist.

    Raises
    ------
    SceneError : where a thing cannot be stitched to, a pair does not exist, or none is within reach.
    """
    things: dict[str, PlacedBody | Obstacle] = {
        **{obstacle.name: obstacle for obstacle in obstacles if obstacle.name},
        **{body.name: body for body in bodies},
    }
    sides: dict[str, Side] = {}
    made: list[tuple[Pairs, NDArray[np.float64], StitchTets | Springs]] = []
    stitched: dict[str, list[NDArray[np.int32]]] = {}
    for number, stitch in enumerate(stitches):
        with at("stitches", number):
            for name in (stitch.first, stitch.second):
                if name not in sides:
                    sides[name] = side_of(things[name], stitch.label)
            first, second = sides[stitch.first], sides[stitch.second]
            pairs = stitch.find(first, second)
            part = stitch.join(first, second, pairs)
            limit = np.inf if stitch.strength is None else stitch.strength
            strength = stitch.per_pair(limit, len(pairs.vertices), "strength")
        made.append((pairs, strength, part))
        stitched.setdefault(stitch.first, []).append(part.vertices[:, 0])
        stitched.setdefault(stitch.second, []).append(part.vertices[:, 1:].ravel())
    used = {name: np.unique(np.concatenate(parts)) for name, parts in stitched.items()}
    starts = np.cumsum([0, *(len(body.mesh.vertices) for body in bodies)])
    tables: dict[str, NDArray[np.int32]] = {}
    count = n = int(starts[-1])
    nodes: list[RigidNodes] = []
    places: list[tuple[int, int]] = []
    for k, (body, start) in enumerate(zip(bodies, starts.tolist(), strict=False)):
        if isinstance(body, RigidBody) and body.name in used:
            rows, point = used[body.name], sum(len(other.touching[0]) for other in bodies[:k])
            control = np.tile(np.arange(start, start + 4, dtype=np.int32), (len(rows), 1))
            own = np.arange(count, count + len(rows), dtype=np.int32)
            nodes.append(RigidNodes(own, control, body.weights[rows], (point + rows).astype(np.int32)))
            tables[body.name] = _table(rows, count)
            count += len(rows)
        elif body.name in used:
            tables[body.name] = np.arange(start, start + len(body.mesh.vertices), dtype=np.int32)
    for owner, obstacle in enumerate(obstacles):
        if obstacle.name in used and obstacle.name not in tables:
            rows = used[obstacle.name]
            tables[obstacle.name] = _table(rows, count + len(places))
            places += [(owner, vertex) for vertex in rows.tolist()]
    ranges: list[StitchRange] = []
    tets, springs = [StitchTets.none()], [Springs.none()]
    for stitch, (pairs, strength, part) in zip(stitches, made, strict=True):
        part = part.numbered(tables[stitch.first], tables[stitch.second])
        begin = sum(map(len, tets)), sum(map(len, springs))
        (tets if isinstance(part, StitchTets) else springs).append(part)  # pyright: ignore[reportArgumentType]
        end = sum(map(len, tets)), sum(map(len, springs))
        ranges.append(StitchRange(stitch, pairs, strength, slice(begin[0], end[0]), slice(begin[1], end[1])))
    others = _rigid_nodes(nodes), _anchors(obstacles, places)
    return Stitching(n, tuple(ranges), StitchTets.joined(tets), Springs.joined(springs), *others)


def _rows(part: slice) -> NDArray[np.int64]:
    return np.arange(part.start, part.stop)


def _table(rows: NDArray[np.integer], first: int) -> NDArray[np.int32]:
    """The numbers of some of a thing's vertices, ascending rows (k,), that begin with `first`."""
    table = np.zeros(int(rows.max()) + 1, dtype=np.int32)
    table[rows] = first + np.arange(len(rows), dtype=np.int32)
    return table


def _rigid_nodes(parts: Sequence[RigidNodes]) -> RigidNodes:
    nothing, none = np.zeros(0, dtype=np.int32), np.zeros((0, 4))
    every = [RigidNodes(nothing, none.astype(np.int32), none, nothing), *parts]
    return RigidNodes(
        *(np.concatenate([getattr(part, name) for part in every]) for name in RigidNodes.__dataclass_fields__)
    )


def _anchors(obstacles: Sequence[Obstacle], placed: Sequence[tuple[int, int]]) -> Anchors:
    places = np.array(placed, dtype=np.int32).reshape(-1, 2)
    points = np.zeros((len(places), 3))
    for k, (owner, vertex) in enumerate(places):
        points[k] = obstacles[owner].surface.vertices[vertex]  # pyright: ignore[reportAttributeAccessIssue]
    return Anchors(tuple(obstacles), places[:, 0], places[:, 1], points)
