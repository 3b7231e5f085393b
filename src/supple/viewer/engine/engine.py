"""The page's end of the simulation: starts its process, tells it what to do, and knows its newest state."""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
import pickle
import threading
import time
from dataclasses import replace

from supple.errors import CommandError, SceneError, SolverError
from supple.viewer.engine.simulation_process import run_simulation
from supple.viewer.protocol.command_queue import CommandQueue
from supple.viewer.protocol.commands import Command
from supple.viewer.protocol.live_source import LiveSource
from supple.viewer.protocol.outbox import DESCRIPTION, ERROR
from supple.viewer.protocol.snapshots import SceneDescription, Snapshot

# A process that does not end by itself within this time [s] is ended.
GRACE = 2.0


class Engine:
    """A simulation in a process of its own. No method waits for the simulation, apart from the constructor.

    Safe to use from several threads. Ends with `close`, as a context manager, or with this process.

    Parameters
    ----------
    source : what to simulate.
    start_timeout : how long to wait for the first snapshot [s]; on a new machine, kernels are compiled before it.

    Raises
    ------
    SceneError, SolverError : where the source cannot be simulated.
    """

    def __init__(self, source: LiveSource, start_timeout: float = 600.0) -> None:
        self.source = source
        self._arrived = threading.Condition()
        self._description: SceneDescription | None = None
        self._raw: tuple[SceneDescription, memoryview] | None = None
        self._latest: Snapshot | None = None
        self._error: str | None = None
        self._closing = False
        self._number = 0
        self._number_lock = threading.Lock()
        self._outgoing = CommandQueue()
        context = multiprocessing.get_context("spawn")
        command_reader, self._commands = context.Pipe(duplex=False)
        self._snapshots, snapshot_writer = context.Pipe(duplex=False)
        level = logging.getLogger().getEffectiveLevel()
        self._process = context.Process(
            target=run_simulation,
            args=(source, command_reader, snapshot_writer, level),
            name="supple simulation",
            daemon=True,
        )
        try:
            self._process.start()
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise SceneError(
                f"the scene cannot be sent to a process of its own ({error}); use Keyframes in place of functions of "
                "time that are defined inside others"
            ) from None
        # Only the child holds these ends now: when it dies, this process hears of it, and the other way round.
        command_reader.close()
        snapshot_writer.close()
        threading.Thread(target=self._read, name="snapshots", daemon=True).start()
        threading.Thread(target=self._write, name="commands", daemon=True).start()
        with self._arrived:
            self._arrived.wait_for(lambda: self._raw is not None or self._error is not None, start_timeout)
        if self._raw is None:
            reason = self._error or f"the simulation has not begun within {start_timeout:g} s"
            self.close()
            raise SolverError(reason)

    def send(self, command: Command) -> int:
        """Give a command to the simulation, without waiting for it.

        Returns
        -------
        its number: once a snapshot's `applied` is that or more, it has been acted upon. 0 where the command was
        dropped, because too many are waiting or the simulation is gone.
        """
        if not isinstance(command, Command):
            raise CommandError(f"a {type(command).__name__} is no command")
        if not self.alive:
            return 0
        with self._number_lock:
            number = self._number + 1
            if not self._outgoing.put(number, command):
                return 0
            self._number = number
            return number

    def latest(self) -> Snapshot | None:
        """The newest snapshot; None before there is one. The same object until there is a newer one."""
        with self._arrived:
            if self._raw is not None:
                (description, data), self._raw = self._raw, None
                self._latest = replace(pickle.loads(data), description=description)
            return self._latest

    def wait_for(self, number: int, timeout: float = 10.0) -> Snapshot:
        """The first snapshot that is seen after a command of that number has been acted upon.

        Raises
        ------
        TimeoutError : where that takes longer than `timeout` [s], or the simulation is gone.
        """
        end = time.monotonic() + timeout
        while True:
            snapshot = self.latest()
            if snapshot is not None and snapshot.applied >= number:
                return snapshot
            left = end - time.monotonic()
            if left <= 0.0 or not self.alive:
                raise TimeoutError(self.error or f"the simulation has not answered within {timeout:g} s")
            with self._arrived:
                self._arrived.wait_for(lambda: self._raw is not None, min(left, 0.5))

    @property
    def description(self) -> SceneDescription:
        """Of the newest snapshot's scene."""
        snapshot = self.latest()
        assert snapshot is not None  # there was one when the constructor returned
        return snapshot.description

    @property
    def alive(self) -> bool:
        """Whether the simulation's process runs."""
        return not self._closing and self._error is None and self._process.is_alive()

    @property
    def error(self) -> str | None:
        """Why the simulation is gone, if it has not been closed."""
        return self._error

    def close(self) -> None:
        """End the simulation's process."""
        self._closing = True
        self._outgoing.close()
        with contextlib.suppress(OSError):
            self._commands.close()
        self._process.join(GRACE)
        if self._process.is_alive():
            self._process.terminate()
            self._process.join(GRACE)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def __enter__(self) -> Engine:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _read(self) -> None:
        """Drain the pipe, so that only the newest snapshot is ever kept."""
        while True:
            try:
                data = self._snapshots.recv_bytes()
            except (EOFError, OSError):
                break
            kind, content = data[:1], memoryview(data)[1:]
            with self._arrived:
                if kind == ERROR:
                    self._error = pickle.loads(content)
                elif kind == DESCRIPTION:
                    self._description = pickle.loads(content)
                elif self._description is not None:
                    # Unpacked only when it is asked for.
                    self._raw = self._description, content
                self._arrived.notify_all()
        self._process.join(GRACE)
        with self._arrived:
            if not self._closing and self._error is None:
                self._error = f"the simulation ended unexpectedly (exit code {self._process.exitcode})"
            self._arrived.notify_all()

    def _write(self) -> None:
        while not self._outgoing.closed:
            batch = self._outgoing.take(None)
            try:
                if batch:
                    self._commands.send(batch)
            except OSError:  # the simulation is gone; its other pipe says so
                return
