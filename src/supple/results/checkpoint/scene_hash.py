"""A number for the content of a scene: two scenes with the same one are simulated alike."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.results.recording.description import described
from supple.scene.inputs import Input

# Functions of time cannot be read; their values at this many times of a run are taken instead.
_TIMES = 16


def scene_hash(system: System, begin: float, duration: float) -> str:
    """SHA-256 of everything in a scene, in hexadecimal digits.

    Parameters
    ----------
    system : of the scene; begin, duration : time at the start of the run, and its length [s]
    """
    tree, arrays, functions = described(system.scene)
    content = [json.dumps(tree).encode()]
    for path, array in arrays.items():
        content += [f"{path} {array.dtype.str} {array.shape}".encode(), np.ascontiguousarray(array).tobytes()]
    x, times = system.start_states[0].positions, begin + duration * np.arange(_TIMES) / (_TIMES - 1)
    for function in functions:
        if isinstance(function, Input):  # its values are in the state
            content.append(repr(function).encode())
        else:
            content += [_value(function, float(time), x).tobytes() for time in times]
    digest = hashlib.sha256()
    for part in content:
        digest.update(len(part).to_bytes(8, "little") + part)
    return digest.hexdigest()


def _value(function: Callable[..., Any], time: float, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of a function of time, or of places (n, 3) [m] and time."""
    try:
        return np.array(function(time), dtype=np.float64)
    except TypeError:
        return np.array(function(x, time), dtype=np.float64)
