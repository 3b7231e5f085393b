"""What joints hold and measure, as data: solvers, recordings, checks and pages read it, and none knows a kind of joint.

A direction on one of the two sides is named by the side and the number of the joint's axis, such as "first.0"; "apart"
is the point of the first side minus that of the second. A function of such vectors a, b, d and f has the form

    product   a . b                                    a length with "apart", otherwise a cosine; zero is a condition
    cosine    a . b, of which the coordinate is the angle arccos(a . b)
    angle     atan2(a . d, a . b), over all turns
    twist     atan2(a . d - f . b, a . b + f . d), within half a turn
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

FREE = (-np.inf, np.inf)
FORMS = ("angle", "product", "cosine", "twist")


class Function(NamedTuple):
    """One function of vectors.

    Attributes
    ----------
    form : see the module; vectors : their names, two for a product or cosine, three for an angle, four for a twist
    limits : of its coordinate [rad] or [m]; infinite where there are none
    vanishes : whether it is a condition and has to be zero
    """

    form: str
    vectors: tuple[str, ...]
    limits: tuple[float, float] = FREE
    vanishes: bool = False

    @property
    def is_length(self) -> bool:
        """Whether its value is in metres, not in radians."""
        return "apart" in self.vectors


@dataclass(frozen=True)
class Conditions:
    """What a joint holds and measures.

    Attributes
    ----------
    together : whether the points of both sides are the same
    parallel : numbers of the axes that have the same direction on both sides
    functions : further conditions and measures; the first that does not vanish is the joint's coordinate
    lines : the directions that pictures show as long lines
    """

    together: bool = True
    parallel: tuple[int, ...] = ()
    functions: tuple[Function, ...] = ()
    lines: tuple[str, ...] = ()

    @property
    def coordinate(self) -> Function | None:
        """The function that gives the joint's coordinate."""
        return next((one for one in self.functions if not one.vanishes), None)
