"""What XPBD reports of a step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from supple.model.state import SolverDetails


@dataclass(frozen=True, eq=False)
class XPBDDetails(SolverDetails):
    """What `XPBD` reports of a step.

    Attributes
    ----------
    contacts : number of contacts that the last substep resolved, and of those between things at rest
    smallest_gap : smallest distance of a contact at the beginnings of the substeps [m], below zero where things began
        through each other, of bodies that do not sleep; None where nothing came near
    substeps : number of substeps; repeats : how often the frame was undone and repeated with more
    substeps_reason : the reason for this number
    softening : by body, the share of its stiffness that it lacks at this length of the substep, estimated (see
        `supple.solvers.xpbd.assessment.softening`)
    energy_gained : energy without a source that has not been lost since, over the energy of the scene [-]
    weld_forces : of the rigid bodies on what is welded to them, by name of the weld, (3,) means over the frame [N]
    contact_forces, friction_forces : by name of the body or obstacle, (3,) means over the frame [N]; each sum to zero
    asleep : by body, whether it rests, so that no substep was taken for it (see `supple.solvers.xpbd.sleep`)
    truncated : substeps in which motion was shortened by more than the error that contacts may leave, so that no tet
        inverts and nothing passes through anything
    contact_residual : largest change of a distance in the last sweep over contacts of a substep, as a share of the gap
        that surfaces keep
    """

    smallest_gap: float | None = None
    substeps: int = 0
    repeats: int = 0
    substeps_reason: str = field(default="", compare=False)
    softening: Mapping[str, float] = field(default_factory=dict)
    energy_gained: float = 0.0
    truncated: int = 0
    contact_residual: float = 0.0
    asleep: Mapping[str, bool] = field(default_factory=dict)
    weld_forces: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    contact_forces: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    friction_forces: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
