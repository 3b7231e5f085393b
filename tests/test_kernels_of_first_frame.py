"""What a first frame compiles: no more kernels than a scene needs, each once, and in one form."""

import subprocess
import sys
from collections import Counter

# The scene of the README's first program. It prints each kernel as often as it was compiled or loaded.
PROGRAM = """
import gc
import supple as sp
from numba.core.dispatcher import Dispatcher
from supple.runtime.kernel_cache import KernelCache

rubber = sp.StableNeoHookean(youngs=5e4, poisson=0.45, density=1000)
ball = sp.Body("ball", sp.shapes.sphere(radius=0.5, edge_length=0.2), rubber, position=(0, 1, 0))
floor = sp.HalfSpace(point=(0, 0, 0), normal=(0, 1, 0), friction=0.5)
next(iter(sp.simulate(sp.Scene(bodies=[ball], obstacles=[floor]), sp.XPBD(substeps=20), dt=1 / 60, steps=1)))
for kernel in gc.get_objects():
    if isinstance(kernel, Dispatcher) and isinstance(kernel._cache, KernelCache):
        for _ in kernel.signatures:
            print(f"{kernel.py_func.__module__}.{kernel.py_func.__qualname__}")
"""
MOST = 40


def test_kernels_of_the_first_frame_of_a_small_scene():
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    kernels = Counter(done.stdout.split())
    assert 20 < sum(kernels.values()) <= MOST, kernels
    assert set(kernels.values()) == {1}, kernels
    assert not [name for name in kernels if name.endswith("_parallel")], kernels
    # No pair of triangles is near enough for exact arithmetic.
    assert not [name for name in kernels if "exact" in name], kernels
