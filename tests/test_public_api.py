"""`import supple`: it is quick, every public name exists, and no module needs a POSIX system."""

import json
import subprocess
import sys
import textwrap

import pytest

import supple as sp

HEAVY = [
    "numba", "scipy", "h5py", "meshio", "websockets", "matplotlib", "pyvista", "vtk", "tetgen", "ipctk",
    "pydantic", "yaml", "cyclopts", "rich", "pxr", "trimesh", "distributed",
]  # fmt: skip


def python(code, *arguments):
    """What a fresh interpreter prints."""
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code), *arguments], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_importing_supple_loads_nothing_heavy():
    loaded = json.loads(python("import json, sys, supple; print(json.dumps(sorted(sys.modules)))"))
    assert [name for name in HEAVY if name in loaded] == []


def test_help_loads_nothing_heavy():
    code = """
        import json, sys
        from supple.app.cli.app import main
        main(["--help"])
        print(json.dumps(sorted(sys.modules)))
    """
    loaded = json.loads(python(code).splitlines()[-1])
    heavy = [name for name in HEAVY if name not in ("cyclopts", "rich")]
    assert [name for name in heavy if name in loaded] == []


@pytest.mark.parametrize("name", sp.__all__)
def test_every_public_name_exists(name):
    assert getattr(sp, name) is not None
    assert name in dir(sp)


@pytest.mark.parametrize("space", ["obstacles", "studies"])
def test_every_name_of_a_space_exists(space):
    names = getattr(sp, space).__all__
    assert len(names) > 5
    assert all(getattr(getattr(sp, space), name) is not None for name in names)


def test_there_are_at_most_a_hundred_names():
    names = [name for name in sp.__all__ if name not in ("__version__", "SuppleWarning")]
    assert len(names) <= 100


def test_an_obstacle_has_also_a_short_name_that_is_not_listed():
    assert sp.Box is sp.obstacles.Box  # pyright: ignore[reportAttributeAccessIssue]
    assert "Box" not in dir(sp)


def test_unknown_names_are_attribute_errors():
    with pytest.raises(AttributeError, match="supple has no name 'Bodyy'; did you mean 'Body'"):
        sp.Bodyy  # noqa: B018  # pyright: ignore[reportAttributeAccessIssue]


def test_simulate_stays_the_function_when_its_module_is_imported_first():
    assert python("import supple.simulate, supple; print(callable(supple.simulate))").strip() == "True"
    assert (
        python("from supple.simulate import Frame; import supple as sp; print(sp.simulate.__name__)").strip()
        == "simulate"
    )


# Modules that only POSIX systems have, and names of shared modules that only they have.
POSIX_ONLY = ["fcntl", "grp", "pty", "pwd", "resource", "syslog", "termios", "tty"]
POSIX_NAMES = {
    "os": ["fork", "getuid", "geteuid", "killpg", "mkfifo", "setsid", "sched_getaffinity", "sysconf", "wait4"],
    "signal": ["SIGKILL", "SIGHUP", "SIGALRM", "SIGUSR1", "alarm", "setitimer"],
}


def test_every_module_imports_without_posix_modules():
    # Libraries are imported first: they handle other systems themselves.
    code = """
        import importlib, json, os, pkgutil, signal, sys
        import asyncio, multiprocessing, socket, subprocess, tempfile
        for name in ("numba", "scipy.sparse.csgraph", "scipy.spatial", "h5py", "pydantic", "yaml", "cyclopts",
                     "rich.console", "rich.progress", "rich.table"):
            importlib.import_module(name)
        modules, names = json.loads(sys.argv[1])
        for name in modules:
            sys.modules[name] = None
        for module, hidden in names.items():
            for name in hidden:
                if hasattr(sys.modules[module], name):
                    delattr(sys.modules[module], name)
        import supple
        for module in pkgutil.walk_packages(supple.__path__, "supple."):
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)
                print(module.name)
    """
    found = python(code, json.dumps([POSIX_ONLY, POSIX_NAMES])).split()
    assert {
        "supple.simulate",
        "supple.app.cli.app",
        "supple.mesh.meshing.tetrahedralize",
        "supple.app.scene_file.loader",
    } <= set(found)


def test_nothing_needs_the_library_that_the_tests_compare_with():
    code = """
        import sys
        sys.modules["ipctk"] = None
        import supple as sp
        rubber = sp.StableNeoHookean(youngs=1e4, poisson=0.3)
        body = sp.Body("block", sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), rubber, position=(0, 0.06, 0))
        scene = sp.Scene([body], obstacles=[sp.HalfSpace(name="floor")])
        for solver in (sp.XPBD(substeps=4), sp.Implicit()):
            for frame in sp.simulate(scene, solver, dt=0.01, steps=2):
                print(frame.report.status)
        print(sp.shapes.gummy_bear_surface(resolution=16).check().ok)
    """
    assert python(code).splitlines() == [*["converged"] * 4, "True"]
