"""All stitches of a scene: their pairs and rest shapes, in the vertex numbers of the whole scene.

Vertices of bodies come first, in the order of the scene. Then follow the anchors: vertices of obstacles that something
is stitched to. Anchors move with their obstacle; forces on them have no effect.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.mesh.topology import graph_components
from supple.scene.body import PlacedBody
from supple.scene.located import at
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.stitches.elements import Pairs, Springs, StitchTets
from supple.scene.stitches.side import Side, side_of
from supple.scene.stitches.stitch import Stitch
from supple.scene.suggestion import suggestion


@dataclass(frozen=True, eq=False)
class StitchRange:
    """One stitch of the scene, its pairs, and the rows of its tets or springs."""

    stitch: Stitch
    pairs: Pairs
    tets: slice
    springs: slice


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
            mine = self.owner == k
            out[mine] = self.points[mine] @ R.T + t
        return out


@dataclass(frozen=True, eq=False)
class Stitching:
    """See the module.

    Attributes
    ----------
    body_vertices : n, how many vertices the bodies have; the anchors' numbers begin there
    ranges : of each stitch of the scene
    tets, springs : of all of them
    """

    body_vertices: int
    ranges: tuple[StitchRange, ...]
    tets: StitchTets
    springs: Springs
    anchors: Anchors

    def __len__(self) -> int:
        return len(self.tets) + len(self.springs)

    def points(self, x: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        """(n + a, 3) the bodies' vertices x (n, 3), and the anchors at `time` [m]."""
        return np.concatenate([x, self.anchors.at(time)]) if len(self.anchors) else x

    def nodes(self) -> NDArray[np.int32]:
        """(k, 4) of tets, then springs: the vertex, and what it is stitched to; -1 where that has fewer corners."""
        springs = np.concatenate([self.springs.vertices, np.full((len(self.springs), 1), -1, np.int32)], axis=1)
        alone = springs[:, 1] == springs[:, 2]
        springs[alone, 2] = -1
        return np.concatenate([self.tets.vertices, springs]).astype(np.int32)

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
        new = np.concatenate([np.arange(self.body_vertices, dtype=np.int32), np.array(numbers, dtype=np.int32)])
        return replace(self._with_numbers(new), body_vertices=count, anchors=_anchors((), {}))

    def renumbered(self, new: NDArray[np.int32]) -> Stitching:
        """The same stitches of bodies whose vertices have new numbers (n,)."""
        own = self.body_vertices + np.arange(len(self.anchors), dtype=new.dtype)
        return self._with_numbers(np.concatenate([new, own]))

    def _with_numbers(self, numbers: NDArray[np.int32]) -> Stitching:
        tets = replace(self.tets, vertices=np.ascontiguousarray(numbers[self.tets.vertices]))
        springs = replace(self.springs, vertices=np.ascontiguousarray(numbers[self.springs.vertices]))
        return replace(self, tets=tets, springs=springs)

    def joins(self) -> NDArray[np.int32]:
        """(q, 2) each stitch's first vertex with each of the others, anchors included."""
        parts = [self.tets.vertices[:, [0, k]] for k in (1, 2, 3)] + [self.springs.vertices[:, [0, k]] for k in (1, 2)]
        return np.concatenate(parts)

    def anchored_vertices(self) -> NDArray[np.int32]:
        """Vertices of bodies that are stitched to an obstacle."""
        joins = self.joins()
        return np.unique(joins[joins[:, 1] >= self.body_vertices, 0])

    def joined_components(self, components: NDArray[np.int32]) -> NDArray[np.int32]:
        """(n,) pieces of bodies (n,); pieces that stitches join, also through one vertex of an obstacle, are one."""
        if not len(self):
            return components
        pieces = int(components.max()) + 1
        of_point = np.concatenate([components[: self.body_vertices], pieces + np.arange(len(self.anchors))])
        ends = of_point[self.joins()]
        count = pieces + len(self.anchors)
        labels = graph_components(count, ends[:, 0], ends[:, 1])
        return np.unique(labels[components], return_inverse=True)[1].reshape(-1).astype(np.int32)


def no_stitching(body_vertices: int) -> Stitching:
    """Of a scene without stitches."""
    return Stitching(body_vertices, (), StitchTets.none(), Springs.none(), _anchors((), {}))


def stitch_together(
    bodies: Sequence[PlacedBody], obstacles: Sequence[Obstacle], stitches: Sequence[Stitch]
) -> Stitching:
    """Find the pairs of all stitches, and number them. All names must exist, see `check_names`.

    Raises
    ------
    SceneError : where a thing cannot be stitched to, a pair does not exist, or none is within reach.
    """
    starts = np.concatenate([[0], np.cumsum([len(body.mesh.vertices) for body in bodies])])
    n = int(starts[-1])
    first_of = {body.name: int(start) for body, start in zip(bodies, starts, strict=False)}
    things: dict[str, PlacedBody | Obstacle] = {
        **{obstacle.name: obstacle for obstacle in obstacles if obstacle.name},
        **{body.name: body for body in bodies},
    }
    sides: dict[str, Side] = {}
    numbers: dict[tuple[int, int], int] = {}  # of anchors, by obstacle and vertex
    ranges: list[StitchRange] = []
    tets, springs = [StitchTets.none()], [Springs.none()]
    for number, stitch in enumerate(stitches):
        with at("stitches", number):
            for name in (stitch.first, stitch.second):
                if name not in sides:
                    sides[name] = side_of(things[name], stitch.label)
            first, second = sides[stitch.first], sides[stitch.second]
            pairs = stitch.find(first, second)
            part = stitch.join(first, second, pairs)
        if stitch.second in first_of:
            numbering = first_of[stitch.second] + np.arange(len(second.points))
        else:
            owner = next(k for k, obstacle in enumerate(obstacles) if obstacle.name == stitch.second)
            numbering = np.zeros(len(second.points), dtype=np.int64)
            for vertex in np.unique(part.vertices[:, 1:]).tolist():
                numbering[vertex] = n + numbers.setdefault((owner, vertex), len(numbers))
        part = part.numbered(first_of[stitch.first], numbering.astype(np.int32))
        begin = sum(map(len, tets)), sum(map(len, springs))
        (tets if isinstance(part, StitchTets) else springs).append(part)  # pyright: ignore[reportArgumentType]
        end = sum(map(len, tets)), sum(map(len, springs))
        ranges.append(StitchRange(stitch, pairs, slice(begin[0], end[0]), slice(begin[1], end[1])))
    anchors = _anchors(obstacles, numbers)
    return Stitching(n, tuple(ranges), StitchTets.joined(tets), Springs.joined(springs), anchors)


def _anchors(obstacles: Sequence[Obstacle], numbers: dict[tuple[int, int], int]) -> Anchors:
    places = np.array(list(numbers), dtype=np.int32).reshape(-1, 2)
    points = np.zeros((len(places), 3))
    for k, (owner, vertex) in enumerate(places):
        points[k] = obstacles[owner].surface.vertices[vertex]  # pyright: ignore[reportAttributeAccessIssue]
    return Anchors(tuple(obstacles), places[:, 0], places[:, 1], points)


def check_names(stitches: Sequence[Stitch], bodies: Sequence[str], obstacles: Sequence[str]) -> None:
    """Raise where a stitch names an unknown body or obstacle.

    Raises
    ------
    SceneError : names the known ones.
    """
    for number, stitch in enumerate(stitches):
        for name, what, known in (
            (stitch.first, "body", bodies),
            (stitch.second, "body or obstacle", [*bodies, *obstacles]),
        ):
            if name not in known:
                with at("stitches", number):
                    raise SceneError(f"{stitch.label}: there is no {what} {name!r}; {suggestion(name, known)}")
