"""The simulation as the page sees it: starts its process, sends commands, and receives snapshots."""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

from supple.app.viewer.engine.simulation_process import run_simulation
from supple.app.viewer.protocol.command_queue import CommandQueue
from supple.app.viewer.protocol.commands import Command
from supple.app.viewer.protocol.live_source import LiveSource
from supple.app.viewer.protocol.outbox import DESCRIPTION, ERROR, PROGRESS, SNAPSHOT
from supple.app.viewer.protocol.snapshots import Progress, SceneDescription, Snapshot
from supple.errors import CommandError, SceneError, SolverError

# A process that does not end by itself within this time [s] is terminated.
GRACE = 2.0


@contextlib.contextmanager
def _interrupts_held() -> Iterator[None]:
    """Ctrl-C waits for the end of this block. A process that starts in it never hears of Ctrl-C, so also not before it
    can ignore that."""
    heard: list[bool] = []
    handler = signal.getsignal(signal.SIGINT)
    is_heard = callable(handler) and threading.current_thread() is threading.main_thread()
    if is_heard:
        signal.signal(signal.SIGINT, lambda *_: heard.append(True))
    can_block = hasattr(signal, "pthread_sigmask")  # not in Windows
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if can_block else set()
    try:
        yield
    finally:
        if can_block:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if is_heard:
            signal.signal(signal.SIGINT, handler)
    if heard:
        raise KeyboardInterrupt


@contextlib.contextmanager
def _program_not_read() -> Iterator[None]:
    """A process that starts in this block does not execute the user's program, which would start it once more.

    It need not: what the program defines is in what the process is sent.
    """
    program = sys.modules["__main__"]
    hidden = {key: vars(program).pop(key) for key in ("__file__", "__spec__") if key in vars(program)}
    program.__spec__ = None
    try:
        yield
    finally:
        vars(program).update(hidden)


class Engine:
    """A simulation in its own process. Only the constructor, `restart` and `wait...` wait for it.

    Thread-safe. The process ends with `close`, at the end of the context, or with this process.

    Parameters
    ----------
    source : what to simulate; again : reads it again, where it comes from files
    start_timeout : longest time to wait for the first snapshot [s]; on a new machine, kernels are compiled before it.
    wait : whether the constructor waits for it; see `wait_for_start`

    Attributes
    ----------
    starts : how often it was started
    error : why the simulation ended, where it was not closed; otherwise None
    progress : of the current step, where it takes long; heard_at : when the last message came [s of time.monotonic]

    Raises
    ------
    SceneError, SolverError : where the source cannot be simulated.
    """

    def __init__(
        self,
        source: LiveSource,
        again: Callable[[], LiveSource] | None = None,
        start_timeout: float = 600.0,
        *,
        wait: bool = True,
    ) -> None:
        self.source, self.again = source, again
        self.starts = 0
        self._arrived = threading.Condition()
        self._start_timeout = start_timeout
        self._number = 0
        self._number_lock = threading.Lock()
        self._latest: Snapshot | None = None
        self._start()
        if wait:
            self.wait_for_start()

    def _start(self) -> None:
        """Start the process."""
        from numba import cloudpickle

        try:
            source = cloudpickle.dumps(self.source)
        except Exception as error:  # whatever a function of the user refers to
            raise SceneError(
                f"the scene cannot be sent to another process ({error}); use Keyframes, Curve, or functions of time "
                "that refer to numbers and arrays only"
            ) from None
        self.starts += 1  # before any snapshot of it comes
        self._begun = False  # whether one has come
        self._description: SceneDescription | None = None
        self._raw: tuple[SceneDescription, memoryview] | None = None
        self.error: str | None = None
        self.progress: Progress | None = None
        self.heard_at = time.monotonic()
        self._closing = False
        self._outgoing = CommandQueue()
        context = multiprocessing.get_context("spawn")
        command_reader, self._commands = context.Pipe(duplex=False)
        self._snapshots, snapshot_writer = context.Pipe(duplex=False)
        level = logging.getLogger().getEffectiveLevel()
        self._process = context.Process(
            target=run_simulation,
            args=(source, command_reader, snapshot_writer, level, self._number),
            name="supple simulation",
            daemon=True,
        )
        with _interrupts_held(), _program_not_read():
            self._process.start()
        # Only the child keeps these ends open: so each process detects the end of the other one.
        command_reader.close()
        snapshot_writer.close()
        self._reader = threading.Thread(target=self._read, name="snapshots", daemon=True)
        self._reader.start()
        threading.Thread(target=self._write, args=(self._outgoing,), name="commands", daemon=True).start()

    def wait_for_start(self) -> None:
        """Wait for the first snapshot of the process.

        Raises
        ------
        SceneError, SolverError : where none comes.
        """
        with self._arrived:
            self._arrived.wait_for(lambda: self._begun or self.error is not None, self._start_timeout)
        if not self._begun:
            reason = self.error or f"the simulation did not start within {self._start_timeout:g} s"
            self.close()
            raise SolverError(reason)

    def restart(self) -> None:
        """Start the simulation again from its source, in a new process. Waits for its first snapshot.

        Raises
        ------
        SceneError, SolverError : see above; the error is kept.
        """
        self.close()
        self._reader.join()  # at the end of its pipe
        try:
            self._start()
            self.wait_for_start()
        except (SceneError, SolverError) as error:
            self.error = self.error or str(error)
            raise

    def reload(self) -> None:
        """Read the source again, and start from it. What runs continues where it cannot be read.

        Raises
        ------
        SuppleError : where it cannot be read, or not be simulated; see `restart`.
        """
        assert self.again is not None
        self.source = self.again()
        self.restart()

    def send(self, command: Command) -> int:
        """Send a command to the simulation, without waiting for it.

        Returns
        -------
        its number: the command has been executed once `applied` of a snapshot is at least this number. 0 where the
        command was dropped, because too many wait or the simulation has ended.
        """
        if not isinstance(command, Command):
            raise CommandError(
                f"a {type(command).__name__} is not a command; give one of supple.app.viewer.protocol.commands"
            )
        if not self.alive:
            return 0
        with self._number_lock:
            number = self._number + 1
            if not self._outgoing.put(number, command):
                return 0
            self._number = number
            return number

    def latest(self) -> Snapshot | None:
        """The newest snapshot, or None; the same object until a newer one arrives."""
        with self._arrived:
            if self._raw is not None:
                (description, data), self._raw = self._raw, None
                self._latest = replace(pickle.loads(data), description=description)
            return self._latest

    def wait_for_news(self, seconds: float) -> None:
        """Wait until there is a new snapshot, but not longer than `seconds`."""
        with self._arrived:
            self._arrived.wait_for(lambda: self._raw is not None, seconds)

    def wait_for(self, number: int, timeout: float = 10.0) -> Snapshot:
        """The first received snapshot after the command of this number has been executed.

        Raises
        ------
        TimeoutError : where this takes longer than `timeout` [s], or the simulation has ended.
        """
        end = time.monotonic() + timeout
        while True:
            snapshot = self.latest()
            if snapshot is not None and snapshot.applied >= number:
                return snapshot
            left = end - time.monotonic()
            if left <= 0.0 or not self.alive:
                raise TimeoutError(self.error or f"the simulation did not answer within {timeout:g} s")
            with self._arrived:
                self._arrived.wait_for(lambda: self._raw is not None, min(left, 0.5))

    @property
    def description(self) -> SceneDescription:
        """The description of the newest snapshot."""
        snapshot = self.latest()
        assert snapshot is not None  # the constructor waits for the first one
        return snapshot.description

    @property
    def alive(self) -> bool:
        """Whether the process of the simulation runs."""
        return not self._closing and self.error is None and self._process.is_alive()

    def close(self) -> None:
        """End the process of the simulation."""
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
        """Read all messages, and keep only the newest snapshot."""
        while True:
            try:
                data = self._snapshots.recv_bytes()
            except (EOFError, OSError):
                break
            kind, content = data[:1], memoryview(data)[1:]
            with self._arrived:
                self.heard_at = time.monotonic()
                self.progress = pickle.loads(content) if kind == PROGRESS else None
                if kind == ERROR:
                    self.error = pickle.loads(content)
                elif kind == DESCRIPTION:
                    self._description = pickle.loads(content)
                elif kind == SNAPSHOT and self._description is not None:
                    # Unpickled only when `latest` is called.
                    self._raw, self._begun = (self._description, content), True
                self._arrived.notify_all()
        self._process.join(GRACE)
        with self._arrived:
            if not self._closing and self.error is None:
                self.error = f"the simulation ended unexpectedly (exit code {self._process.exitcode})"
            self._arrived.notify_all()

    def _write(self, outgoing: CommandQueue) -> None:
        commands = self._commands
        while not outgoing.closed:
            batch = outgoing.take(None)
            try:
                if batch:
                    commands.send(batch)
            except OSError:  # the simulation has ended; `_read` detects it
                return
