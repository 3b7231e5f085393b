"""Kernels over several threads: which form runs, with the same bits, in threads, after a fork, for any layer."""

import os
import subprocess
import sys
import threading

import numba
import numpy as np
import pytest

from supple.runtime import parallel_kernel
from supple.runtime.kernel_cache import ROWS, njit, prange
from supple.runtime.threads import numba_threads, one_thread


@njit(parallel=True)
def squares(x, out):
    for i in prange(len(x)):
        out[i] = x[i] * x[i] + 0.1


@njit
def twice(x, out):
    squares(x, out)
    squares(out.copy(), out)


@pytest.mark.parametrize("kernel", [squares, twice])
def test_both_forms_have_the_same_bits(kernel):
    x = np.random.default_rng(1).normal(size=ROWS)
    results = [np.zeros(ROWS) for _ in range(3)]
    kernel(x, results[0])
    kernel.serial(x, results[1])
    kernel.parallel(x, results[2])
    assert np.array_equal(results[0], results[1])
    assert np.array_equal(results[0], results[2])
    assert len(kernel.forms) == 2


def calls_of(monkeypatch, kernel):
    """The forms that are called, as they are called."""
    called = []
    for form in ("serial", "parallel"):
        monkeypatch.setattr(kernel, form, lambda *arguments, form=form: called.append(form))
    return called


def test_which_form_is_called(monkeypatch):
    called = calls_of(monkeypatch, squares)
    large = np.zeros(ROWS)
    squares(large, large)
    with numba_threads(1):
        squares(large, large)
    with one_thread():  # the form stays, so that it is not compiled again
        squares(large, large)
    with parallel_kernel._threads.lock:  # another Python thread is in a parallel kernel
        squares(large, large)
    squares(2, (large[1:], (large, 1.0)))
    squares(large[1:], (large[1:], 1.0))  # too few rows
    usual = "parallel" if numba.get_num_threads() > 1 else "serial"
    assert called == [usual, "serial", "parallel", "serial", usual, "serial"]


def test_the_lock_is_released_after_an_error(monkeypatch):
    def fails(*arguments):
        raise ValueError

    monkeypatch.setattr(squares, "parallel", fails)
    monkeypatch.setattr(squares, "serial", fails)
    with pytest.raises(ValueError):
        squares()
    assert not parallel_kernel._threads.lock.locked()


def test_the_number_of_threads_belongs_to_the_python_thread():
    before, seen = numba.get_num_threads(), []

    def other():
        with numba_threads(1):
            seen.append(numba.get_num_threads())

    with numba_threads(before):
        thread = threading.Thread(target=other)
        thread.start()
        thread.join()
        assert (seen, numba.get_num_threads()) == ([1], before)


# Simulates in threads, after a fork, and in a pool of forked processes; all must give the bits of the first simulation.
PROGRAM = """
import os, threading, time, zlib
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
import numba, numpy as np
import supple as sp

mesh = sp.shapes.box(size=(1, .1, .1), divisions=(6, 2, 2))
body = sp.Body("beam", mesh, sp.StableNeoHookean(youngs=1e5, poisson=.4, density=1000))
floor = sp.HalfSpace((0, -.051, 0), (0, 1, 0), friction=.5)
held = sp.Pin("beam", sp.InBox((-1, -1, -1), (.01, 1, 1)))
most = numba.get_num_threads()
RUNS = (
    (sp.Scene([body], [floor], [held]), sp.XPBD(threads=min(2, most))),
    (sp.Scene([body], [], [held]), sp.Implicit()),
)
large = np.random.default_rng(0).normal(size=(20_000, 3, 3))  # uses all threads

def bits(run):
    for frame in sp.simulate(*run, 1 / 60, 2):
        assert frame.report.status == "converged", frame.report
    density = body.material.energy_density(large)
    return zlib.crc32(frame.state.positions.tobytes() + density.tobytes())

expected = [bits(run) for run in RUNS]
got = {}
threads = [threading.Thread(target=lambda k=k: got.update({k: bits(RUNS[k % 2])})) for k in range(4)]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
assert [got.get(k) for k in range(4)] == expected * 2, "threads"
# OpenMP's threads of the threads above end now. Meanwhile they may hold a lock of the compiler's library that a forked
# process would never get, and that it needs to load a kernel.
time.sleep(1.0)
child = os.fork()
if child == 0:
    os._exit([bits(run) for run in RUNS] != expected)
assert os.waitpid(child, 0)[1] == 0, "a forked process"
with ProcessPoolExecutor(1, get_context("fork")) as pool:
    assert [pool.submit(bits, run).result() for run in RUNS] == expected, "a pool"
assert numba.get_num_threads() == most
print(*expected)
"""


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_simulations_in_threads_and_after_a_fork_for_any_layer_and_number_of_threads():
    printed = []
    for layer, threads in (("workqueue", 2), ("omp", 3)):
        environment = {**os.environ, "NUMBA_THREADING_LAYER": layer, "NUMBA_NUM_THREADS": str(threads)}
        done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, env=environment)
        assert done.returncode == 0, (layer, threads, done.stderr)
        printed.append(done.stdout)
    assert len(set(printed)) == 1
