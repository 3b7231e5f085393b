"""Colors of bodies and obstacles."""

from __future__ import annotations

import colorsys

# Colors that can also be distinguished with color blindness (after Okabe and Ito, brightened).
BODY_COLORS = (
    (230, 92, 60),
    (64, 156, 225),
    (245, 179, 36),
    (52, 172, 120),
    (206, 112, 178),
    (120, 200, 235),
    (160, 120, 80),
)


def body_color(number: int) -> tuple[int, int, int]:
    """The color (r, g, b) of the body at a place among all, from 0 to 255. The first 64 have different ones."""
    if number < len(BODY_COLORS):
        return BODY_COLORS[number]
    # Hues in steps of the golden section, in turns lighter and darker; none as strong as a signal.
    hue = (0.86 + 0.618034 * number) % 1.0
    r, g, b = colorsys.hls_to_rgb(hue, (0.58, 0.44, 0.7)[number % 3], (0.55, 0.7)[number % 2])
    return round(255 * r), round(255 * g), round(255 * b)
