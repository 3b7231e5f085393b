"""The commands that a page sends to the simulation. Each one checks its values when it is created.

A valid command can still be impossible, for example where it names a body that does not exist. The simulation then
sends a notice and continues.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial
from typing import Any

from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.parameters import Value, find_parameter
from supple.app.viewer.protocol.values import (
    Point,
    checked_index,
    checked_length,
    checked_name,
    checked_point,
    checked_shape,
    checked_vertices,
    checked_weights,
    displayed,
    number,
    whole,
)
from supple.errors import CommandError


@dataclass(frozen=True)
class Command:
    """Base of all commands.

    Raises
    ------
    CommandError : where a value is of the wrong kind, not finite, or beyond its limit; see `limits.py`.
    """

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name in _CHECKS and not (value is None and field.default is None):
                _set(self, field.name, _CHECKS[field.name](value, field.name))


@dataclass(frozen=True)
class Play(Command):
    """Start the time."""


@dataclass(frozen=True)
class Pause(Command):
    """Stop the time."""


@dataclass(frozen=True)
class Step(Command):
    """Pause, then simulate `count` frames."""

    count: int = 1


@dataclass(frozen=True)
class Reset(Command):
    """Return to the start. Added bodies stay where they were added. Grabs, and pins made on the page, are removed.

    Parameters and solver do not change.
    """


@dataclass(frozen=True)
class SetSpeed(Command):
    """Slow motion: 1 is real time, 0.1 is a tenth of it. The time step of the simulation does not change."""

    factor: float

    def __post_init__(self) -> None:
        _set(self, "factor", number(self.factor, "speed", limits.SLOWEST_MOTION, limits.FASTEST_MOTION))


@dataclass(frozen=True)
class Watch(Command):
    """Whether anybody watches. Where nobody does, time does not run; a requested `Step` is still taken."""

    watched: bool

    def __post_init__(self) -> None:
        if not isinstance(self.watched, bool):
            raise CommandError(f"watched is {displayed(self.watched)}; give true or false")


@dataclass(frozen=True)
class SetSolver(Command):
    """Continue from the current state with another solver: "xpbd" or "implicit"."""

    kind: str

    def __post_init__(self) -> None:
        if self.kind not in ("xpbd", "implicit"):
            raise CommandError(f"solver {displayed(self.kind)} does not exist; there are xpbd and implicit")


@dataclass(frozen=True)
class SetParameter(Command):
    """Change a number of the running simulation; `supple.app.viewer.protocol.parameters` lists them.

    Parameters
    ----------
    body : name of the body, for parameters of bodies; None for all bodies that have the parameter (for `friction`, the
        obstacles as well).
    """

    name: str
    value: Value
    body: str | None = None

    def __post_init__(self) -> None:
        parameter = find_parameter(self.name)
        _set(self, "value", parameter.checked(self.value))
        if self.body is not None:
            if parameter.owner != "body":
                raise CommandError(f"{self.name} belongs to the {parameter.owner}; give no body")
            _set(self, "body", checked_name(self.body, "body"))


@dataclass(frozen=True)
class SetView(Command):
    """The values that the page needs in addition to positions. None by default, because each takes time.

    Parameters
    ----------
    tet_values : None, "J", "von_mises" [Pa] or "energy" [J/m^3]
    velocities, contacts : whether snapshots contain them
    """

    tet_values: str | None = None
    velocities: bool = False
    contacts: bool = False

    def __post_init__(self) -> None:
        if self.tet_values not in (None, "J", "von_mises", "energy"):
            raise CommandError(f"tet_values is {displayed(self.tet_values)}; give J, von_mises, energy or None")
        for name in ("velocities", "contacts"):
            if not isinstance(getattr(self, name), bool):
                raise CommandError(f"{name} is {displayed(getattr(self, name))}; give true or false")


@dataclass(frozen=True)
class Grab(Command):
    """Attach a spring to a point of a body, until `ReleaseGrab`. The released body keeps its velocity.

    Parameters
    ----------
    grab : a number that the page chooses. A grab that has this number already is replaced.
    body : its name.
    vertices : one to four vertices of the body's mesh, of a rigid body of its surface, numbered from 0 in the body.
    weights : one for each vertex, scaled so that their sum is 1: (1,) for a vertex, or the barycentric coordinates of a
        point on a triangle or in a tet.
    target : (3,) the point to which the spring pulls [m].
    stiffness : factor of the default stiffness, which follows from the mass and size of the body.
    """

    grab: int
    body: str
    vertices: tuple[int, ...]
    weights: tuple[float, ...]
    target: Point
    stiffness: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _set(self, "vertices", checked_vertices(self.vertices))
        _set(self, "weights", checked_weights(self.weights, len(self.vertices)))


@dataclass(frozen=True)
class MoveGrab(Command):
    """Move the target (3,) [m] of a grab."""

    grab: int
    target: Point


@dataclass(frozen=True)
class ReleaseGrab(Command):
    """Remove a grab."""

    grab: int


@dataclass(frozen=True)
class Pin(Command):
    """Hold a vertex at its current position."""

    body: str
    vertex: int


@dataclass(frozen=True)
class Unpin(Command):
    """Release a pinned vertex, or, without a vertex, all vertices that were pinned on the page."""

    body: str | None = None
    vertex: int | None = None

    def __post_init__(self) -> None:
        if (self.body is None) != (self.vertex is None):
            raise CommandError("unpin needs a body and a vertex, or neither")
        super().__post_init__()


@dataclass(frozen=True)
class Squash(Command):
    """Scale the height of all free bodies, along gravity, by `factor`. They get wider and keep their volume.

    A factor above 1 stretches them. The bodies start from this shape at rest. The lowest point does not move.
    """

    factor: float = 0.5

    def __post_init__(self) -> None:
        _set(self, "factor", number(self.factor, "factor", limits.FLATTEST, limits.TALLEST))


@dataclass(frozen=True)
class AddBody(Command):
    """Add a body of stable Neo-Hookean rubber.

    Parameters
    ----------
    shape : one of `limits.SHAPES`.
    size : edge, diameter or height of the shape [m].
    resolution : number of edges across the shape.
    position : (3,) of its center [m], or None: above all other bodies.
    youngs [Pa], poisson, density [kg/m^3]
    name : None for the name of the shape with a number.
    """

    shape: str
    size: float = 0.5
    resolution: int = 8
    position: Point | None = None
    youngs: float = 1e5
    poisson: float = 0.45
    density: float = 1000.0
    name: str | None = None


@dataclass(frozen=True)
class CopyBody(Command):
    """Add an undeformed copy of a body, at rest; `position` as for `AddBody`."""

    body: str
    position: Point | None = None


@dataclass(frozen=True)
class RemoveBody(Command):
    """Remove a body, and the pins, forces, springs and stitches on it. The last body cannot be removed."""

    body: str


def _set(command: Command, name: str, value: object) -> None:
    object.__setattr__(command, name, value)


def _parameter(value: object, what: str) -> Value:
    return find_parameter(what).checked(value)


# By name of the field: equal names have equal meanings. Fields that are not here are checked by their own class.
_CHECKS: dict[str, Callable[[Any, str], object]] = {
    "body": checked_name,
    "name": checked_name,
    "grab": checked_index,
    "vertex": checked_index,
    "target": checked_point,
    "position": checked_point,
    "size": checked_length,
    "count": partial(whole, low=1, high=limits.MOST_STEPS),
    "resolution": partial(whole, low=limits.COARSEST, high=limits.FINEST),
    "stiffness": partial(number, low=limits.WEAKEST_GRAB, high=limits.STRONGEST_GRAB),
    "shape": checked_shape,
    "youngs": _parameter,
    "poisson": _parameter,
    "density": _parameter,
}
