"""What XPBD must know of earlier steps beside positions and velocities. It is stored in `State.memory`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from supple.model.state import State
from supple.solvers.xpbd.assessment.assessment import Ledger
from supple.solvers.xpbd.assessment.softening import MeasuredWork
from supple.solvers.xpbd.contact.memory import ContactMemory
from supple.solvers.xpbd.damping.kelvin_voigt import ViscousMemory
from supple.solvers.xpbd.sleep import SleepMemory


@dataclass(frozen=True, eq=False)
class ControlMemory:
    """Control points of rigid bodies, to the bit, with the masses of what is welded to them.

    Attributes
    ----------
    inner : (2, c, 3) their positions [m] and velocities [m/s]; outer : those in the state
    """

    inner: NDArray[np.float64]
    outer: NDArray[np.float64]

    def belongs_to(self, state: State, rows: NDArray[np.integer]) -> bool:
        """Whether a state has these rows (c,) of positions and velocities."""
        if len(rows) != self.outer.shape[1]:
            return False
        return np.array_equal(np.stack([state.positions[rows], state.velocities[rows]]), self.outer)


@dataclass(frozen=True, eq=False)
class ElementMemory:
    """What `ElementStage`s must know of the frame before.

    Attributes
    ----------
    positions : (n, 3) at its end [m]; values : see `ElementStage.memory`, of each stage
    """

    positions: NDArray[np.float64]
    values: tuple[NDArray[np.float64], ...]

    def of(self, positions: NDArray[np.float64], stages: int) -> tuple[NDArray[np.float64] | None, ...]:
        """The values for so many stages where they belong to these positions, else None for each."""
        known = len(self.values) == stages and np.array_equal(positions, self.positions)
        return self.values if known else (None,) * stages


@dataclass(frozen=True, eq=False)
class XPBDMemory:
    """The memory of one state.

    Attributes
    ----------
    contact : of contact; None without contact of surfaces
    viscous : of damping; None where nothing is damped
    elements : of element stages; None without any
    ledger : of the assessment of frames; None at the start
    measured : how much of their stiffness bodies lacked; None at the start
    substeps : the number that the last frame requires of the next one, where repetitions helped; falls back to zero
    sleep : of bodies at rest; None at the start
    futile : the statuses of the last frame that repetitions did not remove
    control : of rigid bodies; None where nothing is welded to any
    at_rest : the last forces of joints, welds and pins of sleeping bodies, by field of `XPBDDetails` and name
    """

    contact: ContactMemory | None = None
    viscous: ViscousMemory | None = None
    elements: ElementMemory | None = None
    ledger: Ledger | None = None
    measured: MeasuredWork | None = None
    substeps: float = 0.0
    futile: frozenset[str] = frozenset()
    sleep: SleepMemory | None = None
    control: ControlMemory | None = None
    at_rest: Mapping[str, Mapping[str, NDArray[np.float64]]] = field(default_factory=dict)
