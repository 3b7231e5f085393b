"""Functions that are called as kernels are loaded and compiled. Importing this does not import Numba."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

# Called with "loaded", "compiling" or "compiled", and with the name and the signature of the kernel.
WATCHERS: list[Callable[[str, str, Any], None]] = []
