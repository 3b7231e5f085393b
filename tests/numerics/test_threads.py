"""The number of Numba's threads, and their locks in forked processes."""

import os
import subprocess
import sys

import numba
import pytest
from threadpoolctl import ThreadpoolController

from supple.runtime.threads import is_alone, numba_threads

KILLED = """
import os
import numba
from numba.np.ufunc import parallel
import supple.runtime.threads

numba.get_num_threads()
child = os.fork()
if child == 0:
    numba.get_num_threads()
    parallel._backend_init_process_lock.acquire()
    os.kill(os.getpid(), 9)
os.waitpid(child, 0)
child = os.fork()
if child == 0:
    numba.get_num_threads()
    os._exit(0)
os.waitpid(child, 0)
numba.get_num_threads()
print("goes on")
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_a_forked_process_that_is_killed_holds_no_lock_of_others():
    done = subprocess.run([sys.executable, "-c", KILLED], capture_output=True, text=True, timeout=60)
    assert done.stdout == "goes on\n", done.stderr


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="there is one thread")  # pyright: ignore
def test_one_thread_is_known_without_a_question_until_the_block_ends():
    before = numba.get_num_threads(), is_alone()
    with numba_threads(1):
        assert is_alone()
        with numba_threads(2):
            assert not is_alone()
            assert numba.get_num_threads() == 2
        with numba_threads(1):
            assert is_alone()
        assert is_alone()
        assert numba.get_num_threads() == 1
    assert (numba.get_num_threads(), is_alone()) == before


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="there is one thread")  # pyright: ignore
def test_where_several_threads_run_blas_has_one():
    blas = ThreadpoolController().select(internal_api="openblas")

    def counts() -> set[int]:
        return {library["num_threads"] for library in blas.info()}

    with blas.limit(limits=2):
        with numba_threads(1):
            assert counts() == {2}
        with numba_threads(2):
            with numba_threads(None):
                assert counts() == {1}
            assert counts() == {1}
        assert counts() == {2}


def test_the_thread_pool_is_that_of_openmp_where_it_can_be_had():
    code = (
        "import numba, numpy as np, supple.runtime.threads\n"
        "from numba.np.ufunc.omppool import openmp_vendor\n"
        "@numba.njit(parallel=True)\n"
        "def fill(out):\n"
        "    for i in numba.prange(len(out)):\n"
        "        out[i] = i\n"
        "fill(np.zeros(10))\n"
        "print(numba.threading_layer())"
    )
    chosen = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_THREADING")}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, env=chosen)
    if "omppool" in done.stderr:
        pytest.skip("Numba has no OpenMP here")
    assert done.stdout == "omp\n", done.stderr
