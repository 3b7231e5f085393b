"""Moves bodies apart that intersect at the start, each as a whole and by a small translation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.contact.start.intersections import Intersection, intersections_of
from supple.contact.start.surfaces import StartSurfaces, start_surfaces
from supple.errors import SceneError
from supple.mesh.topology import graph_components
from supple.model.system import PinRange, System, build_system, initial_state
from supple.scene.contact_pairs import PairTable, pair_table
from supple.scene.loads.load import OnSurface
from supple.scene.loads.tet_region import tets_in
from supple.scene.scene import Scene
from supple.scene.selection import InBox

# How far a body may be moved, as a share of its diagonal.
FURTHEST = 0.5
# The gap between bodies that were moved apart, as a share of the mean surface edge.
GAP = 0.01
_PUSHES, _HALVINGS, _ROUNDS = 8, 8, 60
# Lengths of translations that lead downwards are multiplied by this before they are compared.
_DOWNWARD_COST = 2.0


@dataclass(frozen=True, eq=False)
class Move:
    """One body moved by `shift` (3,) [m]."""

    body: str
    shift: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Separation:
    """A scene whose surfaces are apart.

    Attributes
    ----------
    scene : with the moved bodies' positions; initial_positions : the given ones, moved with their bodies
    moves : which bodies were moved, and how far
    """

    scene: Scene
    initial_positions: dict[str, NDArray[np.float64]]
    moves: tuple[Move, ...]


def default_gap(system: System) -> float:
    """A hundredth of the mean edge of the bodies' surfaces [m]."""
    corners = system.rest_points[system.triangles]
    return GAP * float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())


def separate(
    scene: Scene, gap: float | None = None, initial_positions: Mapping[str, ArrayLike] | None = None
) -> Separation:
    """Move bodies apart that intersect, or touch, at the start.

    Bodies are moved as a whole, each by no more than half its diagonal, upwards rather than downwards. Of two bodies
    the upper or the lighter one is moved. Bodies that are stitched together move as one. Pinned bodies, bodies that are
    stitched to an obstacle, and obstacles are not moved.

    Parameters
    ----------
    gap : between bodies that were moved apart [m]; None: see `default_gap`
    initial_positions : as for `simulate`

    Raises
    ------
    SceneError : where that does not separate them; the message names two that still intersect.
    """
    system = build_system(scene)
    start = initial_state(scene, initial_positions)
    gap = default_gap(system) if gap is None else gap
    surfaces = start_surfaces(system, start.positions, start.time)
    mover = Mover(system, pair_table(scene), gap)
    total = np.zeros((len(system.bodies), 3))
    for _ in range(_ROUNDS):
        found = intersections_of(surfaces, mover.table)
        if not found:
            return _applied(scene, initial_positions or {}, total)
        moved: set[int] = set()
        for item in found:
            if moved & {item.first, item.second}:
                continue
            move = mover.separating_move(surfaces, item)
            if move is None or np.linalg.norm(total[move[0]] + move[1]) > mover.limits[move[0]]:
                raise SceneError(f"{mover.description(item)}; {mover.remedy(item)}")
            body, shift = move
            together = np.flatnonzero(mover.group == mover.group[body])
            total[together] += shift
            for one in together.tolist():
                surfaces = shifted(system, surfaces, one, shift)
            moved.update(together.tolist())
    raise SceneError(f"{mover.description(found[0])}; {mover.remedy(found[0])}")


def _applied(scene: Scene, given: Mapping[str, ArrayLike], total: NDArray[np.float64]) -> Separation:
    bodies, moves = list(scene.bodies), []
    starts = {name: np.asarray(x, dtype=np.float64) for name, x in given.items()}
    loads = {key: list(getattr(scene, key)) for key in ("forces", "soft_targets")}
    on_surfaces = list(scene.loads)
    for i, shift in enumerate(total):
        if not shift.any():
            continue
        body = bodies[i]
        bodies[i] = body.changed(position=np.asarray(body.position) + shift)
        moves.append(Move(body.name, shift))
        if body.name in starts:
            starts[body.name] = starts[body.name] + shift
        for items in loads.values():  # loads keep their vertices, also where a box chose them
            for k, item in enumerate(items):
                if item.body == body.name:
                    items[k] = replace(item, vertices=item.select(body.place(body.points)))
        for k, load in enumerate(on_surfaces):
            if getattr(load, "body", None) != body.name:
                continue
            this: Any = load
            if isinstance(load, OnSurface) and isinstance(load.region, InBox):
                on_surfaces[k] = replace(this, region=load.triangles(body))
            if isinstance(getattr(load, "tets", None), InBox):
                on_surfaces[k] = replace(this, tets=tets_in(this.tets, body, load.label))
    if not moves:
        return Separation(scene, starts, ())
    return Separation(replace(scene, bodies=bodies, loads=on_surfaces, **loads), starts, tuple(moves))


def shifted(system: System, s: StartSurfaces, body: int, shift: NDArray[np.float64]) -> StartSurfaces:
    """The surfaces with one body moved by `shift` (3,) [m]."""
    points = s.points.copy()
    points[system.bodies[body].points] += shift
    return replace(s, points=points)


class Mover:
    """Finds translations that separate things.

    Parameters
    ----------
    gap : between the two afterwards [m]

    Attributes
    ----------
    group : (b,) number of each body's group; bodies that are stitched together are one group
    masses, limits, free : (b,) of each body's group: its mass [kg], how far it may be moved [m], and whether no member
        is held
    held : (b,) whether the body itself is pinned, or stitched to an obstacle
    """

    def __init__(self, system: System, table: PairTable, gap: float) -> None:
        self.system, self.table, self.gap = system, table, gap
        self.names = [f"body {p.name!r}" for p in system.bodies] + [o.label for o in system.obstacles]
        self.group, self.held = _groups(system)
        positions = initial_state(system.scene).positions
        members = [np.flatnonzero(self.group == group) for group in self.group]
        spans, self.masses = [], []
        for together in members:
            parts = [system.bodies[k] for k in together]
            # A single body has the size of its rest shape; a group has its size at the start.
            points = system.rest_points if len(together) == 1 else system.points.positions(positions)
            spans.append(np.ptp(np.concatenate([points[part.points] for part in parts]), axis=0))
            self.masses.append(sum(float(system.masses[part.vertices].sum()) for part in parts))
        self.limits = FURTHEST * np.linalg.norm(spans, axis=1)
        self.free = [not self.held[together].any() for together in members]
        size = float(np.linalg.norm(system.gravity))
        self.up = -system.gravity / size if size > 0.0 else np.array([0.0, 1.0, 0.0])

    def separating_move(self, s: StartSurfaces, item: Intersection) -> tuple[int, NDArray[np.float64]] | None:
        """Which body to move, and by how much (3,) [m]; None where no small translation separates the two."""
        a, b = item.first, item.second
        bodies = [k for k in (a, b) if k < len(self.masses) and self.free[k]]
        if a == b or not bodies or self.together(a, b):
            return None
        limit = float(min(self.limits[k] for k in (a, b) if k < len(self.masses)))
        pair = s.pair(a, b)
        best: tuple[float, int, float, NDArray[np.float64], float] | None = None
        ways = []
        for direction in self._directions(s, item):
            mover, sign = self._moved_body(bodies, a, direction)
            cost = _DOWNWARD_COST if sign * direction @ self.up < -0.1 else 1.0
            ways.append((cost * self._push(pair, item, direction, [item]), cost, mover, sign, direction))
        for least, cost, mover, sign, direction in sorted(ways, key=lambda way: way[0]):
            if best is not None and least >= best[0]:
                break
            most = limit if best is None else min(limit, 0.999 * best[0] / cost)
            length = self._length(pair, item, direction, most)
            if length is not None:
                best = (cost * length, mover, sign, direction, length)
        if best is None:
            return None
        _, mover, sign, direction, length = best
        return mover, sign * self._shortened(pair, item, direction, length) * direction

    def together(self, a: int, b: int) -> bool:
        """Whether two things are bodies that are stitched together."""
        return a < len(self.group) and b < len(self.group) and bool(self.group[a] == self.group[b])

    def description(self, item: Intersection) -> str:
        """What intersects, for messages."""
        first, second = self.names[item.first], self.names[item.second]
        where = "({:.4g}, {:.4g}, {:.4g})".format(*(item.point + 0.0))
        if item.first == item.second:
            text = f"{first} {'touches' if item.kind == 'touches' else 'intersects'} itself at the start"
        else:
            text = f"{first} {item.kind} {second} at the start"
        return f"{text}{_triangles(item)} near {where} m"

    def remedy(self, item: Intersection) -> str:
        """Why nothing can be moved, and what the user can do."""
        if item.first == item.second:
            return "no translation separates a body from itself: change its mesh, or how it starts"
        if self.together(item.first, item.second):
            return (
                "they are stitched together, and move as one: change their places in the scene, or switch their "
                "contact off in contact_pairs"
            )
        if not any(k < len(self.masses) and self.free[k] for k in (item.first, item.second)):
            holders = "pins or stitches" if self.system.scene.stitches else "pins"
            return f"{holders} hold what would have to move: change their places in the scene"
        return (
            "they cannot be separated by a small translation (half a body's diagonal): change their places in the scene"
        )

    def _moved_body(self, bodies: list[int], a: int, direction: NDArray[np.float64]) -> tuple[int, float]:
        """Which of the bodies is moved, and whether along (1) or against (-1) the direction in which `a` would go."""
        if len(bodies) == 1:
            return bodies[0], 1.0 if bodies[0] == a else -1.0
        first, second = bodies
        upwards = float(direction @ self.up)
        if abs(upwards) > 0.1:
            return (first, 1.0) if upwards > 0.0 else (second, -1.0)
        return (first, 1.0) if self.masses[first] < self.masses[second] else (second, -1.0)

    def _directions(self, s: StartSurfaces, item: Intersection) -> list[NDArray[np.float64]]:
        """Candidates (unit vectors) for the translation of the first thing; the most likely ones first."""
        for thing, _, normal in s.planes:
            if thing == item.second:
                return [normal]
        directions = [self.up, -self.up, *np.eye(3), *-np.eye(3)]
        mine, theirs = s.of(item.first), s.of(item.second)
        away = s.points[mine].mean(axis=(0, 1)) - s.points[theirs].mean(axis=(0, 1))
        others = [-away if item.second in s.rooms else away]
        if len(item.triangles):
            areas = []
            for triangles in (mine[item.triangles[:, 0]], theirs[item.triangles[:, 1]]):
                x = s.points[triangles]
                areas.append(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]).sum(axis=0))
            others += [areas[1], -areas[0], areas[1] - areas[0], -areas[1]]
        for vector in others:
            length = float(np.linalg.norm(vector))
            if length > 0.0:
                directions.append(vector / length)
        return directions

    def _length(
        self, pair: StartSurfaces, item: Intersection, direction: NDArray[np.float64], most: float
    ) -> float | None:
        """How far the first thing must go in a direction, or None where `most` is not enough [m]."""
        length, found, moved = 0.0, [item], pair
        for _ in range(_PUSHES):
            length += self._push(moved, item, direction, found)
            if length > most:
                return None
            moved = shifted(self.system, pair, item.first, length * direction)
            found = intersections_of(moved, self._only(item))
            if not found:
                return length
        return None

    def _shortened(
        self, pair: StartSurfaces, item: Intersection, direction: NDArray[np.float64], length: float
    ) -> float:
        """A separating length, shortened from `length` by a few bisections, plus the gap [m]."""
        if any(plane[0] == item.second for plane in pair.planes):
            return length
        table = self._only(item)
        inside, outside = 0.0, length
        for _ in range(_HALVINGS):
            middle = 0.5 * (inside + outside)
            if intersections_of(shifted(self.system, pair, item.first, middle * direction), table):
                inside = middle
            else:
                outside = middle
        shorter = outside + self.gap
        if shorter >= length or intersections_of(shifted(self.system, pair, item.first, shorter * direction), table):
            return length
        return shorter

    def _push(
        self, pair: StartSurfaces, item: Intersection, direction: NDArray[np.float64], found: list[Intersection]
    ) -> float:
        """The least translation of the first thing that separates the triangles that meet now [m]."""
        a, b = item.first, item.second
        for thing, point, normal in pair.planes:
            if thing == b:
                return self.gap - float(((pair.points[pair.of(a)] - point) @ normal).min())
        heights = pair.points @ direction
        mine, theirs = pair.of(a), pair.of(b)
        complete = float(heights[theirs].max() - heights[mine].min()) + self.gap
        rows = [other.triangles for other in found if len(other.triangles)]
        if not rows:
            return complete
        met = np.concatenate(rows)
        local = heights[theirs[met[:, 1]]].max(axis=1) - heights[mine[met[:, 0]]].min(axis=1)
        push = max(float(local.max()), 0.0) + self.gap
        return push if b in pair.rooms else min(push, complete)

    def _only(self, item: Intersection) -> PairTable:
        """The table for the contact of two things with each other, and for no other."""
        collide = np.zeros_like(self.table.collide)
        collide[item.first, item.second] = collide[item.second, item.first] = True
        return replace(self.table, collide=collide)


def _groups(system: System) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """(b,) the group of each body, those that are stitched together; and (b,) which bodies are held."""
    number = {part.name: k for k, part in enumerate(system.bodies)}
    # The solver adds obstacles to the pins, since it moves their vertices in the same way.
    pinned = {pin.pin.body for pin in system.pins if isinstance(pin, PinRange)}
    held = np.array([part.name in pinned for part in system.bodies])
    joins = []
    for stitch in system.scene.stitches:
        if stitch.second in number:
            joins.append((number[stitch.first], number[stitch.second]))
        else:
            held[number[stitch.first]] = True
    ends = np.array(joins, dtype=np.int64).reshape(-1, 2)
    return graph_components(len(number), ends[:, 0], ends[:, 1]), held


def _triangles(item: Intersection) -> str:
    """Which triangles meet: a few, by their numbers in `body.triangles`."""
    if not len(item.triangles):
        return ""
    more = f" and {len(item.triangles) - 3} more" if len(item.triangles) > 3 else ""
    if item.triangles[0, 1] < 0:
        return f" (triangles {', '.join(str(row) for row, _ in item.triangles[:3].tolist())}{more})"
    return f" (triangles {', '.join(f'{i} with {j}' for i, j in item.triangles[:3].tolist())}{more})"
