"""What XPBD must know of earlier steps beside positions and velocities. It is stored in `State.memory`."""

from __future__ import annotations

from dataclasses import dataclass

from supple.xpbd.contact.memory import ContactMemory
from supple.xpbd.damping.kelvin_voigt import ViscousMemory


@dataclass(frozen=True, eq=False)
class XPBDMemory:
    """The memory of one state.

    Attributes
    ----------
    contact : of contact; None without contact of surfaces
    viscous : of damping; None where nothing is damped
    """

    contact: ContactMemory | None
    viscous: ViscousMemory | None
