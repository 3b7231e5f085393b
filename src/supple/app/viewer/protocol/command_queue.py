"""A bounded queue of commands, in order. Of the moves of one grab it keeps only the newest."""

from __future__ import annotations

import threading
from collections.abc import Hashable, Iterable
from typing import TypeVar

from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.commands import (
    Command,
    Grab,
    MoveGrab,
    ReleaseGrab,
    SetParameter,
    SetSpeed,
    SetView,
    Unpin,
)

Numbered = tuple[int, Command]
Kind = TypeVar("Kind", bound=Command)


def subject(command: Command) -> Hashable | None:
    """The key of what a command sets; None for commands of which each one counts."""
    match command:
        case MoveGrab(grab=grab):
            return "grab", grab
        case SetParameter(name=name, body=body):
            return "parameter", name, body
        case SetSpeed() | SetView():
            return type(command)
        case Unpin(body=None):
            return "unpin"
        case _:
            return None


class CommandQueue:
    """A bounded queue between two threads. A newer command replaces an older one with the same `subject`.

    It does so only where no other kind of command came between the two, so that the result is the same: a move after
    the release of a grab differs from a move before it.
    """

    def __init__(self, capacity: int = limits.MOST_WAITING) -> None:
        self.capacity = capacity
        self.dropped = 0
        self._grabs: set[int] = set()  # that were accepted and not released yet
        self._waiting: list[Numbered] = []
        self._places: dict[Hashable, int] = {}
        self._changed = threading.Condition()
        self.closed = False  # whether no more commands will come

    def put(self, number: int, command: Command) -> bool:
        """Append a command. Returns False where the queue is full: the command is dropped.

        The release of an accepted grab is never dropped, because its spring would not stop pulling.
        """
        with self._changed:
            about = subject(command)
            if about is not None and about in self._places:
                self._waiting[self._places[about]] = number, command
            elif len(self._waiting) >= self.capacity and not self._releases(command):
                self.dropped += 1
                return False
            else:
                if about is None or (isinstance(command, SetParameter) and self._sets(command.name)):
                    self._places.clear()
                if about is not None:
                    self._places[about] = len(self._waiting)
                self._waiting.append((number, command))
                if isinstance(command, Grab):
                    self._grabs.add(command.grab)
                elif isinstance(command, ReleaseGrab):
                    self._grabs.discard(command.grab)
            self._changed.notify()
            return True

    def put_all(self, commands: Iterable[Numbered]) -> None:
        """Append commands."""
        for number, command in commands:
            self.put(number, command)

    def take(self, timeout: float | None) -> list[Numbered]:
        """All waiting commands, oldest first. Waits for the first one up to `timeout` [s] (None: without limit)."""
        with self._changed:
            if not self._waiting and not self.closed:
                self._changed.wait(timeout)
            commands, self._waiting = self._waiting, []
            self._places.clear()
            return commands

    def take_leading(self, kind: type[Kind]) -> list[tuple[int, Kind]]:
        """The oldest waiting commands, up to the first one of another kind. Never waits."""
        taken: list[tuple[int, Kind]] = []
        with self._changed:
            for number, command in self._waiting:
                if not isinstance(command, kind):
                    break
                taken.append((number, command))
            if taken:
                del self._waiting[: len(taken)]
                self._places.clear()
        return taken

    def holds(self, *kinds: type[Command]) -> bool:
        """Whether a command of one of these kinds waits."""
        with self._changed:
            return any(isinstance(command, kinds) for _, command in self._waiting)

    def close(self) -> None:
        """Wake the reader; no more commands will come."""
        with self._changed:
            self.closed = True
            self._changed.notify_all()

    def _releases(self, command: Command) -> bool:
        return isinstance(command, ReleaseGrab) and command.grab in self._grabs

    def _sets(self, parameter: str) -> bool:
        """Whether a waiting command sets this parameter. The order of "one body" and "all bodies" must be kept."""
        return any(isinstance(key, tuple) and key[:2] == ("parameter", parameter) for key in self._places)
