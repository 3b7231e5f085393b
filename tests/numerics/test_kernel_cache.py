"""The cache of compiled kernels: kept between processes, renewed when something that a kernel reaches has changed."""

import importlib
import os
import pickle
import pkgutil
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core.caching import NullCache
from numba.core.dispatcher import Dispatcher

import supple
from supple.runtime.kernel_cache import KernelCache, njit, reached_code
from supple.runtime.parallel_kernel import ParallelKernel

SOURCES = Path(supple.__file__).parent
# Prints the result of a kernel of svd3.py, and how often the cache had it.
RUN_KERNEL = """
import numpy as np
from supple.numerics import svd3
print(svd3.rotation_variant_svd(np.diag([3.0, 2.0, 1.0]))[1].tolist(), sum(svd3._svd_batch.stats.cache_hits.values()))
"""


@pytest.fixture
def copied_package(tmp_path):
    """A function that runs the kernel in a new process, on a copy of the package."""
    package = tmp_path / "supple"
    shutil.copytree(SOURCES, package, ignore=shutil.ignore_patterns("__pycache__"))

    def run(prelude=""):
        environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
        done = subprocess.run(
            [sys.executable, "-c", prelude + RUN_KERNEL], capture_output=True, text=True, env=environment, cwd=tmp_path
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    return package, run


def replace_in(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


def test_a_kernel_is_compiled_again_when_a_function_of_another_file_changes(copied_package):
    package, run = copied_package
    assert run() == "[3.0, 2.0, 1.0] 0"
    assert run().endswith(" 1"), "unchanged, it is loaded"
    replace_in(package / "numerics" / "mat3.py", "(array[e, i, 0],", "(2.0 * array[e, i, 0],")
    assert run() == "[6.0, 2.0, 1.0] 0"
    assert run().endswith(" 1")


def test_of_several_processes_one_compiles(tmp_path):
    """Three processes that need the same kernel at the same time; none leaves a lock."""
    shutil.copytree(SOURCES, tmp_path / "supple", ignore=shutil.ignore_patterns("__pycache__"))
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    command = [sys.executable, "-c", RUN_KERNEL]
    running = [
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment, cwd=tmp_path) for _ in range(3)
    ]
    hits = sorted(process.communicate()[0].split()[-1] for process in running)
    assert hits == ["0", "1", "1"]
    assert not list(tmp_path.rglob("*.lock"))


@pytest.mark.parametrize("content", [b"cmoved.module\nkernel\n.", b"\x80\x05"])
@pytest.mark.slow
def test_a_cache_that_cannot_be_read_is_made_anew(copied_package, content):
    package, run = copied_package
    run()
    indices = list((package / "numerics" / "__pycache__").glob("svd3.*.nbi"))
    assert indices
    for index in indices:
        index.write_bytes(pickle.dumps(numba.__version__) + content)
    assert run() == "[3.0, 2.0, 1.0] 0"
    assert run().endswith(" 1")


@pytest.mark.skipif(sys.platform == "win32", reason="only POSIX limits the size of files")
@pytest.mark.slow
def test_a_kernel_runs_where_its_cache_has_no_room(copied_package):
    _, run = copied_package
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
    assert run("import sys; sys.dont_write_bytecode = True\n" + limit) == "[3.0, 2.0, 1.0] 0"
    assert run() == "[3.0, 2.0, 1.0] 0", "nothing incomplete was kept"
    assert run().endswith(" 1")


def test_every_cached_kernel_of_the_package_uses_this_cache():
    kernels = 0
    for module in pkgutil.walk_packages(supple.__path__, "supple."):
        if module.name.endswith("__main__"):
            continue
        for value in vars(importlib.import_module(module.name)).values():
            for kernel in value if isinstance(value, tuple) else (value,):
                for form in kernel.forms if isinstance(kernel, ParallelKernel) else (kernel,):
                    if isinstance(form, Dispatcher) and not isinstance(form._cache, NullCache):
                        assert isinstance(form._cache, KernelCache), form
                        # Numba names a cached closure by what it holds; a kernel has another name in each process.
                        held = form.py_func.__closure__ or ()
                        assert not any(isinstance(cell.cell_contents, Dispatcher) for cell in held), form
                        kernels += 1
    assert kernels > 50


def kernel_with(factor=2.0, constant=1.0, fastmath=False):
    """A kernel that calls a function that calls another."""

    @njit(fastmath=fastmath)
    def inner(x):
        return factor * x

    def middle(x):
        return inner(x) + constant

    middle = numba.njit(middle)

    def outer(x):
        return middle(x) + 1.0

    return outer


def test_what_the_digest_depends_on():
    same = reached_code(kernel_with())
    assert reached_code(kernel_with()) == same
    assert reached_code(kernel_with(factor=3.0)) != same
    assert reached_code(kernel_with(constant=np.ones(2))) != same
    assert reached_code(kernel_with(fastmath=True)) != same
    assert reached_code(kernel_with(fastmath={"nsz", "arcp"})) == reached_code(kernel_with(fastmath={"arcp", "nsz"}))


def test_names_of_a_module_and_constants_count(monkeypatch):
    from supple.numerics import mat3
    from supple.solvers.xpbd import integration

    def calls_through_a_module(a):
        return mat3.dot(a, a)

    before = reached_code(calls_through_a_module)
    monkeypatch.setattr(mat3, "dot", njit(lambda a, b: 0.0))
    assert reached_code(calls_through_a_module) != before
    before = reached_code(integration.first_lost.py_func)
    monkeypatch.setattr(integration, "FARTHEST", 128.0)
    assert reached_code(integration.first_lost.py_func) != before


@njit
def doubled(x):
    return 2.0 * x


@njit(cache=True)
def doubled_twice(x):
    return doubled(doubled(x))


def test_a_function_that_kernels_call_can_be_called_from_python_too():
    assert doubled_twice(1.5) == 6.0
    assert doubled(1.5) == 3.0
    assert doubled(np.ones(2)).tolist() == [2.0, 2.0]
