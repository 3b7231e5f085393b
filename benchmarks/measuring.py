"""How benchmarks measure: programs run alternately, and the fastest round counts; optionally with a busy core."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_SCRIPTS = "Scripts" if os.name == "nt" else "bin"
PEERS_PYTHON = ROOT / ".venv-peers" / _SCRIPTS / "python"


def alternate(programs: dict[str, Callable[[], dict]], rounds: int) -> dict[str, dict]:
    """Run every program once per round; return the fastest round of each, by `ms_per_frame`."""
    best: dict[str, dict] = {}
    for _ in range(rounds):
        for name, run in programs.items():
            result = run()
            if name not in best or result["ms_per_frame"] < best[name]["ms_per_frame"]:
                best[name] = result
    return best


def run_json(python: str | Path, script: Path | str, *arguments: object, threads: int | None = None) -> dict:
    """Run a script, or a module of this name, that prints one JSON line at the end, and return it."""
    environment = dict(os.environ)
    if threads is not None:
        environment["NUMBA_NUM_THREADS"] = str(threads)
    program = [str(script)] if isinstance(script, Path) else ["-m", script]
    done = subprocess.run(
        [str(python), *program, *map(str, arguments)], capture_output=True, text=True, env=environment, cwd=ROOT
    )
    if done.returncode != 0:
        raise RuntimeError(f"{program[-1]} {arguments} failed:\n{done.stderr[-2000:]}")
    return json.loads(done.stdout.strip().splitlines()[-1])


@contextlib.contextmanager
def busy_core(enabled: bool) -> Iterator[None]:
    """Keep one core busy with another process during the block, if enabled."""
    spinner = subprocess.Popen([sys.executable, "-c", "while True: pass"]) if enabled else None
    try:
        yield
    finally:
        if spinner is not None:
            spinner.kill()
            spinner.wait()


def peers_installed() -> bool:
    """Whether the environment of the other programs exists (see the Makefile's `bench`)."""
    return PEERS_PYTHON.exists()
