"""A slider for a value with a unit, and the value as text, which can be typed: "30 kPa"."""

from __future__ import annotations

import asyncio
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from supple.app.viewer.controls.controller import notify, sequential
from supple.app.viewer.protocol.quantities import WITH_PREFIX, typed, written
from supple.errors import CommandError

# The smallest power of ten of a slider whose left end is zero.
_LEAST_POWER = -12.0
# A browser sends every letter that is typed: a text counts when no other one follows within this time [s].
_TYPING = 0.8


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

    def value(self, at: float) -> float:
        """The value at a position."""
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
    """A slider, and below it its value as text.

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
        changed: Callable[[Any, float], object] = lambda client, value: None,
        visible: bool = True,
    ) -> None:
        self._name, self.scale, self._value, self._changed = label, scale, value, changed
        self._lock, self._removed = threading.RLock(), False
        self._typing: asyncio.TimerHandle | None = None
        self._who: Any = None  # types
        # There is little space below a slider: units that take no prefix are only in the text.
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
        self.text = gui.add_text("", written(value, scale.unit), hint=hint, visible=visible)
        self.handle.on_update(sequential(self._moved))
        self.text.on_update(sequential(self._typed))

    @property
    def value(self) -> float:
        """The value; a text that is being typed counts."""
        self._settle()
        return self._value

    def show(self, value: float) -> None:
        """Set slider and text, unless a visitor is typing."""
        with self._lock:
            if not self._removed and self._typing is None:
                self._value = value
                self.handle.value = self.scale.position(value)
                self._write()

    @property
    def visible(self) -> bool:
        """Whether the panel displays both."""
        return self.handle.visible

    @visible.setter
    def visible(self, visible: bool) -> None:
        self.handle.visible = self.text.visible = visible

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
            self._value = value = self.scale.value(self.handle.value)
            self._write()
        # Without the lock: what reacts has locks of its own.
        self._changed(event.client, value)

    def _typed(self, event: Any) -> None:
        if event.client is None:
            return
        with self._lock:
            if self._typing is not None:
                self._typing.cancel()
            self._typing, self._who = asyncio.get_running_loop().call_later(_TYPING, self._settle), event.client

    def _settle(self) -> None:
        """A text that was being typed is complete."""
        with self._lock:
            typing, self._typing = self._typing, None
            if typing is None or self._removed:
                return
            typing.cancel()
            try:
                value = self._value_of(str(self.text.value))
            except CommandError as error:
                notify(self._who, "Not done", str(error))
                value = None
            self.show(self._value if value is None else value)
        if value is not None:
            self._changed(self._who, value)

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
        text = written(self._value, self.scale.unit)
        if self.text.value != text:
            self.text.value = text
