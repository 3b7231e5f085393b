"""Shared by all parts of the panel: sends commands to the simulation, and keeps its newest snapshot."""

from __future__ import annotations

import threading
from collections.abc import Callable, Coroutine
from typing import Any, Protocol

from supple.app.viewer.protocol.commands import Command
from supple.app.viewer.protocol.snapshots import Progress, Snapshot
from supple.errors import SuppleError


class Simulation(Protocol):
    """The interface that the page needs of a simulation; `supple.app.viewer.engine.engine.Engine` implements it."""

    def send(self, command: Command) -> int:
        """Send a command, without waiting for its execution. Returns its number, or 0 where it was dropped."""
        ...

    def latest(self) -> Snapshot | None:
        """The newest snapshot; never waits."""
        ...

    def wait_for_news(self, seconds: float) -> None:
        """Wait until there is a new snapshot, or for some seconds."""
        ...

    @property
    def error(self) -> str | None:
        """Why the simulation ended, or None."""
        ...

    @property
    def progress(self) -> Progress | None:
        """Of the current step, where it takes long."""
        ...

    @property
    def heard_at(self) -> float:
        """When the last message of the simulation came [s of `time.monotonic`]."""
        ...

    @property
    def starts(self) -> int:
        """How often it was started: each time, what is drawn is another scene."""
        ...

    @property
    def again(self) -> Callable[[], Any] | None:
        """Reads the scene again; None where it does not come from files."""
        ...

    def restart(self) -> None:
        """Start the simulation again. Raises `SuppleError` where that is impossible."""
        ...

    def reload(self) -> None:
        """Read the scene again, and start it. Raises `SuppleError` where that is impossible."""
        ...


class Controller:
    """Sends the commands of visitors.

    Parameters
    ----------
    simulation : see `Simulation`
    snapshot : the newest one that was drawn
    """

    def __init__(self, simulation: Simulation, snapshot: Snapshot) -> None:
        self.simulation, self.snapshot = simulation, snapshot
        # The drawing thread and the threads that serve visitors replace inputs.
        self.lock = threading.RLock()

    def send(self, client: Any, make: Callable[[], Command]) -> int:
        """Create and send a command; returns its number. Where it is invalid, tells the visitor, and returns 0.

        Parameters
        ----------
        client : handle of viser for the visitor, or None where no visitor sent it
        """
        try:
            return self.simulation.send(make())
        except SuppleError as error:
            notify(client, "Rejected", str(error))
            return 0


def sequential(react: Callable[[Any], object]) -> Callable[[Any], Coroutine[Any, Any, None]]:
    """An event handler as coroutine: viser runs coroutines in order, directly after it has set the value.

    It runs plain functions in threads, in any order: one that reads the value may read that of a later click.
    """

    async def called(event: Any) -> None:
        react(event)

    return called


def notify(client: Any, title: str, text: str, color: str = "orange") -> None:
    """Display a line to a visitor for some seconds."""
    if client is not None:
        client.add_notification(title, text, auto_close_seconds=6.0, color=color)
