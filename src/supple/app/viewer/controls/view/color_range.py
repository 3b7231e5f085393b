"""Inputs for the ends of the color scale."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from supple.app.viewer.controls.controller import sequential
from supple.app.viewer.protocol.quantities import typed, written
from supple.errors import CommandError
from supple.results.view.fields import Range
from supple.results.view.stage import Stage

_FIXED = "fixed"
_SHARES = {"98 % of the values": 0.98, "90 % of the values": 0.90, "all values": 1.0}
KINDS = (*_SHARES, _FIXED)


class ColorRange:
    """A choice between a share of the values and fixed ends, which are typed with their unit.

    Parameters
    ----------
    changed : called after every change
    """

    def __init__(self, gui: Any, stage: Stage, changed: Callable[[], object]) -> None:
        self._stage, self._changed = stage, changed
        self._fixed: tuple[float, float] = (0.0, 1.0)
        self.kind = gui.add_dropdown(
            "Range", KINDS, initial_value=KINDS[0], visible=False, hint="Which values the colors cover"
        )
        self.low, self.high = (
            gui.add_text(label, "", visible=False, hint=f"{which} end of the colors, for example 20 kPa")
            for label, which in (("From", "Lower"), ("To", "Upper"))
        )
        self.kind.on_update(sequential(self._chosen))
        for end in (self.low, self.high):
            end.on_update(sequential(self._typed))

    @property
    def ends(self) -> Range:
        """The choice."""
        kind = self.kind.value
        return Range(fixed=self._fixed) if kind == _FIXED else Range(_SHARES[kind])

    def show(self) -> None:
        """Display the inputs that the field of the stage needs."""
        self.kind.visible = self._stage.field is not None
        self.low.visible = self.high.visible = self.kind.visible and self.kind.value == _FIXED

    def _chosen(self, event: Any) -> None:
        if event.client is not None:
            present, field = self._stage.color_range, self._stage.field
            if self.kind.value == _FIXED and present is not None and field is not None:
                self._fixed = present
                self.low.value, self.high.value = (written(end, field.unit) for end in present)
            self._changed()

    def _typed(self, event: Any) -> None:
        field = self._stage.field
        if event.client is None or field is None:
            return
        try:
            low, high = (typed(str(end.value), field.unit, field.name) for end in (self.low, self.high))
            if not low < high:
                raise CommandError("the upper end of the colors must be above the lower one")
        except CommandError:
            return  # viser sends every letter: the text is not complete yet
        self._fixed = low, high
        self._changed()
