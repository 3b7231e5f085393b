"""The classes that `State.memory` may be made of. A new one is one line here."""

from __future__ import annotations

from supple.solvers.implicit.stepping.conservation import EnergyMade
from supple.solvers.implicit.stepping.integrators import History
from supple.solvers.xpbd.assessment.assessment import Ledger
from supple.solvers.xpbd.assessment.softening import MeasuredWork
from supple.solvers.xpbd.contact.contact_rows import LoadedRows
from supple.solvers.xpbd.contact.frame_forces import ShapeLoads
from supple.solvers.xpbd.contact.memory import ContactMemory, ObstacleMemory, SurfaceMemory
from supple.solvers.xpbd.damping.kelvin_voigt import ViscousMemory
from supple.solvers.xpbd.memory import ControlMemory, XPBDMemory
from supple.solvers.xpbd.sleep import SleepMemory

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
