"""Cavities inside of bodies, filled with a gas or a liquid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.kind import Kind
from supple.kinds.validators import NON_NEGATIVE, POSITIVE, BodyName, Integer, Name, OneOf
from supple.mesh.closed_surfaces import enclosed_voids, is_closed, signed_volumes
from supple.scene.body import PlacedBody
from supple.scene.loads.load import Rows, body_of, raise_for_rods
from supple.scene.loads.over_time import OverTime, OverTimeOf
from supple.scene.shell import Shell

AMOUNT = OverTimeOf(bounds=POSITIVE)
GAS_CONSTANT = 8.31446261815324  # [J/(mol K)], exact by definition


@dataclass(frozen=True, eq=False)
class Gas(Kind):
    """An ideal gas: p V^gamma is constant for a constant amount, and p V0 = n R T in the volume V0 at the start.

    Parameters
    ----------
    amount : n [mol]; a number, a `Curve`, or a function of time; None for the amount that has the pressure
        `ambient` at the start.
    temperature : T at the volume of the start [K].
    gamma : 1 for constant temperature; the ratio of specific heats, 1.4 for air, where no heat is exchanged.
    ambient : pressure outside of the body [Pa]; 0 in a vacuum.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    kind: ClassVar[str] = "gas"

    amount: Annotated[OverTime | None, AMOUNT] = None
    temperature: Annotated[float, POSITIVE] = 293.15
    gamma: Annotated[float, POSITIVE] = 1.0
    ambient: Annotated[float, NON_NEGATIVE] = 101325.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.amount is None and self.ambient == 0.0:
            raise SceneError("gas: ambient is 0, so that the cavity is empty at the start; give the amount")


@dataclass(frozen=True, eq=False)
class Cavity(Kind):
    """A closed inner surface of a body, and what is inside: exactly one of pressure, volume and gas.

    Parameters
    ----------
    body : name of the soft body, or of a shell whose surface is closed.
    pressure : difference to the pressure outside [Pa]; a number, a `Curve`, or a function of time.
    volume : of an incompressible fluid [m^3], above zero; a number, a `Curve`, or a function of time.
    gas : an ideal gas.
    void : which of the voids that the body encloses, from 0; the largest is the first.
    triangles : rows of `mesh.surface.triangles` instead: a closed surface about the cavity.
    name : under which reports have it; None for the name of the body.

    Raises
    ------
    SceneError : where a value is of the wrong kind or out of range.
    """

    kind: ClassVar[str] = "cavity"
    exactly_one: ClassVar[tuple[str, ...]] = ("pressure", "volume", "gas")

    body: Annotated[str, BodyName(soft=True, why="a cavity acts on soft bodies")]
    pressure: Annotated[OverTime | None, OverTimeOf()] = None
    volume: Annotated[OverTime | None, OverTimeOf(bounds=POSITIVE)] = None
    gas: Annotated[Gas | None, OneOf((Gas,), "a Gas")] = None
    void: Annotated[int, Integer()] = 0
    triangles: Annotated[ArrayLike | None, Rows("triangles", boxes=False)] = None
    name: Annotated[str | None, Name()] = None

    def __post_init__(self) -> None:
        if self.name is None:
            object.__setattr__(self, "name", self.body)
        super().__post_init__()
        if self.triangles is not None and self.void:
            raise SceneError(f"{self.label}: void and triangles given; give one of them")

    def check(self, bodies: Sequence[PlacedBody], others: Sequence[Cavity]) -> None:
        """Raise `SceneError` where it has no surface, or shares one with another cavity; see `surface`."""
        own = set(map(tuple, self.surface(bodies).tolist()))
        for other in others:
            if other.body == self.body and not own.isdisjoint(map(tuple, other.surface(bodies).tolist())):
                raise SceneError(f"{self.label}: {other.label} has the same triangles; give each surface one cavity")

    def surface(self, bodies: Sequence[PlacedBody]) -> NDArray[np.int32]:
        """(t, 3) the triangles about the cavity, of vertices of the body's mesh, facing into the cavity.

        Raises
        ------
        SceneError : where the body does not exist, or no such closed surface exists.
        """
        body = body_of(self.body, bodies, self.label)
        raise_for_rods(body, self.label, "give a body of tets or a closed shell")
        points, triangles = body.points, body.triangles
        two_sided = isinstance(body, Shell)
        if self.triangles is None:
            voids = [triangles[rows] for rows in enclosed_voids(points, triangles)]
            if two_sided:  # a piece of it may be open, and face outward
                turned = triangles[:, ::-1]
                voids += [turned[rows] for rows in enclosed_voids(points, turned)]
                closed = [one for one in voids if is_closed(one)]
                voids = sorted(closed, key=lambda one: float(signed_volumes(points, one).sum()))
            if self.void >= len(voids):
                raise SceneError(
                    f"{self.label}: void {self.void} does not exist; body {self.body!r} encloses {len(voids)}"
                    + ("" if voids else ": the surface of the cavity is open, or the mesh fills it")
                )
            return voids[self.void]
        rows = np.asarray(self.triangles)
        if rows.max() >= len(triangles):
            raise SceneError(f"{self.label}: triangle {rows.max()} does not exist; the surface has {len(triangles)}")
        chosen = triangles[rows]
        if not is_closed(chosen):
            raise SceneError(f"{self.label}: its triangles are not a closed surface; add those that are missing")
        if signed_volumes(points, chosen).sum() >= 0.0:
            if two_sided:
                return chosen[:, ::-1]
            raise SceneError(f"{self.label}: its triangles face outward; give an inner surface of body {self.body!r}")
        return chosen
