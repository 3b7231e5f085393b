"""The kernels of the standard scenes: `python .ci/kernels.py` (`make kernels`).

Runs each scene in a process of its own, with an empty cache, for a processor that most machines have. Writes the list
of its kernels (`supple/runtime/kernels.json`), and the kernels to `build/kernels`, from where `make dist` packs them.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

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


def kernels_of(name: str) -> list[tuple[str, list]]:
    """Run a standard scene in this process; the kernels that it used and their signatures."""
    from supple.app.demos.standard_scenes import STANDARD_SCENES
    from supple.runtime.kernel_cache import WATCHERS
    from supple.runtime.kernel_list import as_json

    used = {}

    def note(stage: str, kernel: str, signature) -> None:
        if stage != "compiling":
            try:
                used[kernel, str(signature)] = (kernel, as_json(signature))
            except ValueError as error:
                print(f"{kernel}: {error}", file=sys.stderr)

    WATCHERS.append(note)
    STANDARD_SCENES[name]()
    return list(used.values())


def main() -> None:
    from llvmlite.binding import get_process_triple

    from supple.app.demos.standard_scenes import STANDARD_SCENES
    from supple.runtime.kernel_folder import TARGET
    from supple.runtime.kernel_list import PATH, write_list

    shutil.rmtree(KERNELS, ignore_errors=True)
    cache = KERNELS.with_name("compiled")
    shutil.rmtree(cache, ignore_errors=True)

    def kernels(name: str) -> list:
        command = [sys.executable, __file__, name]
        done = subprocess.run(command, env=environment(cache), stdout=subprocess.PIPE, text=True, check=True)
        return json.loads(done.stdout.splitlines()[-1])

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        scenes = dict(zip(STANDARD_SCENES, pool.map(kernels, STANDARD_SCENES), strict=True))
    write_list(scenes)
    KERNELS.mkdir(parents=True)
    for entry in (cache / "supple").glob("*.kernel"):
        shutil.copy(entry, KERNELS)
    (KERNELS / TARGET).write_text(json.dumps([get_process_triple(), *target()]), encoding="utf-8")
    size = sum(entry.stat().st_size for entry in KERNELS.iterdir())
    print(f"{len(list(KERNELS.glob('*.kernel')))} kernels, {size / 1e6:.0f} MB, for {target()[0]}; list: {PATH}")


if __name__ == "__main__":
    print(json.dumps(kernels_of(sys.argv[1]))) if len(sys.argv) > 1 else main()
