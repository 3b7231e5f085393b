"""The displacement of every obstacle and every pin, and its force on bodies."""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from supple.model.pin_reactions import pin_labels
from supple.model.state import SolverDetails, State
from supple.model.system import System
from supple.results.readings.reading import DrivenReading
from supple.scene.rigid.pose import rotation_of
from supple.scene.scene import Scene

_UNKNOWN = np.full(3, np.nan)
_EQUAL = 1e-9  # displacements of a pin's vertices, over its size


def driven_names(scene: Scene) -> list[str]:
    """The names of obstacles, then of pins, which are "BODY.pin" where they have none; repeated ones get a number."""
    counts = Counter(sensor.name for sensor in scene.sensors)
    names = []
    for name in [str(item.name) for item in scene.obstacles] + [pin.name or f"{pin.body}.pin" for pin in scene.pins]:
        counts[name] += 1
        names.append(name if counts[name] == 1 else f"{name} {counts[name]}")
    return names


def driven_readings(system: System, state: State, details: SolverDetails) -> dict[str, DrivenReading]:
    """By name, what the obstacles and pins of a system do."""
    pushes, drags = (getattr(details, name, {}) for name in ("contact_forces", "friction_forces"))
    names = driven_names(system.scene)
    found: dict[str, DrivenReading] = {}
    for name, obstacle in zip(names, system.obstacles, strict=False):
        R, t = obstacle.pose(state.time)
        key, center = str(obstacle.name), obstacle.center
        force = 0.0 - (pushes[key] + drags[key]) if key in pushes and key in drags else _UNKNOWN
        found[name] = DrivenReading(R @ center + t - center, float(Rotation.from_matrix(R).magnitude()), force)
    for name, pin, label in zip(names[len(found) :], system.pins, pin_labels(system), strict=True):
        there = state.positions[pin.vertices]
        moved = (there - pin.anchors).mean(axis=0)
        found[name] = DrivenReading(moved, _turned(pin.anchors, there), details.reaction_forces.get(label, _UNKNOWN))
    return found


def _turned(before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    moved = after - before
    if np.ptp(moved, axis=0).max() <= _EQUAL * max(float(np.ptp(before, axis=0).max()), np.abs(moved).max()):
        return 0.0
    return float(Rotation.from_matrix(rotation_of(before, after)).magnitude())
