"""A number for the content of a scene: two scenes with the same one are simulated alike."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SuppleError
from supple.model.loads.applied import AppliedLoad
from supple.model.system import System
from supple.scene.inputs import Input

# Functions of time cannot be read; their values at this many times of a run are taken instead.
_TIMES = 16


def scene_hash(system: System, begin: float, duration: float) -> str:
    """SHA-256 of everything in a scene, in hexadecimal digits.

    Parameters
    ----------
    system : of the scene; begin, duration : time at the start of the run, and its length [s]
    """
    digest = hashlib.sha256()
    _add(digest, system.scene)
    for time in begin + duration * np.arange(_TIMES) / (_TIMES - 1):
        for pin in system.pins:
            _add(digest, pin.targets(time) if _is_script(pin.motion) else None)
        for force, load in zip(system.scene.forces, system.loads, strict=False):
            _add(digest, _forces_of(load, system, time) if _is_script(force.force) else None)
        for load in system.loads[len(system.scene.forces) :]:
            _add(digest, _forces_of(load, system, time))
        for motor in system.scene.motors.values():
            _add(digest, motor.at(time) if _is_script(motor.script) else None)
        for actuator in system.actuators:
            _add(digest, actuator.law.reached(time, actuator.start, 1.0))
        for target in system.soft_targets:
            _add(digest, target.targets(time) if _is_script(target.target.motion) else None)
        for obstacle in system.obstacles:
            _add(digest, obstacle.pose(time) if _is_script(obstacle.motion) else None)
    return digest.hexdigest()


def _forces_of(load: AppliedLoad, system: System, time: float) -> NDArray[np.float64]:
    """(n, 3) the forces of a load where the simulation began [N]."""
    x = system.start_states[0].positions
    out = np.zeros_like(x)
    load.add_forces(x, time, out)
    return out


def _is_script(function: object) -> bool:
    """Whether it is a function of time that the scene determines; the values of inputs are in the State."""
    return callable(function) and not isinstance(function, Input)


def _add(digest: Any, value: Any) -> None:
    """Add a value with its kind and its length, so that different values never give the same bytes."""
    if is_dataclass(value) and not isinstance(value, type):
        _add_text(digest, type(value).__name__)
        for field in fields(value):
            _add_text(digest, field.name)
            _add(digest, getattr(value, field.name))
        _add_text(digest, "end")
    elif isinstance(value, np.ndarray):
        _add_text(digest, f"{value.dtype.str}{value.shape}")
        digest.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, Mapping):
        _add(digest, list(value.items()))
    elif isinstance(value, (list, tuple)):
        _add_text(digest, f"{len(value)} of")
        for item in value:
            _add(digest, item)
    elif isinstance(value, Input):
        _add(digest, [type(value).__name__, value.name, value.value])
    elif callable(value):
        _add_text(digest, "function")
    elif value is None or isinstance(value, (bool, int, float, str, np.generic)):
        _add_text(digest, repr(value))
    else:
        raise SuppleError(f"a {type(value).__name__} in the scene has no known content; make it a dataclass")


def _add_text(digest: Any, text: str) -> None:
    data = text.encode()
    digest.update(len(data).to_bytes(8, "little") + data)
