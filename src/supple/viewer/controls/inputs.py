"""Inputs of the panel for parameters of the simulation."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from supple.viewer.controls.controller import Controller, sequential
from supple.viewer.controls.pending import PendingValue
from supple.viewer.protocol.commands import SetParameter
from supple.viewer.protocol.parameters import PARAMETERS, Parameter, Value
from supple.viewer.server.browser_values import number

# The smallest power of ten of a slider whose left end is zero.
_LEAST_POWER = -12.0
# There is little space beside a slider.
_SHORT_LABELS = {"youngs": "E", "edge_compliance": "Edges", "volume_compliance": "Volume"}
# Ends of sliders, where the allowed range is too wide for a slider.
_SLIDER_ENDS = {"gravity": (-20.0, 20.0), "friction": (0.0, 2.0), "poisson": (0.0, 0.499), "youngs": (1e2, 1e9)}


class ParameterInput:
    """A slider or check box for one parameter.

    Parameters
    ----------
    gui : of viser; name : of the parameter; value : initial value; whose : returns the name of its body, or None
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
            position = self._slider_position(value)
            hint = "In powers of ten" if self.parameter.logarithmic else None
            self.handle = gui.add_slider(
                self._label(value), *self._end_positions(), self._step(), initial_value=position, hint=hint
            )
        self.handle.on_update(sequential(self._moved))

    def show(self, value: Value, applied: int) -> None:
        """Set the input to the value of the simulation, unless the value of a visitor is pending.

        Parameters
        ----------
        applied : number of the newest command that the simulation has executed
        """
        if value != self.value and not self._pending.is_pending(applied):
            self.value = value
            self.handle.value = self._slider_position(value)
            self.handle.label = self._label(value)

    def remove(self) -> None:
        """Remove it from the panel."""
        self._removed = True
        self.handle.remove()

    def _moved(self, event: Any) -> None:
        if event.client is None:
            return
        with self._controller.lock:
            value = self._value_of(self.handle.value)
            if self._removed or value == self.value:
                return
            self.value = value
            self.handle.label = self._label(value)
            # Within the lock: otherwise `show` could set an old value between the two.
            name, whose = self.parameter.name, self._whose()
            self._pending.requested(self._controller.send(event.client, lambda: SetParameter(name, value, whose)))

    def _end_positions(self) -> tuple[float, float]:
        return self._slider_position(self._low), self._slider_position(self._high)

    def _step(self) -> float:
        if self.parameter.kind is int:
            return 1
        low, high = self._end_positions()
        return 0.05 if self.parameter.logarithmic else 10.0 ** round(math.log10((high - low) / 200.0))

    def _slider_position(self, value: Value) -> Any:
        """The slider position of a value."""
        if not self.parameter.logarithmic:
            return self.parameter.kind(value)
        return max(_LEAST_POWER, math.log10(value)) if value > 0.0 else _LEAST_POWER

    def _value_of(self, position: object) -> Value:
        """The value at a slider position."""
        if self.parameter.kind is bool:
            return bool(position)
        low, high = self._end_positions()
        at = number(position, low, high)
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
            return f"{_SHORT_LABELS.get(self.parameter.name, name)} {with_unit(float(value), unit)}"
        return f"{name} [{unit}]" if unit else name


def with_unit(value: float, unit: str) -> str:
    """A number with its unit; pascals with prefix."""
    if unit == "Pa":
        for factor, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
            if value >= factor:
                return f"{value / factor:.3g} {prefix}Pa"
    return f"{value:.3g} {unit}".strip()


def _pretty(unit: str) -> str:
    return unit.replace("^2", "²").replace("^3", "³").replace("^5", "⁵")
