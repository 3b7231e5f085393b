"""The list of the kernels of standard scenes, and counting kernels by it."""

import runpy
from collections import namedtuple
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core import types

from supple.app.cli.commands.warm import import_kernels
from supple.results.progress import CompileBar
from supple.runtime import kernel_count, kernel_list
from supple.runtime.kernel_cache import KERNELS
from supple.runtime.kernel_list import as_json, from_json, kernels_of_scenes, text_of, write_list

Pair = namedtuple("Pair", "a b")
ROOT = Path(__file__).parents[2]


def test_signatures_survive_the_list():
    frozen = np.ones(3)
    frozen.flags.writeable = False
    values = (1, 2.0, True, None, np.ones((2, 3)), frozen, np.ones((2, 2), np.int32)[:, 0], (1, 2), (1, 2.0))
    signature = (*(numba.typeof(value) for value in (*values, Pair(1, np.ones(2)), Pair(1, 2))), types.Omitted(0.5))
    assert from_json(as_json(signature)) == signature
    with pytest.raises(ValueError, match="cannot be listed"):
        as_json((numba.typeof(numba.njit(lambda x: x)),))


def test_the_list_is_that_of_the_standard_scenes_and_names_kernels():
    """Where this fails, run `python .ci/kernels.py --list`."""
    import_kernels()
    listed = kernels_of_scenes()
    assert list(listed) == list(runpy.run_path(str(ROOT / ".ci" / "kernels.py"))["programs"]())
    names = {name for kernels in listed.values() for name, _ in kernels}
    # Kernels that are made for what a scene contains are named by two functions; the list only counts them.
    unknown = {name for name in names - KERNELS.keys() if "." not in name.partition(":")[2]}
    assert len(names & KERNELS.keys()) > 0.8 * len(names)
    assert not unknown, "the code has other kernels than the list: run `python .ci/kernels.py --list`"


def test_what_is_written_is_read(tmp_path, monkeypatch):
    scenes = {"one": [("a:f", ["int64"]), ("a:g", [])], "two": [("a:g", [])]}
    write_list(scenes, tmp_path / "kernels.json")
    monkeypatch.setattr(kernel_list, "PATH", tmp_path / "kernels.json")
    kernels_of_scenes.cache_clear()
    assert kernels_of_scenes() == scenes
    kernels_of_scenes.cache_clear()


def test_the_bar_counts_by_the_scene_that_shares_most_kernels(monkeypatch):
    scenes = {"one": [(f"a:{k}", []) for k in range(10)], "two": [(f"b:{k}", []) for k in range(5)]}
    monkeypatch.setattr(kernel_list, "kernels_of_scenes", lambda: scenes)
    shown = []

    class Counted(CompileBar):
        def changed(self):
            shown.append((self.compiling, self.numbers()))

    def tell(stage, name):
        for watcher in kernel_count.WATCHERS:
            watcher(stage, name, ())

    with Counted():
        tell("loaded", "b:0")
        tell("compiling", "b:1")
        tell("compiling", "c:0")  # by the one that calls it
        tell("compiled", "c:0")
        tell("compiled", "b:1")
    tell("loaded", "b:2")
    assert text_of("b:0", []) == "b:0 ()"
    assert shown == [(False, (1, 5)), (True, (2, 5)), (True, (2, 5)), (True, (3, 6)), (False, (3, 6))]


def test_a_kernel_that_takes_other_arguments_by_now_is_left_out():
    import_kernels()
    name = "supple.numerics.deformation:deformation_gradients"
    signature = next(kernel[1] for kernels in kernels_of_scenes().values() for kernel in kernels if kernel[0] == name)
    kernel_list.compile_kernel(name, signature[:1])  # raises nothing
