"""Reaction forces of pins on the bodies that they hold, and of rigid bodies on what is welded to them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.pin_reactions import pin_labels
from supple.model.system import System


def reaction_forces(system: System, gradient: NDArray[np.float64]) -> tuple[dict[str, NDArray], dict[str, NDArray]]:
    """The forces that pins exert on their vertices.

    Parameters
    ----------
    gradient : (n, 3) of the whole objective at the end of a step, pinned vertices included [N]: mass times acceleration
        minus all other forces, which is the force of the pin.

    Returns
    -------
    totals, by_vertex : by the pin's label, (3,) and (k, 3) [N]; repeated labels get a number.
    """
    totals: dict[str, NDArray] = {}
    by_vertex: dict[str, NDArray] = {}
    for label, pin in zip(pin_labels(system), system.pins, strict=True):
        by_vertex[label] = gradient[pin.vertices]
        totals[label] = by_vertex[label].sum(axis=0)
    return totals, by_vertex


def weld_forces(system: System, gradient: NDArray[np.float64]) -> dict[str, NDArray]:
    """The forces (3,) of rigid bodies on the vertices that are welded to them, by name of the weld [N].

    Parameters
    ----------
    gradient : as of `reaction_forces`, before welded vertices are eliminated
    """
    welding, welds = system.welding, system.scene.welds
    shares = gradient[welding.vertices]
    return {str(weld.name): shares[welding.weld == k].sum(axis=0) for k, weld in enumerate(welds)}
