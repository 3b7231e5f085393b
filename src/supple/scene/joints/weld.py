"""Welds: vertices of a soft body that are points of a rigid one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.kinds.validators import POSITIVE, BodyName, Name
from supple.numerics.geometry.triangle_tree import TriangleTree
from supple.scene.body import PlacedBody
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.selection import OnVertices, Selection, Vertices

_WHY = "a weld is of a soft body to a rigid one"


@dataclass(frozen=True, eq=False)
class Weld(OnVertices):
    """Vertices of a soft body that move with a rigid one as its points, from where the scene places them.

    Parameters
    ----------
    body : name of the soft body.
    rigid : name of the rigid body.
    vertices : indices into the soft body's mesh, or an `InBox`.
    max_distance : instead of `vertices`: all vertices of the soft body's surface that are no farther than this from the
        rigid body's surface where the scene places both [m].
    name : appears in messages, and in the forces of a report; a scene names unnamed welds by number.

    Raises
    ------
    SceneError : where a value is of the wrong kind, or both or none of `vertices` and `max_distance` are given.
    """

    kind: ClassVar[str] = "weld"

    body: Annotated[str, BodyName(soft=True, why=_WHY)]
    rigid: Annotated[str, BodyName(soft=False, why=_WHY)]
    vertices: Annotated[Selection | None, Vertices()] = None
    max_distance: Annotated[float | None, POSITIVE] = None
    name: Annotated[str | None, Name()] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.vertices is None) == (self.max_distance is None):
            raise SceneError(f"{self.label}: give the vertices by one of `vertices`, `box` and `max_distance`")

    def facts(self, scene: Any) -> str:
        count = int((scene.welding.weld == scene.welds.index(self)).sum())
        return f"{count} vertices of {self.body} are points of {self.rigid}"

    def chosen(self, soft: PlacedBody, rigid: RigidBody) -> NDArray[np.int32]:
        """The welded vertices (k,) of the soft body's mesh.

        Raises
        ------
        SceneError : where none exists.
        """
        placed = soft.place(soft.mesh.vertices)
        if self.max_distance is None:
            return self.select(placed)
        surface = np.unique(soft.mesh.surface.triangles).astype(np.int32)
        tree = TriangleTree.of(rigid.place(rigid.points), rigid.triangles)
        distances = tree.nearest(placed[surface])[1]
        near = surface[distances <= self.max_distance]
        if not len(near):
            raise SceneError(
                f"{self.label}: no vertex is within {self.max_distance:g} m of body {self.rigid!r}; the nearest is "
                f"{distances.min():.3g} m away: move the bodies, or give a larger max_distance"
            )
        return near
