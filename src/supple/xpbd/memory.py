"""What XPBD must know of earlier steps beside positions and velocities. It is stored in `State.memory`."""

from __future__ import annotations

from dataclasses import dataclass

from supple.xpbd.assessment.assessment import Ledger
from supple.xpbd.contact.memory import ContactMemory


@dataclass(frozen=True, eq=False)
class XPBDMemory:
    """The memory of one state.

    Attributes
    ----------
    contact : of contact; None without contact of surfaces
    ledger : of the assessment of frames
    """

    contact: ContactMemory | None
    ledger: Ledger
