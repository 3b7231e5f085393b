"""The kernels of what users run first: `python .ci/kernels.py` (`make kernels`).

Runs each program in a process of its own, and writes the list of its kernels (`supple/runtime/kernels.json`). Then
compiles them for a processor that most machines have, to `build/kernels`, from where `make dist` packs them. With
`--list`, only the list is written.
"""

from __future__ import annotations

import json
import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import chdir, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
KERNELS = ROOT / "build" / "kernels"
# The level x86-64-v3 of the psABI (processors since about 2013). Numba would add the features of this machine to it.
FEATURES = (
    "avx avx2 bmi bmi2 cmov crc32 cx16 cx8 f16c fma fxsr lzcnt mmx movbe popcnt sahf sse sse2 sse3 sse4.1 sse4.2 ssse3 "
    "xsave"
)
LEVELS = {"x86_64": ("x86-64-v3", ",".join(f"+{name}" for name in FEATURES.split()))}
BASELINE = ("generic", "")


def target() -> tuple[str, str]:
    """The processor and the features that kernels are compiled for."""
    return LEVELS.get({"AMD64": "x86_64"}.get(platform.machine(), platform.machine()), BASELINE)


def environment(cache: Path) -> dict[str, str]:
    """For a process that compiles for `target` into a folder."""
    processor, features = target()
    chosen = {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": features, "NUMBA_CACHE_DIR": str(cache)}
    return {**os.environ, **chosen}


def programs() -> dict[str, str]:
    """What users run first: README's program with both solvers, the demos of `make demo`, and the tutorial."""
    block = re.compile(r"^```(python|sh)\n(.*?)^```", re.S | re.M)
    blocks = block.findall((ROOT / "README.md").read_text(encoding="utf-8"))
    snippet = next(code for kind, code in blocks if kind == "python")
    implicit = snippet.replace("sp.XPBD()", "sp.Implicit()")
    assert implicit != snippet
    tutorial = block.findall((ROOT / "docs" / "learn" / "tutorial.md").read_text(encoding="utf-8"))
    demos = {
        name: _in_the_shell(f"supple demo {name} --output {name} --no-page --no-plot") for name in ("squash", "bears")
    }
    text = "\n".join(code if kind == "python" else _in_the_shell(code) for kind, code in tutorial)
    return {"snippet": snippet, "implicit": implicit, **demos, "tutorial": text}


def _in_the_shell(lines: str) -> str:
    """Python code that runs lines of the shell."""
    commands = [shlex.split(line, comments=True)[1:] for line in lines.splitlines()]
    return "from supple.app.cli.app import main\n" + "\n".join(f"assert main({command}) == 0" for command in commands)


def kernels_of(name: str) -> list[tuple[str, list]]:
    """Run a program in this process; the kernels that it used and their signatures."""
    from supple.runtime.kernel_count import WATCHERS
    from supple.runtime.kernel_list import as_json

    used = {}

    def note(stage: str, kernel: str, signature) -> None:
        if stage != "compiling":
            try:
                used[kernel, str(signature)] = (kernel, as_json(signature))
            except ValueError as error:
                print(f"{kernel}: {error}", file=sys.stderr)

    WATCHERS.append(note)
    code = programs()[name]
    with TemporaryDirectory() as folder, chdir(folder), redirect_stdout(sys.stderr):
        exec(compile(code, name, "exec"), {"__name__": name})
    return list(used.values())


def kernels_of_all(environment: dict[str, str]) -> dict[str, list]:
    """The kernels of each program, from processes that run in an environment."""

    def kernels(name: str) -> list:
        command = [sys.executable, __file__, name]
        done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
        return json.loads(done.stdout.splitlines()[-1])

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        return dict(zip(programs(), pool.map(kernels, programs()), strict=True))


def pack() -> None:
    """Compile the kernels of the list, and what the programs need besides them, for `target`."""
    from llvmlite.binding import get_process_triple

    from supple.runtime.kernel_folder import TARGET

    cache = KERNELS.with_name("compiled")
    for folder in (KERNELS, cache):
        shutil.rmtree(folder, ignore_errors=True)
    subprocess.run([sys.executable, "-m", "supple", "warm"], env=environment(cache), check=True)
    kernels_of_all(environment(cache))
    KERNELS.mkdir(parents=True)
    for entry in (cache / "supple").glob("*.kernel"):
        shutil.copy(entry, KERNELS)
    (KERNELS / TARGET).write_text(json.dumps([get_process_triple(), *target()]), encoding="utf-8")
    size = sum(entry.stat().st_size for entry in KERNELS.iterdir())
    print(f"{len(list(KERNELS.glob('*.kernel')))} kernels, {size / 1e6:.0f} MB, for {target()[0]}")


def main(arguments: list[str]) -> None:
    from supple.runtime.kernel_list import write_list

    if arguments not in ([], ["--list"]):
        print(json.dumps(kernels_of(arguments[0])))
        return
    write_list(kernels_of_all(dict(os.environ)))
    if not arguments:
        pack()


if __name__ == "__main__":
    main(sys.argv[1:])
