"""Reactions of pins: the sums of all forces on what they hold."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System

ByPin = dict[str, NDArray[np.float64]]


def pin_labels(system: System) -> list[str]:
    """The label of every pin; repeated labels get a number."""
    labels: list[str] = []
    for pin in system.pins:
        label, number = pin.label, 2
        while label in labels:
            label = f"{pin.label} #{number}"
            number += 1
        labels.append(label)
    return labels


def pin_reactions(system: System, unbalanced: NDArray[np.float64]) -> tuple[ByPin, ByPin]:
    """The forces that pins exert on their vertices.

    Parameters
    ----------
    unbalanced : (n, 3) mass times acceleration minus all forces but those of pins, of each vertex that is not welded
        (see `Welding.reduced`) [N]

    Returns
    -------
    totals, by_vertex : by the pin's label, (3,) and (k, 3) [N]; repeated labels get a number.
    """
    pins = zip(pin_labels(system), system.pins, strict=True)
    by_vertex = {label: unbalanced[pin.vertices] for label, pin in pins}
    return {label: forces.sum(axis=0) for label, forces in by_vertex.items()}, by_vertex
