"""The scene: everything a user describes, checked, and free of any solver."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from supple.errors import SceneError
from supple.scene.body import Body
from supple.scene.contact_pairs import ContactPair, PairRules
from supple.scene.forces import Force, SoftTarget
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.pins import Pin
from supple.scene.stitches.stitch import Stitch
from supple.scene.stitches.stitching import Stitching, check_names, stitch_together
from supple.scene.values import finite_vector

_PARTS = (
    ("bodies", Body),
    ("obstacles", Obstacle),
    ("pins", Pin),
    ("forces", Force),
    ("soft_targets", SoftTarget),
    ("stitches", Stitch),
    ("contact_pairs", ContactPair),
)


@dataclass(frozen=True, eq=False)
class Scene:
    """Bodies, obstacles, pins, forces, soft targets and stitches under gravity.

    Parameters
    ----------
    bodies : at least one.
    obstacles : rigid things that bodies collide with. No two bodies or obstacles have the same name.
    pins : fixed or scripted vertices.
    gravity : (3,) acceleration [m/s^2].
    forces : loads on vertices; soft_targets : springs to places.
    stitches : joints of bodies with each other, and with triangle obstacles.
    contact_pairs : friction of some pairs of bodies and obstacles, and which of them pass through each other.

    Raises
    ------
    SceneError : where the parts contradict each other.
    """

    bodies: Sequence[Body]
    obstacles: Sequence[Obstacle] = ()
    pins: Sequence[Pin] = ()
    gravity: ArrayLike = (0.0, -9.81, 0.0)
    forces: Sequence[Force] = ()
    soft_targets: Sequence[SoftTarget] = ()
    stitches: Sequence[Stitch] = ()
    contact_pairs: Sequence[ContactPair] = ()

    def __post_init__(self) -> None:
        for key, kind in _PARTS:
            try:
                items = tuple(getattr(self, key))
            except TypeError:
                raise SceneError(f"scene: {key} is {getattr(self, key)!r}; give a list") from None
            for i, item in enumerate(items):
                if not isinstance(item, kind):
                    raise SceneError(f"scene: {key}[{i}] is a {type(item).__name__}; give a {kind.__name__}")
            object.__setattr__(self, key, items)
        if not self.bodies:
            raise SceneError("scene: there is no body; give at least one")
        object.__setattr__(self, "gravity", finite_vector(self.gravity, "scene: gravity"))
        known = [body.name for body in self.bodies]
        object.__setattr__(self, "obstacles", _all_named(self.obstacles, known))
        named: dict[str | None, str] = {}
        for thing, name in [("body", name) for name in known] + [("obstacle", item.name) for item in self.obstacles]:
            if name in named:
                things = f"{named[name]} {name!r} and {thing} {name!r}"
                raise SceneError(f"scene: {things} have the same name; give each body and obstacle a name of its own")
            named[name] = thing
        pinned: dict[str, np.ndarray] = {}
        for pin in self.pins:
            if pin.body not in known:
                raise SceneError(f"{pin.label}: there is no such body; the scene has {', '.join(map(repr, known))}")
            body = self.body(pin.body)
            chosen = pin.select(body.place(body.mesh.vertices))
            is_pinned = pinned.setdefault(pin.body, np.zeros(len(body.mesh.vertices), dtype=bool))
            if is_pinned[chosen].any():
                vertex = chosen[is_pinned[chosen]][0]
                raise SceneError(f"{pin.label}: vertex {vertex} is held by another pin already; hold it once")
            is_pinned[chosen] = True
        for item in (*self.forces, *self.soft_targets):
            if item.body not in known:
                raise SceneError(f"{item.label}: there is no such body; the scene has {', '.join(map(repr, known))}")
            body = self.body(item.body)
            chosen = item.select(body.place(body.mesh.vertices))
            if isinstance(item, Force) and not callable(item.force):
                item.per_vertex(0.0, len(chosen))
        rules = PairRules(self)
        for pair in self.contact_pairs:
            rules.add(pair)
        check_names(self.stitches, known, [str(obstacle.name) for obstacle in self.obstacles])

    @cached_property
    def stitching(self) -> Stitching:
        """All stitches with their pairs, found where the scene places everything at time 0.

        Raises
        ------
        SceneError : where a pair does not exist, or none is within reach.
        """
        return stitch_together(self.bodies, self.obstacles, self.stitches)

    def body(self, name: str) -> Body:
        """The body of that name.

        Raises
        ------
        SceneError : where there is none.
        """
        for body in self.bodies:
            if body.name == name:
                return body
        raise SceneError(f"scene: there is no body {name!r}; there are {', '.join(repr(b.name) for b in self.bodies)}")


def _all_named(obstacles: Sequence[Obstacle], bodies: Sequence[str]) -> tuple[Obstacle, ...]:
    """The obstacles; those without a name get a free one, their kind and number, such as `HalfSpace 1`."""
    taken = {*bodies, *(obstacle.name for obstacle in obstacles)}
    numbers: Counter[str] = Counter()
    named = []
    for obstacle in obstacles:
        kind = type(obstacle).__name__
        numbers[kind] += 1
        while obstacle.name is None and f"{kind} {numbers[kind]}" in taken:
            numbers[kind] += 1
        named.append(obstacle if obstacle.name else replace(obstacle, name=f"{kind} {numbers[kind]}"))
    return tuple(named)
