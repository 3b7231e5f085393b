"""What every obstacle and every pin does: how far it has moved, and the force on bodies."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from supple.errors import SceneError
from supple.model.pin_reactions import pin_labels
from supple.results.readings.reading import DrivenReading
from supple.scene.rigid.pose import rotation_of
from supple.scene.scene import Scene

if TYPE_CHECKING:
    from supple.results.readings.frame_readings import FrameReadings

_UNKNOWN = np.full(3, np.nan)
_EQUAL = 1e-9  # displacements of a pin's vertices, over its size


def driven_names(scene: Scene) -> list[str]:
    """The names of obstacles, then of pins, which are "BODY.pin" where they have none; repeated ones get a number."""
    counts = Counter(sensor.name for sensor in scene.sensors)
    names = []
    for name in [str(each.name) for each in scene.obstacles] + [pin.name or f"{pin.body}.pin" for pin in scene.pins]:
        counts[name] += 1
        names.append(name if counts[name] == 1 else f"{name} {counts[name]}")
    return names


def driven_readings(frame: FrameReadings) -> dict[str, DrivenReading]:
    """By name, what the obstacles and pins of a frame do."""
    system, time, details = frame.system, frame.state.time, frame.report.details
    pushes, drags = (getattr(details, name, {}) for name in ("contact_forces", "friction_forces"))
    names = driven_names(system.scene)
    found: dict[str, DrivenReading] = {}
    for name, obstacle in zip(names, system.obstacles, strict=False):
        R, t = obstacle.pose(time)
        key = str(obstacle.name)
        force = -(pushes[key] + drags[key]) if key in pushes and key in drags else _UNKNOWN
        center = obstacle.center
        found[name] = DrivenReading(R @ center + t - center, float(Rotation.from_matrix(R).magnitude()), force + 0.0)
    if system.pins:
        reaction = _reactions(frame)
        for name, pin, label in zip(names[len(found) :], system.pins, pin_labels(system), strict=True):
            there = frame.state.positions[pin.vertices]
            found[name] = DrivenReading(
                (there - pin.anchors).mean(axis=0), _turned(pin.anchors, there), reaction(label)
            )
    return found


def _reactions(frame: FrameReadings) -> Callable[[str], NDArray[np.float64]]:
    """The reaction of a pin by its label; NaN where the solver and the material do not give it."""
    try:
        known = frame.reactions
    except SceneError:
        known = {}
    return lambda label: known.get(label, _UNKNOWN)


def _turned(before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    moved = after - before
    if np.ptp(moved, axis=0).max() <= _EQUAL * max(float(np.ptp(before, axis=0).max()), np.abs(moved).max()):
        return 0.0
    return float(Rotation.from_matrix(rotation_of(before, after)).magnitude())
