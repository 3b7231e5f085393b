"""The cache of compiled kernels: kept between processes, renewed when something that a kernel reaches has changed."""

import ast
import importlib
import json
import os
import pkgutil
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from llvmlite.binding import get_process_triple
from numba.core.caching import NullCache
from numba.core.dispatcher import Dispatcher
from numba.core.registry import cpu_target

import supple
from supple.materials.isotropic import KernelOfKinds
from supple.runtime import inner_function, kernel_cache, kernel_folder
from supple.runtime.kernel_cache import KernelCache, njit
from supple.runtime.kernel_folder import TARGET, note_use, read, write
from supple.runtime.parallel_kernel import ParallelKernel
from supple.runtime.reached_code import reached_code

SOURCES = Path(supple.__file__).parent
# Prints the result of a kernel of svd3.py, and how often the cache had it.
RUN_KERNEL = """
import numpy as np
from supple.numerics import svd3
print(svd3.rotation_variant_svd(np.diag([3.0, 2.0, 1.0]))[1].tolist(), sum(svd3._svd_batch.stats.cache_hits.values()))
"""
# Prints the kernels that the first step of a scene with contact and an obstacle compiles, and those of them that reach
# `push_row`.
COMPILE = """
import json
import supple as sp
from numba.core import event
from numba.core.dispatcher import Dispatcher
from supple.runtime.kernel_cache import KernelCache

class Compiled(event.Listener):
    kernels = []

    def on_start(self, event):
        pass

    def on_end(self, event):
        kernel = event.data["dispatcher"]
        if isinstance(kernel._cache, KernelCache):
            self.kernels.append(kernel.py_func)

def reaches(function):
    called = [function.__globals__.get(name) for name in function.__code__.co_names]
    return "push_row" in function.__code__.co_names or any(
        reaches(one.py_func) for one in called if isinstance(one, Dispatcher)
    )

event.register("numba:compile", Compiled())
mesh = sp.shapes.box(size=(1, 1, 1), divisions=(1, 1, 1))
body = sp.Body("a", mesh, sp.StableNeoHookean(youngs=1e4, poisson=0.4, density=1000))
scene = sp.Scene(bodies=[body], obstacles=[sp.HalfSpace(point=(0, -0.5005, 0), normal=(0, 1, 0))])
next(iter(sp.simulate(scene, sp.XPBD(substeps=2), dt=1 / 60, steps=1)))
compiled = Compiled.kernels
print(json.dumps([sorted(one.__name__[:12] for one in some) for some in (compiled, filter(reaches, compiled))]))
"""


@pytest.fixture
def clone(tmp_path):
    """A function that copies the package to a new folder, and one that runs code with such a copy in a new process.

    All copies have one cache.
    """

    def copied(name):
        package = tmp_path / name / "supple"
        shutil.copytree(SOURCES, package)  # with its bytecode
        return package

    def run(package, code=RUN_KERNEL):
        environment = {**os.environ, "PYTHONPATH": str(package.parent), "NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        command = [sys.executable, "-c", code]
        done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=package.parent)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    return copied, run


def entries(folder):
    return sorted((folder / "kernels" / "supple").glob("*.kernel"))


def replace_in(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


def test_a_kernel_is_compiled_again_when_a_function_of_another_file_changes(clone):
    copied, run = clone
    package = copied("a")
    assert run(package) == "[3.0, 2.0, 1.0] 0"
    replace_in(package / "numerics" / "mat3.py", "(array[e, i, 0],", "(2.0 * array[e, i, 0],")
    assert run(package) == "[6.0, 2.0, 1.0] 0"
    replace_in(package / "numerics" / "mat3.py", "(2.0 * array[e, i, 0],", "(array[e, i, 0],")
    assert run(package) == "[3.0, 2.0, 1.0] 1", "the entry of the earlier code is still there"


@pytest.mark.slow
def test_what_another_checkout_and_an_edit_compile(clone):
    copied, run = clone
    compiled, callers = json.loads(run(copied("a"), COMPILE))
    assert len(compiled) > 20
    assert 0 < len(callers) < 10
    package = copied("b")
    assert run(package, COMPILE) == "[[], []]", "a clone in another folder"
    above = "from __future__ import annotations\n"
    for path in package.rglob("*.py"):
        path.write_text(path.read_text(encoding="utf-8").replace(above, f"{above}# A comment.\n\n\n"), encoding="utf-8")
    replace_in(package / "solvers" / "xpbd" / "integration.py", "\n@njit", "\n# Another comment.\n@njit")
    assert run(package, COMPILE) == "[[], []]", "lines have moved"
    levers = package / "solvers" / "xpbd" / "contact" / "levers.py"
    replace_in(levers, "points[v, 3] * (c * f[j])", "points[v, 3] * (f[j] * c)")
    assert json.loads(run(package, COMPILE)) == [callers, callers], "of its callers in all files"


def test_of_several_processes_one_compiles(tmp_path):
    """Two processes that need the same kernel at the same time; none leaves a lock."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    command = [sys.executable, "-c", RUN_KERNEL]
    running = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) for _ in range(2)]
    hits = sorted(process.communicate()[0].split()[-1] for process in running)
    assert hits == ["0", "1"]
    (entry,) = entries(tmp_path)
    assert list(entry.parent.iterdir()) == [entry]


@pytest.mark.skipif(sys.platform == "win32", reason="only POSIX limits the size of files")
@pytest.mark.slow
def test_a_kernel_runs_where_its_cache_has_no_room(clone, tmp_path):
    _, run = clone
    no_files = "import resource, sys; sys.dont_write_bytecode = True"  # or modules of the checkout would be cut short
    limit = f"{no_files}\nresource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
    assert run(SOURCES, limit + RUN_KERNEL) == "[3.0, 2.0, 1.0] 0"
    assert not entries(tmp_path), "nothing incomplete was kept"
    assert run(SOURCES) == "[3.0, 2.0, 1.0] 0"
    assert run(SOURCES).endswith(" 1")


def test_the_entries_that_were_not_used_for_longest_go(tmp_path, monkeypatch):
    monkeypatch.setattr(kernel_folder, "_MOST_BYTES", 250)
    for k in range(4):
        write(tmp_path / f"{k}.kernel", bytes(96))
        os.utime(tmp_path / f"{k}.kernel", (1e9 + k, 1e9 + k))
    note_use(tmp_path / "0.kernel")
    kernel_folder._remove_unused.cache_clear()
    write(tmp_path / "new.kernel", bytes(96))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0.kernel", "3.kernel", "new.kernel"]
    assert read(tmp_path / "3.kernel") == bytes(96)
    kernel_folder._remove_unused.cache_clear()


def test_every_cached_kernel_of_the_package_uses_this_cache():
    kernels = 0
    for module in pkgutil.walk_packages(supple.__path__, "supple."):
        if module.name.endswith("__main__"):
            continue
        for value in vars(importlib.import_module(module.name)).values():
            kernels_of = value.of.values() if isinstance(value, KernelOfKinds) else (value,)
            for kernel in value if isinstance(value, tuple) else kernels_of:
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


def test_the_name_of_an_entry_depends_on_the_options_of_the_kernel_and_on_how_it_is_compiled():
    outer = kernel_with()
    plain, other = njit(cache=True)(outer)._cache, njit(cache=True, error_model="python")(outer)._cache
    target = ("triple", "processor", "")
    assert plain._entry((), target) == njit(cache=True)(outer)._cache._entry((), target)
    assert plain._entry((), target) != other._entry((), target)
    assert plain._entry((), target) != plain._entry((), ("triple", "processor", "+avx"))
    # What the compiler of this package does is in the key, by the text of its module.
    assert ast.dump(ast.parse(Path(inner_function.__file__).read_bytes())) in kernel_cache._COMPILER


def test_a_kernel_whose_cache_is_disabled_is_not_kept():
    kernel = njit(cache=True)(kernel_with())
    kernel._cache.disable()
    assert kernel._cache.cache_path is None


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


@pytest.fixture
def loaded_again(tmp_path, monkeypatch):
    """Whether a kernel that is called for the first time is loaded, or else compiled. All calls have one cache."""
    monkeypatch.setattr(kernel_folder, "kernel_folder", lambda: tmp_path)

    def call():
        kernel = njit(cache=True)(doubled_twice.py_func)
        assert kernel(1.5) == 6.0
        return sum(kernel.stats.cache_hits.values()) == 1

    return call


def test_the_log_says_that_kernels_are_compiled_and_not_that_they_are_loaded(loaded_again, caplog):
    caplog.set_level("INFO", "supple")
    for loaded in (False, True):
        kernel_cache._announce.cache_clear()
        assert loaded_again() == loaded
        assert [record.message.startswith("compiling kernels") for record in caplog.records] == [True] * (not loaded)
        caplog.clear()
    kernel_cache._announce.cache_clear()


def test_a_damaged_entry_or_one_that_names_what_has_moved_is_compiled_again(loaded_again, tmp_path):
    loaded_again()
    (entry,) = tmp_path.glob("*.kernel")
    content = entry.read_bytes()
    for damaged in (content[:1000], bytes(len(content))):
        entry.write_bytes(damaged)
        assert not loaded_again()
        assert len(entry.read_bytes()) == len(content)
    write(entry, b"cmoved.module\nkernel\n.")
    assert not loaded_again()
    assert loaded_again()


def test_what_only_a_compilation_needs_is_not_imported_to_load_a_kernel(loaded_again, monkeypatch):
    loaded_again()
    monkeypatch.setattr(cpu_target.target_context, "refresh", lambda: pytest.fail("it is the compiler's"))
    assert loaded_again()


def test_a_function_that_kernels_call_can_be_called_from_python_too():
    assert doubled_twice(1.5) == 6.0
    assert doubled(1.5) == 3.0
    assert doubled(np.ones(2)).tolist() == [2.0, 2.0]


def test_kernels_of_a_wheel_are_used_where_the_processor_has_their_features(clone, tmp_path):
    """A kernel compiled for another processor is found, and nothing is written; not where a feature is missing."""
    copied, run = clone
    package = copied("a")
    prelude = "import os; os.environ.update(NUMBA_CPU_NAME='generic', NUMBA_CPU_FEATURES='')\n"
    assert run(package, prelude + RUN_KERNEL).endswith(" 0")
    (entry,) = entries(tmp_path)
    shipped = package / "runtime" / "kernels"
    shipped.mkdir()
    entry.rename(shipped / entry.name)
    target = [get_process_triple(), "generic", ""]
    (shipped / TARGET).write_text(json.dumps(target), encoding="utf-8")
    assert run(package) == "[3.0, 2.0, 1.0] 1"
    assert not entries(tmp_path)
    (shipped / TARGET).write_text(json.dumps([*target[:2], "+no_processor_has_it"]), encoding="utf-8")
    assert run(package) == "[3.0, 2.0, 1.0] 0"
    assert len(entries(tmp_path)) == 1
