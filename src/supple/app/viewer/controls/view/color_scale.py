"""The color scale: its legend above the picture, as HTML, and inputs for its ends."""

from __future__ import annotations

import html
from collections.abc import Callable
from typing import Any

from supple.app.viewer.controls.controller import sequential
from supple.app.viewer.protocol.quantities import written
from supple.results.view.fields import BINS, Field, Range, palette
from supple.results.view.layers.arrows import COLOR
from supple.results.view.stage import Stage


def bar_html(field: Field, ends: tuple[float, float] | None) -> str:
    """The legend: name, colors, and the values at both ends and in the middle with their unit."""
    title = f"<div>{html.escape(field.name)}</div>"
    if ends is None:
        return f"{title}<div>not known</div>"
    colors = ["rgb({},{},{})".format(*color) for color in palette(field)]
    stops = ",".join(f"{color} {100 * i / BINS:.2f}% {100 * (i + 1) / BINS:.2f}%" for i, color in enumerate(colors))
    low, high = ends
    numbers = "".join(f"<span>{written(value, field.unit)}</span>" for value in (low, 0.5 * (low + high), high))
    return (
        f'{title}<div class="bar" style="background:linear-gradient(to right,{stops})"></div>'
        f'<div class="numbers">{numbers}</div>'
    )


def arrows_html(full: float) -> str:
    """The legend of the arrows of forces: the force of one of half the size of the scene."""
    color = "rgb({},{},{})".format(*COLOR)
    arrow = f'<path d="M2 7H74M66 2L76 7L66 12" fill="none" stroke="{color}" stroke-width="2"/>'
    return (
        f'<svg viewBox="0 0 80 14" style="width:80px;display:block">{arrow}</svg>'
        f"<div>contact force, half the scene: {written(full, 'N')}</div>"
    )


_FIXED = "fixed"
_SHARES = {"98 % of the values": 0.98, "90 % of the values": 0.90, "all values": 1.0}
KINDS = (*_SHARES, _FIXED)


class ColorRange:
    """A choice between a share of the values and fixed ends, whose labels have the unit.

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
            gui.add_number(label, value, visible=False, hint=f"{which} end of the colors")
            for label, value, which in (("From", 0.0, "Lower"), ("To", 1.0, "Upper"))
        )
        for end in (self.low, self.high):
            end.precision = 6
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
            current, field = self._stage.color_range, self._stage.field
            if self.kind.value == _FIXED and current is not None and field is not None:
                self._fixed = current
                for end, name, value in zip((self.low, self.high), ("From", "To"), current, strict=True):
                    end.label, end.value = f"{name} [{field.unit}]" if field.unit else name, float(f"{value:.6g}")
            self._changed()

    def _typed(self, event: Any) -> None:
        # viser sends every digit: as long as a number is not complete, the last range stays.
        if event.client is not None and self.low.value < self.high.value:
            self._fixed = float(self.low.value), float(self.high.value)
            self._changed()
