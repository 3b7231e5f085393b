"""`supple.Batch`: many independent copies of a scene that are stepped together."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.app.learning.copies import Copy, Moment, same_bodies, scenes_of
from supple.errors import SceneError, SolverError
from supple.model.state import Status
from supple.results.frame import Frame
from supple.runtime.memory import require_memory
from supple.runtime.thread_tuning import ThreadTuner
from supple.runtime.threads import numba_threads
from supple.scene.scene import Scene
from supple.simulate import check_timing
from supple.solvers.solver import Solver
from supple.solvers.xpbd.solver import XPBD

# After how many steps the slower of one thread and several is measured again.
_MEASURED_EACH = 50


@dataclass(frozen=True, eq=False)
class BatchSnapshot:
    """Where all copies of a batch were at one time; see `Batch.snapshot`.

    Attributes
    ----------
    moments : of each copy, in their order
    """

    moments: tuple[Moment, ...]


class Batch:
    """n copies of a scene. Each has the bits of a simulation of its own, for any number of threads.

    A copy that its solver cannot continue stays where it is until it is restored.

    Parameters
    ----------
    scene : for all copies; or a function that returns one for each copy. Each copy has inputs of its own.
    n : number of copies
    solver : of all copies
    dt : length of a step [s]
    parameters : for a function: by name, n values in its units, of which each copy gets its own
    threads : number of threads that step copies; None: one, or one per core where that is measured to be faster. Each
        copy runs on one of them.

    Raises
    ------
    SceneError, SolverError : where a scene cannot be simulated.
    """

    def __init__(
        self,
        scene: Scene | Callable[..., Scene],
        n: int,
        solver: Solver | None = None,
        dt: float = 1.0 / 60.0,
        *,
        parameters: Mapping[str, Sequence[Any] | NDArray[Any]] | None = None,
        threads: int | None = None,
    ) -> None:
        for name, count in (("n", n), ("threads", threads)):
            if count is not None and (isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < 1):
                raise SceneError(f"Batch: {name} is {count!r}; give a whole number above zero")
        solver = XPBD() if solver is None else solver
        if not isinstance(solver, Solver):
            raise SolverError(f"Batch: the solver is {solver!r}; give XPBD(...) or Implicit(...)")
        check_timing("Batch", dt, 1)
        self.dt = float(dt)
        scenes = scenes_of(scene, int(n), parameters)
        needed = sum(solver.bytes_needed(one) for one in scenes)
        require_memory(needed, f"Batch: {n} copies of the scene", "give fewer copies, or make the meshes coarser")
        self.threads = min(int(n), int(threads or os.cpu_count() or 1))
        choice = threads is None and self.threads > 1
        self._pace = ThreadTuner(choice, parallel=self.threads > 1 and not choice, interval=_MEASURED_EACH)
        with numba_threads(1):
            self._copies = [Copy.of(one, solver) for one in scenes]
        same_bodies(self._copies)
        self._start = self.snapshot()
        self._pool: ThreadPoolExecutor | None = None
        self._process = os.getpid()

    def __len__(self) -> int:
        return len(self._copies)

    @property
    def scenes(self) -> tuple[Scene, ...]:
        return tuple(copy.system.scene for copy in self._copies)

    def step(self, actions: Mapping[str, ArrayLike] | None = None, copies: ArrayLike | None = None) -> None:
        """Advance copies by `dt`.

        Parameters
        ----------
        actions : by name of an input, its values for the end of the step: one for each copy, in an array with n rows,
            or one for all. Other inputs stay as they are.
        copies : which ones, as for `restore`; the others stay where they are

        Raises
        ------
        SceneError, SolverError : where an action does not suit its input, or a step cannot begin; no copy has moved.
        """
        wanted = self._wanted(actions)
        moving = self._numbers(copies)
        after: dict[int, Moment] = {}
        left = iter(moving)  # each thread takes the next copy; the iterator of a list is safe in threads

        def work() -> None:
            with numba_threads(1):
                for k in left:
                    after[k] = self._copies[k].after(self.dt, wanted[k])

        several, began = self._pace.choose(), perf_counter()
        if not several:
            work()
        else:
            pool = self._threads()
            running = [pool.submit(work) for _ in range(self.threads)]
            for error in [one.exception() for one in running]:  # waits for all of them
                if error is not None:
                    raise error
        self._pace.note(several, perf_counter() - began)
        for k, moment in after.items():
            self._copies[k].now = moment

    def snapshot(self) -> BatchSnapshot:
        """Where all copies are. Steps from there have the same bits each time, also from the middle of contact."""
        return BatchSnapshot(tuple(copy.now for copy in self._copies))

    def restore(self, snapshot: BatchSnapshot, copies: ArrayLike | None = None) -> None:
        """Put copies back to where they were.

        Parameters
        ----------
        snapshot : of this batch
        copies : their numbers, or n truth values; None: all

        Raises
        ------
        SceneError : where the snapshot is not of this batch, or no such copy exists.
        """
        if not isinstance(snapshot, BatchSnapshot):
            raise SceneError(f"Batch: the snapshot is {snapshot!r}; give what `snapshot` returned")
        for k in self._numbers(copies):
            moment = snapshot.moments[k] if k < len(snapshot.moments) else None
            state = self._copies[k].now.state
            if (
                moment is None
                or moment.state.positions.shape != state.positions.shape
                or moment.state.inputs.keys() != state.inputs.keys()
            ):
                raise SceneError(f"Batch: the snapshot does not describe copy {k}; give one of this batch")
        for k in self._numbers(copies):
            self._copies[k].now = snapshot.moments[k]

    def reset(self, copies: ArrayLike | None = None) -> None:
        """Put copies back to the start; `copies` as for `restore`."""
        self.restore(self._start, copies)

    @property
    def times(self) -> NDArray[np.float64]:
        """(n,) [s]."""
        return np.array([copy.now.state.time for copy in self._copies])

    @property
    def statuses(self) -> tuple[Status, ...]:
        """How the last step of each copy ended."""
        return tuple(copy.now.step.status for copy in self._copies)

    @property
    def can_go_on(self) -> NDArray[np.bool_]:
        """(n,) whether the solver can continue each copy."""
        return np.array([status.can_go_on for status in self.statuses])

    @property
    def positions(self) -> dict[str, NDArray[np.float64]]:
        """By body name, (n, vertices, 3) [m]."""
        return self._by_body([copy.now.state.positions for copy in self._copies])

    @property
    def velocities(self) -> dict[str, NDArray[np.float64]]:
        """By body name, (n, vertices, 3) [m/s]."""
        return self._by_body([copy.now.state.velocities for copy in self._copies])

    @property
    def inputs(self) -> dict[str, NDArray[np.float64]]:
        """The present values of inputs by name, (n, 3) or (n, k, 3)."""
        names = self._copies[0].system.scene.inputs
        return {name: np.stack([copy.now.state.inputs[name] for copy in self._copies]) for name in names}

    def frame(self, copy: int) -> Frame:
        """The frame of one copy, with its report; `wall_seconds` is not measured."""
        return self._copies[self._numbers([copy])[0]].frame()

    def observe(self, observation: Callable[[Frame], ArrayLike]) -> NDArray[Any]:
        """What a function of a frame returns for each copy, as one array with n rows."""
        return np.stack([np.asarray(observation(copy.frame())) for copy in self._copies])

    def close(self) -> None:
        """End the threads. Another step starts them again."""
        if self._pool is not None and self._process == os.getpid():
            self._pool.shutdown()
        self._pool = None

    def __enter__(self) -> Batch:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _threads(self) -> ThreadPoolExecutor:
        if self._pool is None or self._process != os.getpid():  # a forked process does not have the threads
            self._pool, self._process = ThreadPoolExecutor(self.threads, thread_name_prefix="supple-batch"), os.getpid()
        return self._pool

    def _wanted(self, actions: Mapping[str, ArrayLike] | None) -> list[dict[str, NDArray[np.float64]]]:
        """The checked actions of each copy."""
        wanted: list[dict[str, NDArray[np.float64]]] = [{} for _ in self._copies]
        if actions is None:
            return wanted
        if not isinstance(actions, Mapping):
            raise SceneError(f"Batch: actions are {actions!r}; give a mapping from names of inputs to values")
        inputs = self._copies[0].system.scene.inputs
        for name, given in actions.items():
            if name not in inputs:
                raise SceneError(
                    f"Batch: input {name!r} does not exist; there are: {', '.join(sorted(inputs)) or 'none'}"
                )
            rows = np.asarray(given)
            one_each = rows.shape == (len(self), *inputs[name].value.shape)
            for k, values in enumerate(wanted):
                values[name] = inputs[name].checked(rows[k] if one_each else given)
        return wanted

    def _by_body(self, rows: list[NDArray[np.float64]]) -> dict[str, NDArray[np.float64]]:
        split = [copy.system.split(values) for copy, values in zip(self._copies, rows, strict=True)]
        return {name: np.stack([one[name] for one in split]) for name in split[0]}

    def _numbers(self, copies: ArrayLike | None) -> list[int]:
        if copies is None:
            return list(range(len(self)))
        given = np.atleast_1d(np.asarray(copies))
        if given.dtype == np.bool_ and given.shape == (len(self),):
            return np.flatnonzero(given).tolist()
        if given.ndim != 1 or (given.size and given.dtype.kind not in "iu"):
            raise SceneError(f"Batch: copies are {copies!r}; give numbers of copies, or {len(self)} truth values")
        for k in given:
            if not 0 <= k < len(self):
                raise SceneError(f"Batch: copy {k} does not exist; there are {len(self)}")
        return [int(k) for k in given]
