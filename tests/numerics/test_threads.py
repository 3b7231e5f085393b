"""Locks of Numba's threads in forked processes."""

import os
import subprocess
import sys

import pytest

KILLED = """
import os
import numba
from numba.np.ufunc import parallel
import supple.numerics.threads

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
