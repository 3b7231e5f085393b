"""The classes that `State.memory` may be made of. A new one is one line here."""

from __future__ import annotations

from supple.implicit.stepping.conservation import EnergyMade
from supple.implicit.stepping.integrators import History
from supple.xpbd.contact.memory import ContactMemory

MEMORIES: tuple[type, ...] = (
    ContactMemory,
    EnergyMade,
    History,
)
