"""How films and pictures of a recording are drawn."""

from __future__ import annotations

from dataclasses import dataclass

from supple.errors import OutputError
from supple.results.view.camera import PRESETS
from supple.results.view.fields import FIELDS
from supple.results.view.options import COLOR_BY_BODY

CAMERAS = ("fit", "follow", "orbit")
COLORS = {field.key: field for field in FIELDS.values()}
# Of the sides [pixels]: encoders of H.264 take no more than the largest, and no odd ones.
_LEAST, _MOST = 64, 4096


@dataclass(frozen=True)
class Film:
    """How a film, or a picture, is drawn. Its look is that of the page.

    Parameters
    ----------
    size : width and height [pixels], even
    rate : frames per second; the speed is that of the simulation, divided by `slow`
    slow : slow motion: how much longer the film is than the simulation, as a ratio
    camera : "fit" shows the whole motion, "follow" moves with the bodies, "orbit" turns once around them
    view : from where: "corner", "front", "side", "top" or "back"
    color : "body", or a field of the tets: "J", "von_mises" or "energy"
    shadows : whether bodies and obstacles cast soft shadows on floors
    time : of a picture [s]; None: the end

    Raises
    ------
    OutputError : where a value is unusable.
    """

    size: tuple[int, int] = (1280, 720)
    rate: float = 30.0
    slow: float = 1.0
    camera: str = "fit"
    view: str = "corner"
    color: str = COLOR_BY_BODY
    shadows: bool = True
    time: float | None = None

    def __post_init__(self) -> None:
        for key, names in (("camera", CAMERAS), ("view", PRESETS), ("color", (COLOR_BY_BODY, *COLORS))):
            if getattr(self, key) not in names:
                raise OutputError(f"export: {key} is {getattr(self, key)!r}; give one of {', '.join(names)}")
        object.__setattr__(self, "size", tuple(self.size))
        if len(self.size) != 2 or not all(
            isinstance(n, int) and _LEAST <= n <= _MOST and n % 2 == 0 for n in self.size
        ):
            raise OutputError(f"export: size is {self.size!r}; give even pixels from {_LEAST} to {_MOST}, as 1280x720")
        for key, most in (("rate", 240.0), ("slow", 1e4)):
            value = getattr(self, key)
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0.0 < value <= most:
                raise OutputError(f"export: {key} is {value!r}; give a number above zero, at most {most:g}")
        if self.time is not None and not isinstance(self.time, (int, float)):
            raise OutputError(f"export: time is {self.time!r}; give seconds")
