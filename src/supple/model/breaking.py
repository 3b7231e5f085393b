"""Stitches that break: at the end of a frame, every pair that carries more than its strength is gone.

The energy that it stores then leaves with it; in the balance it is the work "breaking".
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from supple.model.energy_balance import BREAKING
from supple.model.state import State, StepReport
from supple.model.system import System
from supple.scene.scene import Scene
from supple.scene.stitches.measures import stitch_energies, stitch_loads


def are_of(state: State, scene: Scene) -> bool:
    """Whether the scene has the stitches that have broken in a state."""
    broken, separated = state.broken_stitches, state.separated_stitches
    return bool(np.isin(broken, np.arange(len(scene.stitching))).all() and np.isin(separated, broken).all())


def without_broken(system: System, broken: NDArray[np.int64], separated: NDArray[np.int64]) -> System:
    """The system with all stitches of its scene but `broken` ones, see `State`; the same one where that is so."""
    stitching = system.stitching
    if np.array_equal(stitching.broken, broken) and np.array_equal(stitching.separated, separated):
        return system
    return replace(system, stitching=system.scene.stitching.without(broken, separated))


def after_breaks(system: System, state: State, step: StepReport) -> tuple[System, State, StepReport]:
    """What a step has led to, with the pairs broken that carry too much; the same system where none breaks."""
    stitching, names = system.stitching, system.scene.stitching.names
    if not names.breakable and not len(stitching.broken):
        return system, state, step
    broken, separated = stitching.broken, stitching.separated
    holding = np.delete(np.arange(len(names)), broken)
    if len(holding) and step.status.can_go_on:
        points = stitching.points(state.positions, state.time)
        over = stitch_loads(stitching, points, step.stitch_forces) > names.strength[holding]
        if over.any():
            lost = float(stitch_energies(stitching, points)[over].sum())
            work = {**step.details.work, BREAKING: -lost} if step.details.work else {}
            new = holding[over]
            step = replace(step, details=replace(step.details, work=work), broken_stitches=names.named(new))
            broken = np.union1d(broken, new)
    state = replace(state, broken_stitches=broken, separated_stitches=separated)
    return without_broken(system, broken, separated), state, step
