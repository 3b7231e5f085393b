"""The base class of stitches: the two things that they join, and how pairs are given or found."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.checks import float_array
from supple.kinds.kind import Kind
from supple.kinds.validators import NON_NEGATIVE, POSITIVE, BodyName, Choice, Name, Number, Validator
from supple.numerics.geometry.triangle_tree import TriangleTree, pair_distances
from supple.scene.stitches.elements import Pairs, Springs, StitchTets
from supple.scene.stitches.side import Side


@dataclass(frozen=True)
class PairList(Validator):
    """(n, 2) different pairs of whole numbers."""

    def checked(self, value: Any, what: str) -> NDArray[np.int64]:
        try:
            pairs = np.array(value)
        except (TypeError, ValueError):
            raise SceneError(f"{what} is not an array of numbers") from None
        if pairs.ndim != 2 or pairs.shape[1] != 2 or len(pairs) == 0 or not np.issubdtype(pairs.dtype, np.integer):
            raise SceneError(f"{what} must be a list of one or more [vertex, partner], in whole numbers")
        if pairs.min() < 0 or pairs.max() > np.iinfo(np.int32).max:
            raise SceneError(f"{what} holds {pairs.min()}; numbers begin at 0 and fit a mesh")
        if len(np.unique(pairs, axis=0)) != len(pairs):
            raise SceneError(f"{what} names a pair twice; name each once")
        return pairs.astype(np.int64)


@dataclass(frozen=True)
class PerPair(Validator):
    """A number within bounds, or a list of them, one for each pair."""

    bounds: Number

    def checked(self, value: Any, what: str) -> NDArray[np.float64]:
        values = float_array(value, what, "give a number, or one for each pair")
        if values.ndim > 1 or values.size == 0:
            raise SceneError(f"{what} has shape {values.shape}; give a number, or one for each pair")
        for item in values.ravel():
            if not np.isfinite(item):
                raise SceneError(f"{what} is {item:g}; it must be finite and {self.bounds.bounds}")
            self.bounds.check_bounds(float(item), what)
        return values


@dataclass(frozen=True, eq=False)
class Stitch(Kind, ABC):
    """Joins vertices of a body to something of another body, or of a triangle obstacle. Bodies are soft or rigid.

    Give `pairs`, or `max_distance`; then pairs are found in the world, where the scene places bodies and obstacles at
    the start. Initial positions or a start from another frame change neither pairs nor rest shapes.

    Parameters
    ----------
    first : name of the body whose vertices are stitched
    second : name of what they are stitched to: another body, or a TriangleObstacle, static or scripted
    pairs : (n, 2) vertex of the first body's mesh, and number of the partner in the second (see the kind of stitch);
        of a rigid body, vertices, edges and triangles are those of its `surface`
    max_distance : vertices of the first body's surface up to this distance from the second are stitched [m]
    pairing : "closest", a vertex's nearest one; of several that are equally near, the one with the largest distance of
        the vertex from its plane; of several with the same (0, where surfaces touch), the one whose normal is most
        opposed to that of the vertex's own surface; and of these the one of lowest number; or "all" in reach
    damping : Kelvin-Voigt time of the stitches [s]
    strength : a pair that is pulled or sheared by more at the end of a frame breaks, and is gone from then on (see
        docs/reference/stitches.md). One number, or one for each pair [N]; None: never
    name : used in messages

    Raises
    ------
    SceneError : where a value is of the wrong kind, not finite or out of range, or both of `pairs` and `max_distance`
        are given, or none; the text names the stitch.
    """

    partner: ClassVar[str]  # the kind of the second part of a pair, in the plural

    title: ClassVar[str] = "stitch"
    exactly_one: ClassVar[tuple[str, ...]] = ("pairs", "max_distance")

    first: Annotated[str, BodyName()]
    second: Annotated[str, BodyName(obstacles=True)]
    pairs: Annotated[ArrayLike | None, PairList()] = field(default=None, kw_only=True)
    max_distance: Annotated[float | None, POSITIVE] = field(default=None, kw_only=True)
    pairing: Annotated[str, Choice(("closest", "all"))] = field(default="closest", kw_only=True)
    damping: Annotated[float, NON_NEGATIVE] = field(default=0.0, kw_only=True)
    strength: Annotated[float | NDArray[np.float64] | None, PerPair(POSITIVE)] = field(default=None, kw_only=True)
    name: Annotated[str | None, Name()] = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.first == self.second:
            raise SceneError(f"{self.label}: it joins a body with itself; give two")

    def facts(self, scene: Any) -> str:
        """How many pairs it has, how far they are apart, how many rest vertices had to be moved, and its strength."""
        part = next(part for part in scene.stitching.ranges if part.stitch is self)
        near, far = part.pairs.distances.min(), part.pairs.distances.max()
        text = f"{type(self).__name__}, {len(part.pairs.vertices)} pairs, {near:.6g} to {far:.6g} m apart"
        if part.tets.stop > part.tets.start:
            text += f", {int(scene.stitching.tets.offset[part.tets].sum())} rest vertices offset"
        low, high = float(part.strength.min()), float(part.strength.max())
        return text + (f", breaks at {low:g}{f' to {high:g}' * (high > low)} N" if np.isfinite(low) else "")

    @property
    def label(self) -> str:
        """The name of this stitch in messages."""
        return f"stitch {self.name!r}" if self.name else f"stitch of {self.first!r} to {self.second!r}"

    @abstractmethod
    def partners(self, second: Side) -> NDArray[np.int32]:
        """(t, 3) all possible partners in the second side, in the order of their numbers, as triangles.

        An edge has two equal corners, a vertex three.
        """

    def surface_partners(self, second: Side) -> NDArray[np.int32]:
        """(r,) the partners among which pairs are found, ascending."""
        return np.arange(len(self.partners(second)), dtype=np.int32)

    @abstractmethod
    def join(self, first: Side, second: Side, pairs: Pairs) -> StitchTets | Springs:
        """The stitches of these pairs; their first column numbers the first side's vertices, the others the second's.

        Raises
        ------
        SceneError : where a pair cannot be stitched.
        """

    def find(self, first: Side, second: Side) -> Pairs:
        """The pairs: those given, or those within reach.

        Raises
        ------
        SceneError : where a number is out of range, or nothing is within reach; the message has the smallest distance.
        """
        partners = self.partners(second)
        if self.pairs is not None:
            pairs = np.asarray(self.pairs)
            for column, (side, count, what) in enumerate(
                ((first, len(first.points), "vertices"), (second, len(partners), self.partner))
            ):
                if pairs[:, column].max() >= count:
                    bad = int(pairs[:, column].max())
                    raise SceneError(f"{self.label}: pairs names number {bad} of {count} {what} of {side.label}")
            vertices, rows = pairs[:, 0], pairs[:, 1]
            distances = pair_distances(first.points[vertices], second.points, partners[rows])
            return Pairs(vertices.astype(np.int32), rows.astype(np.int32), _without_round_off(distances, first, second))
        assert self.max_distance is not None
        candidates = self.surface_partners(second)
        tree = TriangleTree.of(second.points, partners[candidates])
        points = first.points[first.surface_vertices]
        if self.pairing == "all":
            queries, rows, distances = tree.all_within(points, self.max_distance)
        else:
            normals = first.vertex_normals()[first.surface_vertices]
            rows, distances = tree.nearest(points, self.max_distance, normals)
            queries = np.flatnonzero(rows >= 0)
            rows, distances = rows[queries], distances[queries]
        if len(rows) == 0:
            smallest = float(tree.nearest(points)[1].min())
            raise SceneError(
                f"{self.label}: no vertex of {first.label} is within max_distance = {self.max_distance:g} m of "
                f"{second.label}; the smallest distance is {smallest:.6g} m"
            )
        vertices = first.surface_vertices[queries].astype(np.int32)
        return Pairs(vertices, candidates[rows].astype(np.int32), _without_round_off(distances, first, second))

    def per_pair(self, value: ArrayLike, count: int, what: str) -> NDArray[np.float64]:
        """A number, or one for each pair, as (count,).

        Raises
        ------
        SceneError : where the number of values is another one.
        """
        values = np.asarray(value, dtype=np.float64)
        if values.ndim and values.shape != (count,):
            raise SceneError(f"{self.label}: {what} has {values.size} values for {count} pairs; give one, or one each")
        return np.ascontiguousarray(np.broadcast_to(values, count))


def _without_round_off(distances: NDArray[np.float64], first: Side, second: Side) -> NDArray[np.float64]:
    """Zero for pairs that touch: round-off would stretch a spring of 1e-17 m by a factor of 1e9."""
    size = max(float(np.abs(side.points).max(initial=0.0)) for side in (first, second))
    return np.where(distances <= 8.0 * np.finfo(np.float64).eps * size, 0.0, distances)
