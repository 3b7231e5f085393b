"""What XPBD must know of earlier steps beside positions and velocities. It is stored in `State.memory`."""

from __future__ import annotations

from dataclasses import dataclass

from supple.xpbd.assessment.assessment import Ledger
from supple.xpbd.contact.memory import ContactMemory
from supple.xpbd.damping.kelvin_voigt import ViscousMemory
from supple.xpbd.sleep import SleepMemory


@dataclass(frozen=True, eq=False)
class XPBDMemory:
    """The memory of one state.

    Attributes
    ----------
    contact : of contact; None without contact of surfaces
    viscous : of damping; None where nothing is damped
    ledger : of the assessment of frames; None at the start
    substeps : what the last frame asks of the next one, where repetitions helped; falls back to zero
    sleep : of bodies at rest; None at the start
    futile : the statuses that the last frame had in spite of repetitions
    """

    contact: ContactMemory | None = None
    viscous: ViscousMemory | None = None
    ledger: Ledger | None = None
    substeps: float = 0.0
    futile: frozenset[str] = frozenset()
    sleep: SleepMemory | None = None
