"""A slider for a value with a unit, which is also displayed as text, and can be typed: "30 kPa"."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from supple.app.viewer.controls.controller import notify, sequential
from supple.app.viewer.protocol.quantities import WITH_PREFIX, typed, written
from supple.app.viewer.server.browser_values import number
from supple.errors import CommandError

# The smallest power of ten of a slider whose left end is zero.
_LEAST_POWER = -12.0


@dataclass(frozen=True)
class Scale:
    """The values of a slider.

    Attributes
    ----------
    low, high : ends of the slider; least, most : what can be typed
    unit : "" where the values have none
    logarithmic : whether the positions are powers of ten (a lowest value of zero is the left end)
    whole : whether the values are integers
    """

    low: float
    high: float
    least: float
    most: float
    unit: str = ""
    logarithmic: bool = False
    whole: bool = False

    def position(self, value: float) -> float:
        """The position of a value, at most at the ends."""
        value = min(max(value, self.low), self.high)
        if not self.logarithmic:
            return int(value) if self.whole else value
        return max(_LEAST_POWER, math.log10(value)) if value > 0.0 else _LEAST_POWER

    def value(self, position: object) -> float:
        """The value at a position, from the browser."""
        left, right = self.position(self.low), self.position(self.high)
        at = number(position, left, right)
        if not self.logarithmic:
            return round(at) if self.whole else at
        if self.low == 0.0 and at <= _LEAST_POWER:
            return 0.0
        return min(max(10.0**at, self.least), self.most)

    @property
    def step(self) -> float:
        """Of the positions."""
        if self.whole:
            return 1
        left, right = self.position(self.low), self.position(self.high)
        return 0.05 if self.logarithmic else 10.0 ** round(math.log10((right - left) / 200.0))


class UnitSlider:
    """A slider, and its value as text, which `server/page/page.js` draws in place of the slider's number.

    Parameters
    ----------
    gui : of viser; label : of the slider; scale : its values; value : at first
    hint : what it does; changed : called with a visitor and the value, in order
    """

    def __init__(
        self,
        gui: Any,
        label: str,
        scale: Scale,
        value: float,
        *,
        hint: str,
        changed: Callable[[Any, float], object],
        visible: bool = True,
    ) -> None:
        self._name, self.scale, self.value, self._changed = label, scale, value, changed
        self._lock, self._removed = threading.RLock(), False
        # There is little space below a slider: units that take no prefix are only beside it.
        unit = scale.unit if scale.unit in WITH_PREFIX else ""
        ends = tuple(
            (
                scale.position(end),
                f"{end:.0e}".replace("e+0", "e") if end >= 1e5 and not unit else written(end, unit, 3),
            )
            for end in (scale.low, scale.high)
        )
        self.handle = gui.add_slider(
            label,
            scale.position(scale.low),
            scale.position(scale.high),
            scale.step,
            initial_value=scale.position(value),
            marks=ends,
            hint=hint,
            visible=visible,
        )
        self.text = gui.add_text(f"beside {self.handle._impl.uuid}", written(value, scale.unit), visible=False)
        self.handle.on_update(sequential(self._moved))
        self.text.on_update(sequential(self._typed))

    def show(self, value: float) -> None:
        """Set slider and text."""
        with self._lock:
            if not self._removed:
                self.value = value
                self.handle.value = self.scale.position(value)
                self._write()

    def remove(self) -> None:
        """Remove both from the panel."""
        with self._lock:
            self._removed = True
            self.text.remove()
            self.handle.remove()

    def _moved(self, event: Any) -> None:
        if event.client is None:
            return
        with self._lock:
            if self._removed:
                return
            self.value = value = self.scale.value(self.handle.value)
            self._write()
        # Without the lock: what reacts has locks of its own.
        self._changed(event.client, value)

    def _typed(self, event: Any) -> None:
        if event.client is None:
            return
        try:
            value = self._value_of(str(self.text.value))
        except CommandError as error:
            notify(event.client, "Not done", str(error))
            self.show(self.value)
        else:
            self.show(value)
            self._changed(event.client, value)

    def _value_of(self, text: str) -> float:
        scale = self.scale
        value = typed(text, scale.unit, self._name)
        if not scale.least <= value <= scale.most:
            ends = " to ".join(written(end, scale.unit) for end in (scale.least, scale.most))
            raise CommandError(f"{self._name} is {written(value, scale.unit)}; it must be from {ends}")
        if scale.whole and value != int(value):
            raise CommandError(f"{self._name} is {value:g}; give a whole number")
        return int(value) if scale.whole else value

    def _write(self) -> None:
        text = written(self.value, self.scale.unit)
        if self.text.value != text:
            self.text.value = text
