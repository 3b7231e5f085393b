"""Forces on vertices, and springs that pull vertices to target positions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.scene.motion import Motion, check_motion
from supple.scene.selection import Selection, checked_selection, selected_vertices
from supple.scene.values import check_name, positive


@dataclass(frozen=True, eq=False)
class Force:
    """A dead load: a force whose direction does not follow the deformation.

    Parameters
    ----------
    body : name of the body.
    vertices : indices into the body's mesh, or an `InBox`.
    force : [N]; (3,) is the total, shared equally by the vertices; (k, 3) is one force for each of them; or a function
        of time [s] that returns either.
    name : appears in messages.

    Raises
    ------
    SceneError : where the force is not finite or has another shape.
    """

    body: str
    vertices: Selection
    force: ArrayLike | Callable[[float], ArrayLike]
    name: str | None = None

    def __post_init__(self) -> None:
        check_name(self.body, "force: body")
        if self.name is not None:
            check_name(self.name, "force")
        object.__setattr__(self, "vertices", checked_selection(self.vertices, self.label))
        if not callable(self.force):
            object.__setattr__(self, "force", self._checked(self.force, "force"))

    @property
    def label(self) -> str:
        """The name of this force in messages."""
        return f"force {self.name!r} on body {self.body!r}" if self.name else f"force on body {self.body!r}"

    def select(self, placed: NDArray[np.float64]) -> NDArray[np.int32]:
        """Vertex indices (k,) of the body, given its vertices placed in the world (n, 3)."""
        return selected_vertices(self.vertices, placed, self.label)

    def per_vertex(self, time: float, count: int) -> NDArray[np.float64]:
        """The force (count, 3) on each of the `count` selected vertices at `time` [N].

        Raises
        ------
        SceneError : where the number of forces is not that of vertices, or the function of time returns a wrong value.
        """
        given = self._checked(self.force(time), f"force({time:g})") if callable(self.force) else np.asarray(self.force)
        if given.ndim == 1:
            return np.broadcast_to(given / count, (count, 3))
        if len(given) != count:
            raise SceneError(f"{self.label}: force has {len(given)} rows for {count} vertices; they must agree")
        return given

    def _checked(self, value: ArrayLike, what: str) -> NDArray[np.float64]:
        try:
            array = np.array(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise SceneError(f"{self.label}: {what} is not an array of numbers") from None
        if array.shape != (3,) and (array.ndim != 2 or array.shape[1] != 3):
            raise SceneError(f"{self.label}: {what} has shape {array.shape}; give (3,) in total or (k, 3) per vertex")
        if not np.isfinite(array).all():
            raise SceneError(f"{self.label}: {what} is not finite")
        return array


@dataclass(frozen=True, eq=False)
class SoftTarget:
    """Springs of rest length zero from vertices to their positions at the start, or to where `motion` moves these.

    Parameters
    ----------
    body : name of the body.
    vertices : indices into the body's mesh, or an `InBox`.
    stiffness : of each vertex's spring [N/m].
    motion : None, `Keyframes`, or t -> displacement [m], (3,) for all or (k, 3) for each vertex.
    name : appears in messages.
    """

    body: str
    vertices: Selection
    stiffness: float
    motion: Motion = None
    name: str | None = None

    def __post_init__(self) -> None:
        check_name(self.body, "soft target: body")
        if self.name is not None:
            check_name(self.name, "soft target")
        check_motion(self.motion, self.label)
        object.__setattr__(self, "vertices", checked_selection(self.vertices, self.label))
        object.__setattr__(self, "stiffness", positive(self.stiffness, f"{self.label}: stiffness"))

    @property
    def label(self) -> str:
        """The name of this soft target in messages."""
        return f"soft target {self.name!r} of body {self.body!r}" if self.name else f"soft target of body {self.body!r}"

    def select(self, placed: NDArray[np.float64]) -> NDArray[np.int32]:
        """Vertex indices (k,) of the body, given its vertices placed in the world (n, 3)."""
        return selected_vertices(self.vertices, placed, self.label)
