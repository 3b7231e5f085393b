"""Ideal gas in a cavity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from supple.errors import SceneError
from supple.kinds.forms import NON_NEGATIVE, POSITIVE
from supple.kinds.kind import Kind
from supple.scene.loads.over_time import OverTime, OverTimeOf

AMOUNT = OverTimeOf(bounds=POSITIVE)
GAS_CONSTANT = 8.31446261815324  # [J/(mol K)], exact by definition


@dataclass(frozen=True, eq=False)
class Gas(Kind):
    """An ideal gas: p V^gamma is constant for a constant amount, and p V0 = n R T in the volume V0 at the start.

    Parameters
    ----------
    amount : n [mol]; a number, a `Curve`, or a function of time; None for the amount that has the pressure
        `ambient` at the start.
    temperature : T at the volume of the start [K].
    gamma : 1 for constant temperature; the ratio of specific heats, 1.4 for air, where no heat is exchanged.
    ambient : pressure outside of the body [Pa]; 0 in a vacuum.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    kind: ClassVar[str] = "gas"

    amount: Annotated[OverTime | None, AMOUNT] = None
    temperature: Annotated[float, POSITIVE] = 293.15
    gamma: Annotated[float, POSITIVE] = 1.0
    ambient: Annotated[float, NON_NEGATIVE] = 101325.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.amount is None and self.ambient == 0.0:
            raise SceneError("gas: ambient is 0, so that there is no gas at the start; give the amount")
