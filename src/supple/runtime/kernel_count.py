"""How many of the kernels that a program needs are ready, while it compiles. Importing this does not import Numba."""

from __future__ import annotations

from typing import Any

from supple.runtime.displayed import WATCHERS


class KernelCount:
    """Counts kernels as they are loaded or compiled, from its construction to `close`.

    The number of those that will be needed is that of the standard scene that shares most kernels with the program.
    """

    def __init__(self) -> None:
        self._ready: set[str] = set()
        self._depth = 0  # compilations are nested
        WATCHERS.append(self._watch)

    def close(self) -> None:
        WATCHERS.remove(self._watch)

    def _watch(self, stage: str, name: str, signature: Any) -> None:
        if stage == "compiling":
            self._depth += 1
        else:
            self._depth -= stage == "compiled"
            self._ready.add(f"{name} {signature}")
        self.changed()

    def changed(self) -> None:
        """Called after each kernel that is loaded or compiled, and before each that is compiled."""

    @property
    def compiling(self) -> bool:
        """Whether a kernel is compiled now."""
        return self._depth > 0

    def numbers(self) -> tuple[int, int]:
        """The number of the kernel that is compiled, and how many there will be."""
        ready = self._ready.copy()
        now = len(ready) + self.compiling
        return now, max(now, len(ready.union(self._expected(ready))))

    def current(self) -> tuple[int, int] | None:
        """`numbers`, where a kernel is compiled now."""
        return self.numbers() if self.compiling else None

    def compile_rest(self) -> None:
        """Compile, or load, what the program will probably need."""
        from supple.runtime.kernel_list import compile_kernel

        ready = self._ready.copy()
        for text, kernel in self._expected(ready).items():
            if text not in ready:
                compile_kernel(*kernel)

    def _expected(self, ready: set[str]) -> dict[str, tuple[str, Any]]:
        from supple.runtime.kernel_list import kernels_of_scenes, text_of

        scenes = [{text_of(*kernel): kernel for kernel in kernels} for kernels in kernels_of_scenes().values()]
        return max(scenes, key=lambda scene: (len(ready.intersection(scene)), -len(scene)), default={})
