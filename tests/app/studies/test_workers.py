"""What a study does about the workers of a cluster that it finds."""

import logging
from types import SimpleNamespace

import pytest

import supple as sp
from supple.app.studies.workers import ClusterWorkers


def client(*workers):
    """A client of a scheduler that reports these workers, (nthreads, memory_limit) each."""
    infos = {f"tcp://w{k}": {"nthreads": n, "memory_limit": limit} for k, (n, limit) in enumerate(workers)}
    address = SimpleNamespace(address="tcp://here")
    return SimpleNamespace(scheduler=address, scheduler_info=lambda n_workers: {"workers": infos}), infos


def test_workers_with_several_threads_are_refused():
    with pytest.raises(sp.StudyError, match=r"tcp://w1 would run 4 cases at once in one process; .* --nthreads 1"):
        ClusterWorkers(client((1, 0), (4, 0))[0])


def test_cases_go_to_workers_with_enough_memory():
    workers = ClusterWorkers(client((1, 1_000), (1, 3_000), (1, 0))[0])
    assert workers.able(0) is None
    assert workers.able(2_000) == ["tcp://w1", "tcp://w2"]  # 0 is no limit
    with pytest.raises(sp.StudyError, match="needs about 2 kB of memory; the largest worker has 1 kB"):
        ClusterWorkers(client((1, 1_000))[0]).able(2_000)


def test_a_scheduler_without_workers_is_reported_once(caplog):
    given, infos = client()
    workers = ClusterWorkers(given)
    with caplog.at_level(logging.WARNING):
        workers.tend()
        workers.tend()
    assert [record.message for record in caplog.records] == [
        "the scheduler tcp://here has no workers; waiting for them"
    ]
    infos["tcp://w0"] = {"nthreads": 1, "memory_limit": 0}
    workers.tend()
    infos.clear()
    workers.tend()
    assert len(caplog.records) == 2
