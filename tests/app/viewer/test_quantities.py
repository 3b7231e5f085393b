"""Values with units, as a person reads and types them."""

import math

import pytest

from supple.app.viewer.protocol.quantities import typed, written
from supple.errors import CommandError


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("30 kPa", "Pa", 3e4),
        ("3e4", "Pa", 3e4),
        ("3E4Pa", "Pa", 3e4),
        (" .5 GPa ", "Pa", 5e8),
        ("20 ms", "s", 0.02),
        ("5 µN", "N", 5e-6),
        ("-9.81 m/s²", "m/s^2", -9.81),
        ("1.2 g/cm^3", "kg/m^3", 1200.0),
        ("2 cm", "m", 0.02),
        ("7 kJ/m³", "J/m^3", 7e3),
        ("0.3", "", 0.3),
    ],
)
def test_typed_values(text, unit, value):
    assert typed(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    "text", ["", "kPa", "30 kN", "30 k", "1,5 kPa", "1 Pa Pa", "1e", "nan", "inf Pa", "0x10", "3 4"]
)
def test_other_texts_are_refused_with_an_example(text):
    with pytest.raises(CommandError, match="is not a value of stiffness; type for example 30 kPa"):
        typed(text, "Pa", "stiffness")


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (3e4, "Pa", "30 kPa"),
        (999.99, "Pa", "1 kPa"),
        (0.0, "Pa", "0 Pa"),
        (-2.5e6, "Pa", "-2.5 MPa"),
        (0.0012, "s", "1.2 ms"),
        (1000.0, "kg/m^3", "1000 kg/m³"),
        (12340.0, "kg/m^3", "12340 kg/m³"),
        (0.45, "", "0.45"),
        (math.nan, "Pa", "not known"),
        (2e12, "Pa", "2000 GPa"),
    ],
)
def test_written_values(value, unit, text):
    assert written(value, unit) == text
    if math.isfinite(value):
        assert typed(text, unit) == pytest.approx(value, rel=1e-3, abs=1e-12)
