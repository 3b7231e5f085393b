"""How benchmarks measure: programs run alternately, and the fastest round counts."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_SCRIPTS = "Scripts" if os.name == "nt" else "bin"
PEERS_PYTHON = ROOT / ".venv-peers" / _SCRIPTS / "python"
# SuperDex needs Python 3.12 or newer.
SUPERDEX_PYTHON = ROOT / ".venv-superdex" / _SCRIPTS / "python"


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


def peers_installed() -> bool:
    """Whether the environment of the other programs exists (see the Makefile's `bench`)."""
    return PEERS_PYTHON.exists()
