"""Values with units, as a person reads them."""

import math

import pytest

from supple.app.viewer.protocol.quantities import written


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
