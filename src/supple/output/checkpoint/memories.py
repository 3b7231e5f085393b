"""The classes that `State.memory` may be made of. A new one is one line here."""

from __future__ import annotations

from supple.implicit.stepping.conservation import EnergyMade
from supple.implicit.stepping.integrators import History
from supple.xpbd.assessment.assessment import Ledger
from supple.xpbd.assessment.softening import MeasuredWork
from supple.xpbd.contact.contact_rows import LoadedRows
from supple.xpbd.contact.frame_forces import ShapeLoads
from supple.xpbd.contact.memory import ContactMemory, ObstacleMemory, SurfaceMemory
from supple.xpbd.damping.kelvin_voigt import ViscousMemory
from supple.xpbd.memory import ControlMemory, XPBDMemory
from supple.xpbd.sleep import SleepMemory

MEMORIES: tuple[type, ...] = (
    ContactMemory,
    ControlMemory,
    EnergyMade,
    History,
    Ledger,
    LoadedRows,
    MeasuredWork,
    ObstacleMemory,
    ShapeLoads,
    SleepMemory,
    SurfaceMemory,
    ViscousMemory,
    XPBDMemory,
)
