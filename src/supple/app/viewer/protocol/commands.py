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
    boolean,
    checked_index,
    checked_name,
    checked_point,
    checked_vertices,
    checked_weights,
    number,
    one_of,
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
    """Return to the start. Grabs, and pins made on the page, are removed.

    Parameters and solver do not change.
    """


@dataclass(frozen=True)
class SetSpeed(Command):
    """Slow motion: 1 is real time, 0.1 is a tenth of it. The time step of the simulation does not change."""

    factor: float


@dataclass(frozen=True)
class Watch(Command):
    """Whether anybody watches. Where nobody does, time does not run; a requested `Step` is still taken."""

    watched: bool


@dataclass(frozen=True)
class SetSolver(Command):
    """Continue from the current state with another solver: "xpbd" or "implicit"."""

    kind: str


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
        super().__post_init__()
        _set(self, "value", parameter.checked(self.value))
        if self.body is not None and parameter.owner != "body":
            raise CommandError(f"{self.name} belongs to the {parameter.owner}; give no body")


@dataclass(frozen=True)
class SetView(Command):
    """The values that the page needs in addition to positions. None by default, because each takes time.

    Parameters
    ----------
    tet_values : None, "J", "von_mises" [Pa] or "energy" [J/m^3]
    contacts : whether snapshots contain them
    """

    tet_values: str | None = None
    contacts: bool = False


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


def _set(command: Command, name: str, value: object) -> None:
    object.__setattr__(command, name, value)


# By name of the field: equal names have equal meanings. Fields that are not here are checked by their own class.
_CHECKS: dict[str, Callable[[Any, str], object]] = {
    "body": checked_name,
    "factor": lambda value, _: number(value, "speed", limits.SLOWEST_MOTION, limits.FASTEST_MOTION),
    "watched": boolean,
    "kind": lambda value, _: one_of(value, "solver", ("xpbd", "implicit")),
    "tet_values": partial(one_of, names=(None, "J", "von_mises", "energy")),
    "contacts": boolean,
    "vertices": checked_vertices,
    "grab": checked_index,
    "vertex": checked_index,
    "target": checked_point,
    "count": partial(whole, low=1, high=limits.MOST_STEPS),
    "stiffness": partial(number, low=limits.WEAKEST_GRAB, high=limits.STRONGEST_GRAB),
}
