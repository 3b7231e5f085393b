"""The parameters that a page may change while a simulation runs, with their ranges, for inputs and checks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from supple.app.viewer.protocol.values import displayed, number
from supple.errors import CommandError

Owner = Literal["solver", "scene", "body"]
Value = float | int | bool


@dataclass(frozen=True)
class Parameter:
    """One parameter of a running simulation.

    Attributes
    ----------
    name : in commands and descriptions; label, hint : on the panel; unit : that the panel
        displays, "" where it has none; factor : how many of the SI unit it is
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
    hint: str = ""

    def checked(self, value: object) -> Value:
        """`value`, converted to `kind`; raises `CommandError` where it is of another kind or out of range."""
        if self.kind is bool:
            if not isinstance(value, (bool, np.bool_)):
                raise CommandError(f"{self.name} is {displayed(value)}; give true or false")
            return bool(value)
        checked = number(value, self.name, self.low, self.high)
        if self.kind is int:
            if checked != int(checked):
                raise CommandError(f"{self.name} is {displayed(value)}; give a whole number")
            return int(checked)
        return checked


PARAMETERS: dict[str, Parameter] = {
    parameter.name: parameter
    for parameter in (
        Parameter(
            "substeps",
            "substeps (0: automatic)",
            "solver",
            int,
            0,
            200,
            hint="Substeps of a time step; 0: as many as the step needs",
        ),
        Parameter(
            "momentum_restore",
            "momentum restore",
            "solver",
            bool,
            0,
            1,
            hint="Correct the momentum that iterations lose",
        ),
        Parameter(
            "contact", "contact of bodies", "solver", bool, 0, 1, hint="Whether bodies touch each other, and themselves"
        ),
        Parameter("dt", "time step", "scene", float, 1e-4, 0.1, "ms", 1e-3, hint="Simulated time of a frame"),
        Parameter(
            "gravity",
            "gravity",
            "scene",
            float,
            -100.0,
            100.0,
            "m/s^2",
            hint="Acceleration along the gravity of the scene; negative: upwards",
        ),
        Parameter(
            "youngs",
            "Young's modulus",
            "body",
            float,
            1e2,
            1e11,
            "kPa",
            1e3,
            hint="Stiffness: stress per strain. Rubber 1 MPa, gummy bears 30 kPa",
        ),
        Parameter(
            "poisson",
            "Poisson's ratio",
            "body",
            float,
            -0.5,
            0.499,
            hint="How much a body narrows when stretched; 0.5 keeps its volume",
        ),
        Parameter(
            "edge_compliance",
            "edge compliance",
            "body",
            float,
            0.0,
            1.0,
            "mm/N",
            1e-3,
            hint="How far edges give way to a force",
        ),
        Parameter(
            "volume_compliance",
            "volume compliance",
            "body",
            float,
            0.0,
            1.0,
            "mm^5/N",
            1e-15,
            hint="How far the volume of tets gives way to a pressure",
        ),
        Parameter(
            "damping",
            "damping",
            "body",
            float,
            0.0,
            1.0,
            "ms",
            1e-3,
            hint="Relaxation time of the viscous stress",
        ),
        Parameter(
            "density",
            "density",
            "body",
            float,
            1.0,
            1e5,
            "kg/m^3",
            hint="Mass per volume; water 1000 kg/m³",
        ),
        Parameter(
            "friction", "friction", "body", float, 0.0, 10.0, hint="Coulomb's coefficient; of a pair, see the scene"
        ),
    )
}


def find_parameter(name: object) -> Parameter:
    """The parameter of that name; raises `CommandError` where none exists."""
    if not isinstance(name, str) or name not in PARAMETERS:
        raise CommandError(f"parameter {displayed(name)} does not exist; there are {', '.join(PARAMETERS)}")
    return PARAMETERS[name]
