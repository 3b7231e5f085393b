"""The parameters that a page may change while a simulation runs, with their ranges, for inputs and checks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from supple.app.viewer.protocol.values import boolean, displayed, number
from supple.errors import CommandError

Owner = Literal["solver", "scene", "body"]
Value = float | int | bool


@dataclass(frozen=True)
class Parameter:
    """One parameter of a running simulation.

    Attributes
    ----------
    name : in commands and descriptions; label : on the panel; unit : that the panel displays, "" where it has none
    factor : how many of the SI unit it is
    owner : "body" where each body has its own value
    kind : float, int or bool; low, high : both are allowed
    """

    name: str
    label: str
    owner: Owner
    kind: type[float] | type[int] | type[bool]
    low: float
    high: float
    unit: str = ""
    factor: float = 1.0

    def checked(self, value: object) -> Value:
        """`value`, converted to `kind`; raises `CommandError` where it is of another kind or out of range."""
        if self.kind is bool:
            return boolean(value, self.name)
        checked = number(value, self.name, self.low, self.high)
        if self.kind is int:
            if checked != int(checked):
                raise CommandError(f"{self.name} is {displayed(value)}; give a whole number")
            return int(checked)
        return checked


PARAMETERS = {
    one.name: one
    for one in (
        Parameter("substeps", "substeps (0: automatic)", "solver", int, 0, 200),
        Parameter("momentum_restore", "momentum restore", "solver", bool, 0, 1),
        Parameter("contact", "contact of bodies", "solver", bool, 0, 1),
        Parameter("dt", "time step", "scene", float, 1e-4, 0.1, "ms", 1e-3),
        Parameter("gravity", "gravity", "scene", float, -100.0, 100.0, "m/s^2"),
        Parameter("youngs", "Young's modulus", "body", float, 1e2, 1e11, "kPa", 1e3),
        Parameter("poisson", "Poisson's ratio", "body", float, -0.5, 0.499),
        Parameter("edge_compliance", "edge compliance", "body", float, 0.0, 1.0, "mm/N", 1e-3),
        Parameter("volume_compliance", "volume compliance", "body", float, 0.0, 1.0, "mm^5/N", 1e-15),
        Parameter("damping", "damping", "body", float, 0.0, 1.0, "ms", 1e-3),
        Parameter("density", "density", "body", float, 1.0, 1e5, "kg/m^3"),
        Parameter("friction", "friction", "body", float, 0.0, 10.0),
    )
}


def find_parameter(name: object) -> Parameter:
    """The parameter of that name; raises `CommandError` where none exists."""
    if not isinstance(name, str) or name not in PARAMETERS:
        raise CommandError(f"parameter {displayed(name)} does not exist; there are {', '.join(PARAMETERS)}")
    return PARAMETERS[name]
