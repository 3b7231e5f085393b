"""What all parts of the panel share: the way to the simulation, and what is known of it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Coroutine
from typing import Any, Protocol

from supple.errors import SuppleError
from supple.viewer.protocol.commands import Command
from supple.viewer.protocol.snapshots import Snapshot


class Simulation(Protocol):
    """What the page needs of the simulation behind it; `supple.viewer.engine.engine.Engine` is one."""

    def send(self, command: Command) -> int:
        """Pass a command on; never waits for it to be acted upon. Returns its number, 0 where it was dropped."""
        ...

    def latest(self) -> Snapshot | None:
        """The newest snapshot there is; never waits."""
        ...

    @property
    def error(self) -> str | None:
        """Why it is gone, if it is."""
        ...


class Controller:
    """Passes commands on, for visitors.

    Parameters
    ----------
    simulation : see `Simulation`
    snapshot : the newest one that is on show
    """

    def __init__(self, simulation: Simulation, snapshot: Snapshot) -> None:
        self.simulation, self.snapshot = simulation, snapshot
        # Inputs are exchanged for others by the thread that draws, and by those that serve visitors.
        self.lock = threading.RLock()

    def send(self, client: Any, make: Callable[[], Command]) -> int:
        """Make a command and send it, and return its number. Where it is not to be had, the visitor is told why.

        Parameters
        ----------
        client : viser's handle of the visitor, or None where nobody in particular asks
        """
        try:
            return self.simulation.send(make())
        except SuppleError as error:
            notify(client, "Not done", str(error))
            return 0


def sequential(react: Callable[[Any], object]) -> Callable[[Any], Coroutine[Any, Any, None]]:
    """What answers to a button, as a coroutine: viser runs these one by one, right after the value has come in.

    Functions it runs in threads, in any order: one that looks at the value may see that of a later click.
    """

    async def called(event: Any) -> None:
        react(event)

    return called


def notify(client: Any, title: str, text: str, color: str = "orange") -> None:
    """Show a visitor a line for a while."""
    if client is not None:
        client.add_notification(title, text, auto_close_seconds=6.0, color=color)
