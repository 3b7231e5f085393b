"""Forces on vertices, and springs that pull vertices to target positions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.checks import finite_vector, float_array
from supple.kinds.validators import POSITIVE, BodyName, Name, Validator
from supple.scene.motion import Motion, MotionValidator
from supple.scene.selection import OnVertices, Selection, Vertices


@dataclass(frozen=True)
class ForceValidator(Validator):
    """(3,) or (k, 3), or a function of time; a scene file has one vector."""

    def checked(self, value: Any, what: str) -> Any:
        return value if callable(value) else checked_force(value, what)


def checked_force(value: ArrayLike, what: str) -> NDArray[np.float64]:
    """A force [N]: (3,), or (k, 3).

    Raises
    ------
    SceneError : where it has another shape, or is not finite.
    """
    array = float_array(value, what)
    if array.shape != (3,) and (array.ndim != 2 or array.shape[1] != 3):
        raise SceneError(f"{what} has shape {array.shape}; give (3,) in total or (k, 3) per vertex")
    if not np.isfinite(array).all():
        raise SceneError(f"{what} is not finite")
    return array


@dataclass(frozen=True, eq=False)
class Force(OnVertices):
    """A dead load: a force whose direction does not follow the deformation.

    Parameters
    ----------
    body : name of the body.
    vertices : indices into the body's mesh, or an `InBox`.
    force : [N]; (3,) is the total, shared equally by the vertices; (k, 3) is one force for each of them; or a function
        of time [s] that returns either, at all times the same.
    name : appears in messages.

    Raises
    ------
    SceneError : where the force is not finite or has another shape.
    """

    kind: ClassVar[str] = "force"
    joint: ClassVar[str] = "on"

    body: Annotated[str, BodyName()]
    vertices: Annotated[Selection, Vertices()]
    force: Annotated[ArrayLike | Callable[[float], ArrayLike], ForceValidator()]
    name: Annotated[str | None, Name()] = None

    @property
    def is_total(self) -> bool:
        """Whether one vector is given, which the vertices share."""
        return self._given(0.0).ndim == 1

    def total(self, time: float) -> NDArray[np.float64]:
        """That vector (3,) at `time` [N].

        Raises
        ------
        SceneError : where the function of time returns a wrong value.
        """
        given = self._given(time)
        if given.ndim != 1:
            raise SceneError(f"{self.label}: force({time:g}) has shape {given.shape}; at the time 0 it is one vector")
        return given

    def per_vertex(self, time: float, count: int) -> NDArray[np.float64]:
        """The force (count, 3) on each of the `count` selected vertices at `time` [N].

        Raises
        ------
        SceneError : where the number of forces is not that of vertices, or the function of time returns a wrong value.
        """
        given = self._given(time)
        if given.ndim == 1:
            return np.broadcast_to(given / count, (count, 3))
        if len(given) != count:
            raise SceneError(f"{self.label}: force has {len(given)} rows for {count} vertices; they must agree")
        return given

    def _given(self, time: float) -> NDArray[np.float64]:
        if callable(self.force):
            return checked_force(self.force(time), f"{self.label}: force({time:g})")
        return np.asarray(self.force)


@dataclass(frozen=True)
class AlongAxes(Validator):
    """A number above zero, or three along x, y and z, zero or more, not all of them zero."""

    def checked(self, value: Any, what: str) -> float | NDArray[np.float64]:
        if np.ndim(value) == 0:
            return POSITIVE.checked(value, what)
        given = finite_vector(value, what)
        if (given < 0.0).any() or not given.any():
            raise SceneError(f"{what} is {given.tolist()}; no number may be below zero, and one must be above")
        return given


_PULLED = BodyName(soft=True, why="soft targets pull soft bodies; move a rigid one with a Pin or a Force")


@dataclass(frozen=True, eq=False)
class SoftTarget(OnVertices):
    """Springs of rest length zero from vertices to their positions at the start, or to where `motion` moves these.

    Parameters
    ----------
    body : name of the body.
    vertices : indices into the body's mesh, or an `InBox`.
    stiffness : of each vertex's spring [N/m]; (3,) of springs along x, y and z, zero where it moves freely: (0, 0, 1e9)
        is a roller, or a plane of symmetry.
    motion : None, `Keyframes`, or t -> displacement [m], (3,) for all or (k, 3) for each vertex.
    name : appears in messages.

    Raises
    ------
    SceneError : where a value is of the wrong kind, not finite or out of range; the text names the body.
    """

    kind: ClassVar[str] = "soft_target"

    body: Annotated[str, _PULLED]
    vertices: Annotated[Selection, Vertices()]
    stiffness: Annotated[float | ArrayLike, AlongAxes()]
    motion: Annotated[Motion, MotionValidator()] = None
    name: Annotated[str | None, Name()] = None
