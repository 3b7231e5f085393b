"""A number with its unit in the label."""

from __future__ import annotations

import asyncio
import math
import threading
from collections.abc import Callable
from typing import Any

from supple.app.viewer.controls.controller import notify, sequential

# A browser sends every digit that is typed: a number counts when no other one follows within this time [s].
_TYPING = 0.8
_DIGITS = 6


class NumberInput:
    """An input of the panel for one number.

    Parameters
    ----------
    gui : of viser; label : without the unit; value : at first; low, high : both are allowed
    unit : of what is displayed, "" where it has none; factor : how many of the SI unit it is
    whole : whether the values are integers
    hint : what it does; changed : called with a visitor and the value, in order
    """

    def __init__(
        self,
        gui: Any,
        label: str,
        value: float,
        low: float,
        high: float,
        *,
        hint: str,
        unit: str = "",
        factor: float = 1.0,
        whole: bool = False,
        changed: Callable[[Any, float], object] = lambda client, value: None,
    ) -> None:
        self._label, self._low, self._high, self._factor, self._whole = label, low, high, factor, whole
        self._value, self._changed = value, changed
        self._lock, self._removed = threading.RLock(), False
        self._typing: asyncio.TimerHandle | None = None
        shown = self._shown(value)
        self.handle = gui.add_number(
            f"{label} [{unit}]" if unit else label,
            shown,
            min=min(low / factor, shown),
            max=max(high / factor, shown),
            step=1 if whole else 10.0 ** math.floor(math.log10(abs(shown) / 10.0 or 0.1)),
            hint=hint,
        )
        self.handle.precision = 0 if whole else _DIGITS
        self.handle.on_update(sequential(self._typed))

    @property
    def value(self) -> float:
        """The value in SI units; a number that is being typed counts where it is allowed."""
        with self._lock:
            typed = self._number()
            return typed if self._low <= typed <= self._high else self._value

    def show(self, value: float) -> None:
        """Set the input, unless a visitor is typing."""
        with self._lock:
            if not self._removed and self._typing is None:
                self._value = value
                self.handle.value = self._shown(value)

    def remove(self) -> None:
        """Remove it from the panel."""
        with self._lock:
            self._removed = True
            self.handle.remove()

    def _shown(self, value: float) -> float:
        return int(value) if self._whole else float(f"{value / self._factor:.{_DIGITS}g}")

    def _number(self) -> float:
        """What the input displays, in SI units; the exact value where that is displayed."""
        shown = float(self.handle.value)
        if shown == self._shown(self._value):
            return self._value
        if not math.isfinite(shown):
            return math.nan
        return round(shown) if self._whole else float(f"{shown * self._factor:.15g}")

    def _typed(self, event: Any) -> None:
        if event.client is None:
            return
        with self._lock:
            if self._typing is not None:
                self._typing.cancel()
            self._typing = asyncio.get_running_loop().call_later(_TYPING, self._settle, event.client)

    def _settle(self, client: Any) -> None:
        """No other digit has followed."""
        with self._lock:
            self._typing = None
            if self._removed:
                return
            value = self._number()
            if not self._low <= value <= self._high:
                ends = f"{self._low / self._factor:g} to {self._high / self._factor:g}"
                notify(client, "Rejected", f"{self.handle.label} is {self.handle.value:g}; it must be from {ends}")
                self.show(self._value)
                return
            self.show(value)
        # Without the lock: what reacts has locks of its own.
        self._changed(client, value)
