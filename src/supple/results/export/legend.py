"""The legend of a color scale, drawn on pictures: its colors are those of the field, without light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.results.view.fields import Field, colors_of
from supple.results.view.look import Theme

_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""))


def legend(
    field: Field, ends: tuple[float, float], size: tuple[int, int], theme: Theme
) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """A picture (height, width, 3) of a size [pixels], and how opaque (height, width, 1) it is, from 0 to 1.

    A bar is at the right, with the name of the field above it and five values beside it.
    """
    from PIL import Image, ImageDraw, ImageFont

    width, height = size
    unit = min(width / 1280.0, height / 480.0)
    font = ImageFont.load_default(max(9.0, 17.0 * unit))
    low, high = ends
    factor, prefix = next((one for one in _PREFIXES if field.unit and max(abs(low), abs(high)) >= one[0]), (1.0, ""))
    title = f"{field.name} [{prefix}{field.unit}]" if field.unit else field.name
    tall, wide = int(0.5 * height), max(8, int(20 * unit))
    x, y = width - int(100 * unit), int(0.27 * height)
    mask = Image.new("L", size, 0)
    draw = ImageDraw.Draw(mask)
    draw.text((width - 18 * unit, y - 26 * unit), title, 255, font, anchor="rs")
    for share in np.linspace(0.0, 1.0, 5):
        place = y + (1.0 - share) * tall
        value = (low + share * (high - low)) / factor
        draw.text((x + wide + 9 * unit, place), f"{value:.3g}", 255, font, anchor="lm")
    image = np.empty((height, width, 3), dtype=np.uint8)
    image[:] = theme.text
    opaque = np.asarray(mask, dtype=np.float64)[..., None] / 255.0
    values = np.linspace(high, low, tall)
    image[y : y + tall, x : x + wide] = colors_of(field, values, ends)[:, None]
    opaque = opaque.copy()
    opaque[y : y + tall, x : x + wide] = 1.0
    return image, opaque
