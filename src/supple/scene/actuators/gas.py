"""Ideal gas in a cavity."""

from __future__ import annotations

from dataclasses import dataclass

from supple.errors import SceneError
from supple.scene.loads.over_time import OverTime, checked_magnitude
from supple.scene.values import non_negative, positive

GAS_CONSTANT = 8.31446261815324  # [J/(mol K)], exact by definition


@dataclass(frozen=True, eq=False)
class Gas:
    """An ideal gas: p V^gamma is constant for a constant amount, and p V0 = n R T in the volume V0 at the start.

    Parameters
    ----------
    amount : n [mol]; a number, a `Curve`, or a function of time [s]; None for the amount that has the pressure
        `ambient` at the start.
    temperature : T at the volume of the start [K].
    gamma : 1 for constant temperature; the ratio of specific heats, 1.4 for air, where no heat is exchanged.
    ambient : pressure outside of the body [Pa]; 0 in a vacuum.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    amount: OverTime | None = None
    temperature: float = 293.15
    gamma: float = 1.0
    ambient: float = 101325.0

    def __post_init__(self) -> None:
        if self.amount is not None:
            object.__setattr__(self, "amount", checked_magnitude(self.amount, "gas: amount", zero=False))
        elif self.ambient == 0.0:
            raise SceneError("gas: ambient is 0, so that there is no gas at the start; give the amount")
        object.__setattr__(self, "temperature", positive(self.temperature, "gas: temperature"))
        object.__setattr__(self, "gamma", positive(self.gamma, "gas: gamma"))
        object.__setattr__(self, "ambient", non_negative(self.ambient, "gas: ambient"))
