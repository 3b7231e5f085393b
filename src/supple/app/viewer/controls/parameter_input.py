"""Inputs of the panel for parameters of the simulation."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

from supple.app.viewer.controls.controller import Controller, sequential
from supple.app.viewer.controls.number_input import NumberInput
from supple.app.viewer.protocol.commands import SetParameter
from supple.app.viewer.protocol.parameters import PARAMETERS, Parameter, Value


class ParameterInput:
    """A number or check box for one parameter.

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
        parameter = self.parameter
        label = parameter.label[:1].upper() + parameter.label[1:]
        if parameter.kind is bool:
            self.number = None
            self.handle = gui.add_checkbox(label, initial_value=bool(value), hint=parameter.hint)
            self.handle.on_update(sequential(lambda event: self._changed(event.client, bool(self.handle.value))))
            return
        self.number = NumberInput(
            gui,
            label,
            value,
            parameter.low,
            parameter.high,
            unit=parameter.unit,
            factor=parameter.factor,
            whole=parameter.kind is int,
            hint=parameter.hint,
            changed=self._changed,
        )
        self.handle = self.number.handle

    def show(self, value: Value, applied: int) -> None:
        """Set the input to the value of the simulation, unless the value of a visitor is pending.

        Parameters
        ----------
        applied : number of the newest command that the simulation has executed
        """
        if value != self.value and not self._pending.is_pending(applied):
            self.value = value
            if self.number is None:
                self.handle.value = bool(value)
            else:
                self.number.show(float(value))

    def remove(self) -> None:
        """Remove it from the panel."""
        self._removed = True
        (self.number or self.handle).remove()

    def _changed(self, client: Any, value: Value) -> None:
        if client is None:
            return
        with self._controller.lock:
            if self._removed or value == self.value:
                return
            self.value = value
            # Within the lock: otherwise `show` could set an old value between the two.
            name, whose = self.parameter.name, self._whose()
            self._pending.requested(self._controller.send(client, lambda: SetParameter(name, value, whose)))


# An input of a visitor is kept for this time, even after the simulation has executed its command [s], because a visitor
# who types a number continues to type.
_KEEP_SECONDS = 1.0
# A dropped command is never executed: its value is kept for this time [s].
_LONGEST = 60.0


class PendingValue:
    """Tells whether an input keeps the value of a visitor instead of the value of the simulation.

    During a long step the snapshots still contain the old value.
    """

    def __init__(self) -> None:
        self._changed = -math.inf
        self._number = 0

    def requested(self, number: int) -> None:
        """Store the number of the command that a visitor has sent."""
        self._changed, self._number = time.monotonic(), number

    def is_pending(self, applied: int) -> bool:
        """Whether the value is kept, where the simulation has executed the commands up to `applied`."""
        since = time.monotonic() - self._changed
        return since < _KEEP_SECONDS or (applied < self._number and since < _LONGEST)
