"""Inputs of the panel that belong to a number of the simulation."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from supple.viewer.controls.controller import Controller, sequential
from supple.viewer.controls.pending import PendingValue
from supple.viewer.protocol.messages import SetParameter
from supple.viewer.protocol.parameters import PARAMETERS, Parameter
from supple.viewer.protocol.snapshots import Value
from supple.viewer.server.browser_values import number

# The smallest power of ten of a slider whose left end is zero.
_LEAST_POWER = -12.0
# What stands beside a slider is short.
_SHORT = {"youngs": "E", "edge_compliance": "Edges", "volume_compliance": "Volume"}
# Ends of sliders, where the allowed range is wider than a slider can be used for.
_SLIDER_ENDS = {"gravity": (-20.0, 20.0), "friction": (0.0, 2.0), "poisson": (0.0, 0.499), "youngs": (1e2, 1e9)}


class ParameterInput:
    """A slider or check box for one parameter.

    Parameters
    ----------
    gui : viser's; name : of the parameter; value : it starts with; whose : the body it is for, asked anew every time
    """

    def __init__(
        self, gui: Any, controller: Controller, name: str, value: Value, whose: Callable[[], str | None] = lambda: None
    ) -> None:
        self.parameter: Parameter = PARAMETERS[name]
        self._controller, self._whose = controller, whose
        self._pending, self._removed = PendingValue(), False
        self.value: Value = value
        low, high = _SLIDER_ENDS.get(name, (self.parameter.low, self.parameter.high))
        self._low, self._high = min(low, float(value)), max(high, float(value))
        if self.parameter.kind is bool:
            self.handle = gui.add_checkbox(self._label(value), initial_value=bool(value))
        else:
            place = self._place(value)
            self.handle = gui.add_slider(
                self._label(value), *self._ends(), self._step(), initial_value=place, hint=self._hint()
            )
        self.handle.on_update(sequential(self._moved))

    def show(self, value: Value, applied: int) -> None:
        """Bring the input to the simulation's value, unless a visitor is at it.

        Parameters
        ----------
        applied : number of the newest command that the simulation has acted upon
        """
        if value != self.value and not self._pending.stands(applied):
            self.value = value
            self.handle.value = self._place(value)
            self.handle.label = self._label(value)

    def remove(self) -> None:
        """Take it off the panel."""
        self._removed = True
        self.handle.remove()

    def _moved(self, event: Any) -> None:
        if event.client is None:
            return
        with self._controller.lock:
            value = self._value_at(self.handle.value)
            if self._removed or value == self.value:
                return
            self.value = value
            self.handle.label = self._label(value)
            # Within the lock: else a moment's old value could be shown between the two.
            name, whose = self.parameter.name, self._whose()
            self._pending.made(self._controller.send(event.client, lambda: SetParameter(name, value, whose)))

    def _ends(self) -> tuple[float, float]:
        if self.parameter.kind is int:
            return int(self._low), int(self._high)
        return self._place(self._low), self._place(self._high)

    def _step(self) -> float:
        if self.parameter.kind is int:
            return 1
        low, high = self._ends()
        return 0.05 if self.parameter.logarithmic else 10.0 ** round(math.log10((high - low) / 200.0))

    def _place(self, value: Value) -> Any:
        """Where on the slider a value is."""
        if self.parameter.kind is bool:
            return bool(value)
        if self.parameter.kind is int:
            return int(value)
        if not self.parameter.logarithmic:
            return float(value)
        return max(_LEAST_POWER, math.log10(value)) if value > 0.0 else _LEAST_POWER

    def _value_at(self, place: object) -> Value:
        """The value at a place of the slider."""
        if self.parameter.kind is bool:
            return bool(place)
        low, high = self._ends()
        at = number(place, low, high)
        if self.parameter.kind is int:
            return round(at)
        if not self.parameter.logarithmic:
            return at
        if self._low == 0.0 and at <= _LEAST_POWER:
            return 0.0
        return min(max(10.0**at, self.parameter.low), self.parameter.high)

    def _label(self, value: Value) -> str:
        name, unit = self.parameter.label[:1].upper() + self.parameter.label[1:], _pretty(self.parameter.unit)
        if self.parameter.logarithmic:
            return f"{_SHORT.get(self.parameter.name, name)} {with_unit(float(value), unit)}"
        return f"{name} [{unit}]" if unit else name

    def _hint(self) -> str | None:
        return "In powers of ten" if self.parameter.logarithmic else None


def with_unit(value: float, unit: str) -> str:
    """A number with its unit; pascals in thousands, millions or billions."""
    if unit == "Pa":
        for factor, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
            if value >= factor:
                return f"{value / factor:.3g} {prefix}Pa"
    return f"{value:.3g} {unit}".strip()


def _pretty(unit: str) -> str:
    return unit.replace("^2", "²").replace("^3", "³").replace("^5", "⁵")
