"""Cavities of a scene file."""

from __future__ import annotations

from pydantic import Field

from supple.app.scene_file.entries.loads import CurveModel, over_time
from supple.app.scene_file.model import Index, Model, Name, NonNegative, Number, Positive
from supple.scene.actuators.cavity import Cavity
from supple.scene.actuators.gas import Gas
from supple.scene.located import at


class GasModel(Model):
    """An ideal gas."""

    amount: Positive | CurveModel | None = Field(
        default=None, description="[mol], or a curve; without it, that with the pressure `ambient` at the start"
    )
    temperature: Positive = Field(default=293.15, description="at the volume of the start [K]")
    gamma: Positive = Field(default=1.0, description="1: constant temperature; 1.4: air without exchange of heat")
    ambient: NonNegative = Field(default=101325.0, description="pressure outside of the body [Pa]")

    def build(self) -> Gas:
        return Gas(over_time(self.amount, "amount"), self.temperature, self.gamma, self.ambient)


class CavityModel(Model):
    """A closed inner surface of a body; give one of `pressure`, `volume` and `gas`."""

    body: Name = Field(description="name of the body")
    pressure: Number | CurveModel | None = Field(default=None, description="less that outside [Pa], or a curve")
    volume: Positive | CurveModel | None = Field(default=None, description="of a liquid [m^3], or a curve")
    gas: GasModel | None = None
    void: Index = Field(default=0, description="which void of the body, the largest first")
    triangles: list[Index] | None = Field(
        default=None, min_length=1, description="instead of `void`: a closed surface of the body's triangles"
    )
    name: Name | None = Field(default=None, description="in reports; without it, that of the body")

    def build(self) -> Cavity:
        gas = None
        if self.gas is not None:
            with at("gas"):
                gas = self.gas.build()
        pressure, volume = over_time(self.pressure, "pressure"), over_time(self.volume, "volume")
        return Cavity(self.body, pressure, volume, gas, self.void, self.triangles, self.name)
