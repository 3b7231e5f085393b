"""The data that the page draws, of a live simulation or of a recording.

A `Model` contains what no frame changes; a `RenderFrame` is one frame. What draws them uses only these
two, neither engine nor file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.laws import TetLaws
from supple.materials.laws.internal import NEVER_FLOWED
from supple.numerics.deformation import deformation_gradients
from supple.results.view.bounds import View
from supple.results.view.skin_contact import beyond_tets
from supple.scene.joints.placed import PlacedJoint
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.rows import BodyRows
from supple.scene.stitches.measures import StitchEnds


@dataclass(frozen=True, eq=False)
class Model:
    """All data that do not change from frame to frame.

    Attributes
    ----------
    bodies : with their rows of the arrays
    obstacles : at time 0
    view : bounds of the motion, and the up direction
    stitches : of all kinds
    joints : of rigid bodies
    """

    bodies: Sequence[BodyRows]
    obstacles: Sequence[Obstacle]
    view: View
    stitches: StitchEnds
    joints: tuple[PlacedJoint, ...] = ()

    @cached_property
    def rest_positions(self) -> NDArray[np.float64]:
        """(n, 3) vertices of all bodies [m]."""
        return np.concatenate([part.body.mesh.vertices for part in self.bodies])

    @cached_property
    def tets(self) -> NDArray[np.int32]:
        """(m, 4) rows of them."""
        tets = [part.body.mesh.tets + part.vertices.start for part in self.bodies]
        return np.concatenate(tets).astype(np.int32, copy=False)

    @cached_property
    def beyond_tets(self) -> dict[str, tuple[NDArray[np.bool_], float]]:
        """By body: which vertices of a skin that nothing touches are outside of tets, and how far at most [m]."""
        return {
            body.name: beyond_tets(body.skin, self.rest_positions[body.vertices])
            for body in self.bodies
            if body.skin is not None and not body.body.touches_with_skin and body.skin.corners.shape[1] == 4
        }

    @cached_property
    def rest_shape_inverse(self) -> NDArray[np.float64]:
        """(m, 3, 3) Dm^-1 of every tet [1/m]."""
        corners = self.rest_positions[self.tets]
        return np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)).astype(np.float64, copy=False)


@dataclass(frozen=True, eq=False)
class RenderFrame:
    """One frame.

    Attributes
    ----------
    model : its constant data; time : [s]
    positions : (n, 3) [m]
    poses : (obstacles, 3, 4) rotation and translation of each obstacle since time 0
    pinned : (p,) vertices that are pinned
    tet_values : values of tets (m,) that the simulation sent, by the key of their field
    internal : (k, 11) internal variables of a recorded frame, see `State`
    broken_stitches : (b,) numbers of the pairs of stitches that have broken
    laws : the elastic laws of a recorded frame's tets; None of a live simulation, which sends what follows from them
    """

    model: Model
    time: float
    positions: NDArray[np.float64]
    poses: NDArray[np.float64]
    pinned: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    tet_values: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    internal: NDArray[np.float64] = field(default_factory=lambda: NEVER_FLOWED)
    broken_stitches: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    laws: TetLaws | None = None

    @cached_property
    def deformation_gradients(self) -> NDArray[np.float64]:
        """(m, 3, 3) F of every tet."""
        return deformation_gradients(
            np.ascontiguousarray(self.positions), self.model.tets, self.model.rest_shape_inverse
        )

    @cached_property
    def stitch_segments(self) -> NDArray[np.float64]:
        """(k, 2, 3) the two ends of every stitch [m], of broken ones the same point twice."""
        return self.model.stitches.segments(self.finite_positions, self.poses, self.broken_stitches)

    @cached_property
    def finite_positions(self) -> NDArray[np.float64]:
        """(n, 3) [m], with zeros instead of values that are not finite, which a browser cannot read."""
        return np.nan_to_num(self.positions, posinf=0.0, neginf=0.0)
