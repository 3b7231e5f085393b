"""View options of the page."""

from __future__ import annotations

from dataclasses import dataclass, field

from supple.results.view.fields import Range

SURFACES = ("skin", "wireframe", "tets", "exploded tets", "cut")
COLOR_BY_BODY = "body"


@dataclass(frozen=True)
class ViewOptions:
    """What is drawn, and how.

    Attributes
    ----------
    surface : one of SURFACES
    color_by : COLOR_BY_BODY, or the name of one of the fields
    ends : of the color scale
    explode : distance by which tets are exploded; cut_axis : "x", "y" or "z"; cut_place : from 0 to 1
    velocities, contacts, stitches : whether they are drawn
    dark : whether the background is dark
    """

    surface: str = "skin"
    color_by: str = COLOR_BY_BODY
    ends: Range = field(default_factory=Range)
    explode: float = 0.4
    cut_axis: str = "x"
    cut_place: float = 0.5
    velocities: bool = False
    contacts: bool = False
    stitches: bool = True
    dark: bool = False
