"""One browser: what it sends becomes commands, and what it gets waits until it has drawn what it got before."""

from __future__ import annotations

import asyncio
import itertools
import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

from supple.app.viewer.protocol import commands
from supple.app.viewer.protocol.commands import Command, Grab, MoveGrab, Pin, ReleaseGrab, SetView, Unpin
from supple.app.viewer.protocol.values import checked_point, displayed
from supple.errors import CommandError, SuppleError

if TYPE_CHECKING:  # the page is there before the scene
    from supple.results.view.model import RenderFrame
    from supple.results.view.picking import SurfacePoint

# What a browser may ask for by name, with the fields of the command.
_NAMES = ("Play", "Pause", "Step", "Reset", "SetSpeed", "SetSolver", "SetParameter", "Unpin")
_COMMANDS: dict[str, Callable[..., Command]] = {name: getattr(commands, name) for name in _NAMES}
_numbers = itertools.count(1)  # of grabs


class Shown(Protocol):
    """The page of which a visitor asks something; `LivePage` is one."""

    frame: RenderFrame | None

    def send(self, command: Command) -> None: ...

    def view(self, wanted: SetView) -> None: ...

    def record(self, visitor: Visitor, on: object) -> None: ...

    def start_again(self, visitor: Visitor, *, reload: bool) -> None: ...


class Visitor:
    """A browser.

    Parameters
    ----------
    page : which it shows; connection : its websocket
    """

    def __init__(self, page: Shown, connection: Any) -> None:
        self._page, self._connection = page, connection
        self._waiting: dict[str, bytes | str] = {}
        self._changed = asyncio.Event()
        self._grab: int | None = None
        self._acts: dict[str, Callable[..., object]] = {
            "drawn": self._drawn,
            "grab": self._pull,
            "move": self._move,
            "release": self.release,
            "click": self._click,
            "view": self._view,
            "record": lambda on: page.record(self, on),
            "restart": lambda: page.start_again(self, reload=False),
            "reload": lambda: page.start_again(self, reload=True),
        }
        self.is_free = True  # whether it has drawn the last frame
        self.has_scene = -1  # number of the scene that it has
        self.seen: Any = None  # the last snapshot that it got

    def put(self, kind: str, message: bytes | str) -> None:
        """Send a message; a newer one of its kind replaces one that was not sent yet. In the thread of the server."""
        self._waiting[kind] = message
        self._changed.set()

    def tell(self, level: str, text: str) -> None:
        """Show a line of text for some seconds."""
        self.put(f"notice {text}", json.dumps({"kind": "notice", "level": level, "text": text}))

    async def send_all(self) -> None:
        """Send what waits, without an end."""
        while True:
            await self._changed.wait()
            self._changed.clear()
            waiting, self._waiting = self._waiting, {}
            for message in waiting.values():
                await self._connection.send(message)

    def receive(self, message: str | bytes) -> None:
        """Act on a message of the browser; one that makes no sense is rejected in a line of text."""
        try:
            asked = _read(message)
            name = asked.pop("act", None)
            if isinstance(name, str) and name in _COMMANDS:
                self._page.send(_made(_COMMANDS[name], asked))
            elif isinstance(name, str) and name in self._acts:
                _made(self._acts[name], asked)
            else:
                raise CommandError(f"{displayed(name)} is not an act of this page")
        except SuppleError as error:
            self.tell("error", f"Rejected: {error}")

    def _drawn(self) -> None:
        self.is_free = True

    def _pull(self, point: object, target: object, strength: float = 1.0) -> None:
        self.release()
        at = self._at(point)
        vertices, weights = tuple(int(v) for v in at.vertices), tuple(float(w) for w in at.weights)
        command = Grab(next(_numbers), at.body.name, vertices, weights, checked_point(target, "target"), strength)
        self._grab = command.grab
        self._page.send(command)

    def _move(self, target: object) -> None:
        if self._grab is not None:
            self._page.send(MoveGrab(self._grab, checked_point(target, "target")))

    def release(self) -> None:
        """End the grab, where there is one."""
        if self._grab is not None:
            self._page.send(ReleaseGrab(self._grab))
        self._grab = None

    def _click(self, point: object) -> None:
        """Pin the vertex there, or unpin it."""
        at, frame = self._at(point), self._page.frame
        vertex = at.nearest_vertex
        held = frame is not None and vertex + at.body.vertices.start in frame.pinned
        self._page.send((Unpin if held else Pin)(at.body.name, vertex))

    def _at(self, point: object) -> SurfacePoint:
        from supple.results.view.picking import nearest_surface_point

        frame = self._page.frame
        if frame is None:
            raise CommandError("the simulation has not started yet")
        return nearest_surface_point(frame, checked_point(point, "point"))

    def _view(self, field: object, contacts: object) -> None:
        self._page.view(SetView(field, contacts))  # pyright: ignore[reportArgumentType] - it checks them


def _read(message: str | bytes) -> dict[str, Any]:
    try:
        asked = json.loads(message)
    except (ValueError, RecursionError):
        raise CommandError("a message is not JSON") from None
    if not isinstance(asked, dict):
        raise CommandError("a message is not an object")
    return asked


def _made(kind: Callable[..., Any], values: dict[str, Any]) -> Any:
    try:
        return kind(**values)
    except TypeError:
        name = kind.__name__.strip("_") if hasattr(kind, "__name__") else "act"
        raise CommandError(f"{name} does not take {', '.join(map(displayed, values)) or 'nothing'}") from None
