"""Colors of bodies, how they reflect light, and what is behind them: for the page, films, pictures and glb alike."""

from __future__ import annotations

import colorsys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.scene.rows import BodyRows

Color = tuple[int, int, int]


@dataclass(frozen=True)
class Look:
    """A surface.

    Attributes
    ----------
    roughness, metallic : as of glTF [-]
    ambient, diffuse, specular, power : of the model of Phong, for films
    tint : what is mixed into the color of the body, and its share
    """

    roughness: float
    metallic: float
    ambient: float
    diffuse: float
    specular: float
    power: float
    tint: tuple[Color, float] = ((0, 0, 0), 0.0)

    def color(self, body: Color) -> Color:
        """The color of a body, from 0 to 255."""
        mixed, share = self.tint
        r, g, b = (round((1.0 - share) * own + share * other) for own, other in zip(body, mixed, strict=True))
        return r, g, b


LOOKS = {
    "rubber": Look(0.55, 0.0, 0.4, 0.72, 0.22, 18.0),
    "gummy": Look(0.18, 0.0, 0.48, 0.66, 0.6, 60.0),
    "foam": Look(0.95, 0.0, 0.55, 0.7, 0.0, 1.0, ((250, 244, 232), 0.3)),
    "steel": Look(0.3, 0.9, 0.5, 0.6, 0.9, 24.0, ((196, 205, 218), 0.88)),
}
STITCH_COLOR = (30, 30, 34)
OBSTACLE = Look(0.8, 0.0, 0.58, 0.62, 0.05, 10.0)

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


def drawn_as(body: BodyRows) -> tuple[Color, Look]:
    """The color (r, g, b) of a body, and how it reflects light."""
    look = LOOKS[body.body.drawn_look]
    return look.color(body_color(body.number)), look


@dataclass(frozen=True)
class Theme:
    """Colors of what is not part of the scene.

    Attributes
    ----------
    top, bottom : of the background; floor : of the disc on which bodies stand, which fades to the background
    obstacle : of what stands still; text : of legends in films
    """

    top: Color
    bottom: Color
    floor: Color
    obstacle: Color
    text: Color


# What the page's light makes of its own: a film does not light them.
BRIGHT = Theme((214, 224, 238), (238, 242, 247), (216, 218, 224), (196, 201, 210), (44, 50, 60))
DARK = Theme((20, 23, 29), (46, 51, 61), (64, 69, 79), (104, 112, 128), (226, 230, 236))


def theme(dark: bool) -> Theme:
    """The bright or the dark one."""
    return DARK if dark else BRIGHT


def background(dark: bool, rows: int = 256) -> NDArray[np.uint8]:
    """(rows, 2, 3) a picture that fades from top to bottom."""
    shown = theme(dark)
    share = np.linspace(0.0, 1.0, rows)[:, None, None]
    return np.round((1.0 - share) * shown.top + share * shown.bottom).astype(np.uint8).repeat(2, axis=1)


def floor_disc(dark: bool, cells: int) -> NDArray[np.uint8]:
    """(cells, cells, 4) the floor, which fades to the background outwards."""
    place = (np.arange(cells) + 0.5) / cells * 2.0 - 1.0
    away = np.hypot(place[:, None], place[None, :])
    fade = np.clip((away - 0.35) / 0.62, 0.0, 1.0)
    image = np.empty((cells, cells, 4), dtype=np.uint8)
    image[..., :3], image[..., 3] = theme(dark).floor, np.round(255.0 * (1.0 - fade**2 * (3.0 - 2.0 * fade)))
    return image
