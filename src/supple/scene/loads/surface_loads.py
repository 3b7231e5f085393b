"""Loads on surfaces: tractions of fixed direction, and pressures that follow the surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from supple.kinds.validators import NON_NEGATIVE, BodyName, Name
from supple.scene.loads.load import TRIANGLES, OnSurface, Region
from supple.scene.loads.over_time import OverTime, OverTimeOf


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

    body: Annotated[str, BodyName()]
    traction: Annotated[OverTime, OverTimeOf((3,))]
    region: Annotated[Region, TRIANGLES] = None
    name: Annotated[str | None, Name()] = None


@dataclass(frozen=True, eq=False)
class Pressure(OnSurface):
    """A force per current area along the inward normal, which follows the surface.

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

    body: Annotated[str, BodyName(soft=True, why="pressure acts on soft ones; give a Traction")]
    pressure: Annotated[OverTime, OverTimeOf()]
    region: Annotated[Region, TRIANGLES] = None
    name: Annotated[str | None, Name()] = None


@dataclass(frozen=True, eq=False)
class Wind(OnSurface):
    """The drag of a flow on triangles: density/2 drag A |u| u of each triangle that faces the flow; of a shell, on both
    sides.

    u is the velocity of the flow against the triangle, and A the area of the triangle's projection along u. So a plate
    across the flow feels density/2 drag area |u|^2, whatever its tets, and a body that falls in still air reaches a
    terminal velocity. Triangles do not shelter each other, and have no lift.

    Parameters
    ----------
    body : name of the soft body.
    velocity : (3,) of the flow [m/s]; a vector, a `Curve`, or a function of time. Zero is still air.
    drag : coefficient of drag [-]: 1.28 of a flat plate, 0.47 of a sphere.
    density : of the flow [kg/m^3]; 1.2 of air, 1000 of water.
    region : None for the whole surface, an `InBox` that holds all three corners of a triangle at the start, or rows of
        `mesh.surface.triangles`.
    name : appears in messages.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    kind: ClassVar[str] = "wind"

    body: Annotated[str, BodyName(soft=True, why="wind acts on soft ones; give a Traction")]
    velocity: Annotated[OverTime, OverTimeOf((3,))]
    drag: Annotated[float, NON_NEGATIVE] = 1.0
    density: Annotated[float, NON_NEGATIVE] = 1.2
    region: Annotated[Region, TRIANGLES] = None
    name: Annotated[str | None, Name()] = None
