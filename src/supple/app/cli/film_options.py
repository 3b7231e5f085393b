"""The options of `supple picture` and `supple export` that say how something is drawn; see `Film`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from cyclopts import Parameter

from supple.app.cli.arguments import Pixels, Vector


@Parameter(name="*")
@dataclass(frozen=True)
class PictureOptions:
    """How a picture is drawn."""

    size: Annotated[
        Pixels, Parameter(negative="", help="Width and height in pixels: 1280x720 without it, of a gif 640x360.")
    ] = None
    camera: Annotated[
        str | None,
        Parameter(help="fit (the whole motion, without it), follow (the bodies) or orbit (a film turns around them)."),
    ] = None
    view: Annotated[str | None, Parameter(help="From where: corner (without it), front, side, top or back.")] = None
    eye: Annotated[Vector, Parameter(help="Place of the camera in metres, as 0.5 0.3 -1; needs --target.")] = None
    target: Annotated[Vector, Parameter(help="What the camera at --eye looks at; orbit turns around it.")] = None
    surface: Annotated[
        str | None, Parameter(help="Of bodies: skin (without it), or tets, which is the surface that is simulated.")
    ] = None
    color: Annotated[
        str | None, Parameter(help="body (without it), or a field with a legend: J, von_mises or energy.")
    ] = None
    range: Annotated[
        tuple[float, float] | None, Parameter(help="Ends of the color scale of a field, as 0 2e4, in its unit.")
    ] = None
    connections: Annotated[bool | None, Parameter(help="Stitches and joints as lines: yes without it.")] = None
    shadows: Annotated[bool | None, Parameter(help="Soft shadows: yes without it.")] = None
    dark: Annotated[bool | None, Parameter(negative="", help="A dark background.")] = None
    render: Annotated[
        bool | None,
        Parameter(negative="", help="Trace light: translucent bodies, soft shadows, depth; slow (extra: render)."),
    ] = None
    samples: Annotated[
        int | None, Parameter(help="Paths of light of each pixel, with --render: 64 without it; more have less grain.")
    ] = None

    def given(self) -> dict[str, Any]:
        """What was given, for `export`."""
        return {key: value for key, value in vars(self).items() if value is not None}


@Parameter(name="*")
@dataclass(frozen=True)
class FilmOptions(PictureOptions):
    """How a film is drawn."""

    rate: Annotated[float | None, Parameter(help="Frames per second of a film: 30 without it, of a gif 20.")] = None
    slow: Annotated[
        float | None, Parameter(help="Slow motion: 4 makes a film four times as long as the simulation.")
    ] = None
