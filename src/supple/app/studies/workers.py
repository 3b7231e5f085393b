"""The worker processes of a study, on this machine or on a cluster; both are workers of `dask.distributed`."""

from __future__ import annotations

import contextlib
import logging
import os
import subprocess
import sys
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from supple.errors import StudyError
from supple.runtime.memory import available_bytes, in_words

# A worker whose memory grows beyond this share of its limit is ended by its supervisor, and started again.
_TERMINATE = 0.95
# Of the memory that is available, what all workers of this machine may use together.
_SHARE = 0.9
_CONNECT_SECONDS = 30

logger = logging.getLogger(__name__)


class Workers(ABC):
    """Processes that simulate cases, one at a time each."""

    client: Any
    """The `distributed.Client`."""

    @abstractmethod
    def able(self, bytes_needed: int) -> list[str] | None:
        """Addresses of the workers with that much memory; None for any worker."""

    @abstractmethod
    def tend(self) -> None:
        """Start again what has ended. Called about once a second."""


class LocalWorkers(Workers):
    """Workers on this machine, under one supervisor. Each has an equal share of the cores and of the memory.

    Parameters
    ----------
    count : number of workers; budget : memory of all together [bytes], None where it is unknown
    logs : folder for what the workers print
    """

    def __init__(self, client: Any, count: int, budget: int | None, scratch: Path, logs: Path) -> None:
        self.client = client
        self._log = logs / "workers.log"
        options = f"--nworkers {count} --nthreads 1 --memory-limit {budget // count if budget is not None else 0}"
        options += " --no-dashboard --death-timeout 60 --local-directory"
        self._command = [*SUPERVISOR, client.scheduler.address, *options.split(), str(scratch)]
        self._environment = os.environ | {
            # The worker must find the same packages, and the module of a function, as this process.
            "PYTHONPATH": os.pathsep.join(os.path.abspath(entry) for entry in sys.path),
            "PYTHONIOENCODING": "utf-8",
            **dict.fromkeys(_THREADS, str(max(1, (os.cpu_count() or 1) // count))),
            # A case has most of its memory in arrays of its own. The scheduler cannot move these to the disk, and a
            # pause would never end.
            "DASK_DISTRIBUTED__WORKER__MEMORY__TARGET": "False",
            "DASK_DISTRIBUTED__WORKER__MEMORY__SPILL": "False",
            "DASK_DISTRIBUTED__WORKER__MEMORY__PAUSE": "False",
            "DASK_DISTRIBUTED__WORKER__MEMORY__TERMINATE": str(_TERMINATE),
        }
        self._process = self._started()

    def able(self, bytes_needed: int) -> None:
        return None  # all have the same limit, and `local_workers` made it large enough

    def tend(self) -> None:
        if self._process.poll() is not None:
            self._process = self._started()

    def close(self) -> None:
        """End the workers at once."""
        self._process.terminate()
        try:
            self._process.wait(timeout=10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _started(self) -> subprocess.Popen:
        with self._log.open("ab") as log:
            return subprocess.Popen(
                self._command,
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                # Ctrl-C is for the study, which then ends its workers.
                start_new_session=os.name == "posix",
                creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
            )


_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS")
# Workers are forks of a process that has all modules: a new one starts at once.
_FORKING = """\
import dask, distributed.cli.dask_worker, distributed.utils
dask.config.set({"distributed.worker.multiprocessing-method": "forkserver"})
distributed.utils.get_mp_context().set_forkserver_preload(["supple.app.studies.run_case", "distributed"])
distributed.cli.dask_worker.main()
"""
_FORKS = sys.platform == "linux"
SUPERVISOR = [sys.executable, *(("-c", _FORKING) if _FORKS else ("-m", "distributed.cli.dask_worker"))]
"""The command of what `distributed` starts workers with, and starts them again; its options follow."""


class ClusterWorkers(Workers):
    """Workers that somebody else has started, of any number, on any machine."""

    def __init__(self, client: Any) -> None:
        self.client = client
        self._warned = False
        for address, worker in self._workers().items():
            if worker["nthreads"] != 1:
                raise StudyError(
                    f"the worker {address} would run {worker['nthreads']} cases at once in one process; start it with "
                    "`dask worker --nthreads 1`, and with more --nworkers"
                )

    def able(self, bytes_needed: int) -> list[str] | None:
        if not bytes_needed:
            return None
        limits = {address: worker["memory_limit"] for address, worker in self._workers().items()}
        able = [address for address, limit in limits.items() if not limit or limit >= bytes_needed]
        if not able:
            largest = in_words(max(limits.values())) if limits else "nothing"
            raise StudyError(f"needs about {in_words(bytes_needed)} of memory; the largest worker has {largest}")
        return able

    def tend(self) -> None:
        # The cluster's own supervisors start workers; they may wait long in a queue.
        missing = not self._workers()
        if missing and not self._warned:
            logger.warning("the scheduler %s has no workers; waiting for them", self.client.scheduler.address)
        self._warned = missing

    def _workers(self) -> dict[str, Any]:
        return self.client.scheduler_info(n_workers=-1)["workers"]


Opener = Callable[[int], contextlib.AbstractContextManager[Workers]]
"""Workers of which each has at least this many bytes; `StudyError` where that is impossible."""


def local_workers(count: int | None, logs: Path) -> Opener:
    """Opens `count` workers on this machine (None: one per core), or fewer where the memory allows only fewer."""
    cores = os.cpu_count() or 1
    available = available_bytes()
    budget = int(_SHARE * available) if available is not None else None

    @contextmanager
    def opened(bytes_needed: int) -> Iterator[Workers]:
        from distributed import Client, LocalCluster

        wanted = cores if count is None else count
        if bytes_needed and budget is not None:
            if bytes_needed > budget:
                raise StudyError(f"needs about {in_words(bytes_needed)} of memory; {in_words(budget)} can be used here")
            wanted = min(wanted, budget // bytes_needed)
        logs.mkdir(parents=True, exist_ok=True)
        with _quiet(), ExitStack() as stack:
            scratch = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="supple-workers-")))
            cluster = stack.enter_context(LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address="127.0.0.1:0"))
            client = stack.enter_context(Client(cluster, set_as_default=False))
            workers = LocalWorkers(client, wanted, budget, scratch, logs)
            stack.callback(workers.close)
            yield workers

    return opened


def cluster_workers(scheduler: str) -> Opener:
    """Opens a connection to a scheduler of `dask.distributed`, such as "tcp://node1:8786"."""

    @contextmanager
    def opened(bytes_needed: int) -> Iterator[Workers]:
        from distributed import Client

        try:
            client = Client(scheduler, timeout=_CONNECT_SECONDS, set_as_default=False)
        except (OSError, ValueError, RuntimeError) as error:
            reason = " ".join(str(error).split())
            raise StudyError(f"the scheduler {scheduler} cannot be reached: {reason}; see `dask scheduler`") from None
        with _quiet(), client:
            yield ClusterWorkers(client)

    return opened


@contextmanager
def _quiet() -> Iterator[None]:
    """Without the messages of `distributed`, which report each connection; lost workers are in the results."""
    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] == "distributed"]
    before = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)
