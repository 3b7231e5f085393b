"""The legends above the picture, as HTML."""

from __future__ import annotations

import html

from supple.app.viewer.protocol.quantities import written
from supple.results.view.fields import BINS, Field, palette
from supple.results.view.layers.arrows import COLOR


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
