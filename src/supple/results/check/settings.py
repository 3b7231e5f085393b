"""The settings of `check_recording`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from supple.errors import OutputError

NAMES = {
    "finite": "every recorded number is finite",
    "cells": "every frame of a series has the points and cells of the first",
    "sequence": "times and numbers of frames go up by one step, and each frame follows from the one before",
    "scale": "the unit of length does not change from frame to frame",
    "status": "every step converged",
    "rest shape": "no tet is inverted or flat at rest; volumes and masses are above zero",
    "inversion": "no tet is inverted or flat, by the exact sign of its determinant",
    "intersection": "no two surfaces meet, by exact tests of their triangles",
    "tunnelling": "no surface passes through another one between two frames",
    "obstacles": "no body is in a half-space or a round solid, or outside its container",
    "containment": "nothing is completely inside another thing",
    "distance": "the distance of surfaces is above zero",
    "rigidity": "rigid bodies are neither deformed nor mirrored",
    "welds": "welded vertices stay in their places on rigid bodies",
    "joints": "joints hold, within their limits and largest rates; motors stay within their largest effort",
    "volume": "nearly incompressible bodies keep at least half of their volume",
    "momentum": "without loads, momentum changes by gravity alone",
    "spin": "without loads, angular momentum about the center of mass does not grow",
    "energy": "energy does not grow by more than the recorded works",
    "balance": "recorded works and residuals add up to the change of energy, and the residual is small",
    "works": "recorded works of pins and contact are those that follow from the frames",
    "records": "recorded determinants, energies and momenta are those of the recorded positions and velocities",
}


@dataclass(frozen=True)
class CheckSettings:
    """Which checks are made, on which frames, and what they allow.

    Parameters
    ----------
    only, skip : names of checks; see `NAMES`. Without `only`, all but those in `skip`.
    every : check each k-th frame, and the last.
    max_volume_change : how far a body's volume may differ from that at rest, as a share of it. None: 0.5 for bodies
        with a Poisson's ratio of 0.45 or more, unlimited for others.
    max_orthogonality_error : |F^T F - 1| that a rigid body may have [-].
    max_weld_error : how far a welded vertex may be from its place on the rigid body, over that body's size [-].
    max_joint_error : how far a joint may be from holding, over the diameter of gyration of its smaller body, and in
        radians [-]. None: 1e-6 for recordings of `Implicit`, 1e-3 for others.
    max_energy_gain : how far the energy may exceed that at the start and the works, as a share of the energy in motion;
        also how large the sum of residuals may be.
    max_momentum_change : how far momenta may change without a force, as a share of the momentum that there is.

    Raises
    ------
    OutputError : where a name is unknown, or a number is out of range.
    """

    only: Sequence[str] = ()
    skip: Sequence[str] = ()
    every: int = 1
    max_volume_change: float | None = None
    max_orthogonality_error: float = 0.01
    max_weld_error: float = 1e-9
    max_joint_error: float | None = None
    max_energy_gain: float = 0.05
    max_momentum_change: float = 1e-6

    def __post_init__(self) -> None:
        for name in (*self.only, *self.skip):
            if name not in NAMES:
                raise OutputError(f"check: check {name!r} does not exist; there are {', '.join(NAMES)}")
        if isinstance(self.every, bool) or not isinstance(self.every, (int, np.integer)) or self.every < 1:
            raise OutputError(f"check: every is {self.every!r}; give a whole number of one or more")
        shares = ("max_orthogonality_error", "max_weld_error", "max_energy_gain", "max_momentum_change")
        for key in ("max_volume_change", "max_joint_error", *shares):
            value = getattr(self, key)
            if value is not None and not (isinstance(value, (int, float)) and value >= 0.0):
                raise OutputError(f"check: {key} is {value!r}; give a number of zero or more")
        if not self.chosen:
            raise OutputError("check: nothing is left to check; give fewer names to skip")

    @property
    def chosen(self) -> tuple[str, ...]:
        """The names of the checks to make."""
        wanted = self.only or NAMES
        return tuple(name for name in NAMES if name in wanted and name not in self.skip)
