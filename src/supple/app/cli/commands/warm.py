"""`supple warm`."""

from __future__ import annotations

import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from importlib import import_module
from pkgutil import walk_packages
from typing import Annotated

from cyclopts import Parameter, validators

from supple.app.cli.console import ExitCode
from supple.errors import SceneError

# The packages with kernels.
_PACKAGES = ("numerics", "mesh", "materials", "scene", "contact", "model", "solvers", "results")


def warm(
    *scenes: str,
    processes: Annotated[int | None, Parameter(name=["--processes", "-p"], validator=validators.Number(gte=1))] = None,
) -> int:
    """Compile the kernels of standard scenes, on all cores, so that nothing waits for them later.

    Simulations compile what is missing by themselves, on one core.

    Parameters
    ----------
    scenes
        Names of standard scenes; without them, all.
    processes
        Number of processes; without it, one for each core that this process may use.
    """
    from supple.results.progress import error_console, kernel_bar
    from supple.runtime.kernel_list import compile_kernel, kernels_of_scenes

    known = kernels_of_scenes()
    unknown = [name for name in scenes if name not in known]
    if unknown:
        raise SceneError(f"supple warm: standard scene '{unknown[0]}' does not exist; there are {', '.join(known)}")
    kernels = {repr(kernel): kernel for name in scenes or known for kernel in known[name]}
    count = min(processes or os.cpu_count() or 1, max(1, len(kernels)))
    console, compiled = error_console(), 0
    try:
        with (
            kernel_bar(console) as bar,
            ProcessPoolExecutor(count, multiprocessing.get_context("spawn"), import_kernels) as pool,
        ):
            task = bar.add_task("", total=len(kernels))
            for done in as_completed([pool.submit(compile_kernel, *kernel) for kernel in kernels.values()]):
                compiled += done.result()
                bar.advance(task)
    except BrokenProcessPool:
        raise SceneError(
            "supple warm: another program ended a process, for instance because memory ran out; give fewer --processes"
        ) from None
    console.print(f"{len(kernels)} kernels are ready, {compiled} were compiled", highlight=False)
    return ExitCode.OK


def import_kernels() -> None:
    """Define all kernels that have a name."""
    for package in _PACKAGES:
        folder = import_module(f"supple.{package}")
        for module in walk_packages(folder.__path__, f"{folder.__name__}."):
            with suppress(ImportError):  # of an extra that is not installed
                import_module(module.name)
    from supple.scene.obstacles.half_space import plane_contact
    from supple.solvers.xpbd.contact.shapes import kernel_of

    kernel_of(plane_contact)
