"""Cavities inside of bodies, filled with a gas or a liquid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.mesh.voids import enclosed_voids, is_closed, signed_volumes
from supple.scene.actuators.gas import Gas
from supple.scene.body import PlacedBody
from supple.scene.loads.load import body_of, checked_region
from supple.scene.loads.over_time import OverTime, checked_magnitude, checked_over_time
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.values import check_name


@dataclass(frozen=True, eq=False)
class Cavity:
    """A closed inner surface of a body, and what is inside: exactly one of pressure, volume and gas.

    Parameters
    ----------
    body : name of the soft body.
    pressure : difference to the pressure outside [Pa]; a number, a `Curve`, or a function of time [s].
    volume : of an incompressible fluid [m^3], above zero; a number, a `Curve`, or a function of time [s].
    gas : an ideal gas.
    void : which of the voids that the body encloses, from 0; the largest is the first.
    triangles : rows of `mesh.surface.triangles` instead: a closed surface about the cavity.
    name : under which reports have it; None for the name of the body.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    body: str
    pressure: OverTime | None = None
    volume: OverTime | None = None
    gas: Gas | None = None
    void: int = 0
    triangles: ArrayLike | None = None
    name: str | None = None

    def __post_init__(self) -> None:
        check_name(self.body, "cavity: body")
        if self.name is None:
            object.__setattr__(self, "name", self.body)
        check_name(self.name, "cavity")
        given = [key for key in ("pressure", "volume", "gas") if getattr(self, key) is not None]
        if len(given) != 1:
            found = " and ".join(given) or "none of them"
            raise SceneError(f"{self.label}: {found} given; give exactly one of pressure, volume and gas")
        if self.pressure is not None:
            object.__setattr__(self, "pressure", checked_over_time(self.pressure, f"{self.label}: pressure", ()))
        if self.volume is not None:
            object.__setattr__(self, "volume", checked_magnitude(self.volume, f"{self.label}: volume", zero=False))
        if self.gas is not None and not isinstance(self.gas, Gas):
            raise SceneError(f"{self.label}: gas is {self.gas!r}; give a Gas")
        if isinstance(self.void, bool) or not isinstance(self.void, (int, np.integer)) or self.void < 0:
            raise SceneError(f"{self.label}: void is {self.void!r}; give a whole number from 0")
        if self.triangles is not None:
            if self.void:
                raise SceneError(f"{self.label}: void and triangles given; give one of them")
            object.__setattr__(self, "triangles", checked_region(self.triangles, self.label))

    @property
    def label(self) -> str:
        """The name of this cavity in messages."""
        return f"cavity {self.name!r}"

    @property
    def bodies(self) -> tuple[str, ...]:
        """The names of the bodies that it acts on."""
        return (self.body,)

    def check(self, bodies: Sequence[PlacedBody], others: Sequence[Cavity]) -> None:
        """Raise `SceneError` where it has no surface of its own; see `surface`."""
        mine = set(map(tuple, self.surface(bodies).tolist()))
        for other in others:
            if other.body == self.body and not mine.isdisjoint(map(tuple, other.surface(bodies).tolist())):
                raise SceneError(f"{self.label}: {other.label} has the same triangles; give each surface one cavity")

    def surface(self, bodies: Sequence[PlacedBody]) -> NDArray[np.int32]:
        """(t, 3) the triangles about the cavity, of vertices of the body's mesh, facing into the cavity.

        Raises
        ------
        SceneError : where the body does not exist or is rigid, or there is no such closed surface.
        """
        body = body_of(self.body, bodies, self.label)
        if isinstance(body, RigidBody):
            raise SceneError(f"{self.label}: body {self.body!r} is rigid; a cavity acts on soft bodies")
        points, triangles = body.points, body.triangles
        if self.triangles is None:
            voids = enclosed_voids(points, triangles)
            if self.void >= len(voids):
                raise SceneError(
                    f"{self.label}: void {self.void} does not exist; body {self.body!r} encloses {len(voids)}"
                    + ("" if voids else ": the surface of the cavity is open, or the mesh fills it")
                )
            return triangles[voids[self.void]]
        rows = np.asarray(self.triangles)
        if rows.max() >= len(triangles):
            raise SceneError(f"{self.label}: triangle {rows.max()} does not exist; the surface has {len(triangles)}")
        chosen = triangles[rows]
        if not is_closed(chosen):
            raise SceneError(f"{self.label}: its triangles are not a closed surface; add those that are missing")
        if signed_volumes(points, chosen).sum() >= 0.0:
            raise SceneError(f"{self.label}: its triangles face outward; give an inner surface of body {self.body!r}")
        return chosen
