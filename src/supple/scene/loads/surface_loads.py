"""Loads on surfaces: tractions of fixed direction, and pressures that follow the surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from supple.errors import SceneError
from supple.kinds.forms import Name
from supple.scene.body import PlacedBody
from supple.scene.loads.load import TRIANGLES, OnSurface, Region, body_of
from supple.scene.loads.over_time import OverTime, OverTimeOf
from supple.scene.rigid.rigid_body import RigidBody


@dataclass(frozen=True, eq=False)
class Traction(OnSurface):
    """A force per area at rest whose direction does not follow the deformation.

    Parameters
    ----------
    body : name of the body.
    traction : (3,) [N/m^2], a `Curve`, or a function of time.
    region : None for the whole surface, an `InBox` that holds all three corners of a triangle at the start, or rows of
        `mesh.surface.triangles`.
    name : appears in messages.

    Raises
    ------
    SceneError : where a value is of the wrong kind or not finite.
    """

    kind: ClassVar[str] = "traction"

    body: Annotated[str, Name()]
    traction: Annotated[OverTime, OverTimeOf((3,))]
    region: Annotated[Region, TRIANGLES] = None
    name: Annotated[str | None, Name()] = None


@dataclass(frozen=True, eq=False)
class Pressure(OnSurface):
    """A force per present area along the inward normal, which follows the surface.

    Parameters
    ----------
    body : name of the body.
    pressure : [Pa], positive where it pushes on the body; a number, a `Curve`, or a function of time.
    region, name : as of `Traction`.

    Raises
    ------
    SceneError : where a value is of the wrong kind or not finite.
    """

    kind: ClassVar[str] = "pressure"

    body: Annotated[str, Name()]
    pressure: Annotated[OverTime, OverTimeOf()]
    region: Annotated[Region, TRIANGLES] = None
    name: Annotated[str | None, Name()] = None

    def check(self, bodies: Sequence[PlacedBody]) -> None:
        super().check(bodies)
        if isinstance(body_of(self.body, bodies, self.label), RigidBody):
            raise SceneError(f"{self.label}: the body is rigid, and pressure acts on soft ones; give a Traction")
