"""What a recording contains about stitches: what they join, so that they can be drawn, and the laws of their energy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System, initial_state
from supple.results.checkpoint.typed import Rows
from supple.scene.stitches.measures import attachments


@dataclass(frozen=True, eq=False)
class StitchLaws:
    """The energies of recorded stitches: tets first, then springs.

    Attributes
    ----------
    rest_shape_inverse : (t, 3, 3) Dm^-1 of the tets [1/m]; moduli : (t, 2) mu and lam of their energy density [Pa]
    springs : (s, 2) stiffness [N/m] and rest length [m]
    """

    rest_shape_inverse: Annotated[NDArray[np.float64], Rows("t", 3, 3)]
    moduli: Annotated[NDArray[np.float64], Rows("t", 2)]
    springs: Annotated[NDArray[np.float64], Rows("s", 2)]


@dataclass(frozen=True, eq=False)
class RecordedStitches:
    """The stitches of a recording, each from a vertex to the point that was nearest to it at the start.

    Attributes
    ----------
    nodes : (k, 4) the vertex, then the corners of what it is stitched to; from n on, points of rigid bodies, and then
        vertices of obstacles
    weights : (k, 3) of the corners
    rigid_control, rigid_weights : (r, 4) vertices, and the combination of these that each point of a rigid body is
    anchor_owners : (a,) which obstacle those vertices belong to; anchors : (a, 3) at time 0, before its pose [m]
    """

    nodes: Annotated[NDArray[np.int32], Rows("k", 4)]
    weights: Annotated[NDArray[np.float64], Rows("k", 3)]
    rigid_control: Annotated[NDArray[np.int32], Rows("r", 4, below="n")]
    rigid_weights: Annotated[NDArray[np.float64], Rows("r", 4)]
    anchor_owners: Annotated[NDArray[np.int32], Rows("a", below="obstacles")]
    anchors: Annotated[NDArray[np.float64], Rows("a", 3)]
    laws: StitchLaws

    def check(self, n: int) -> None:
        """Raise `ValueError` where a node is none of a scene with n vertices, or a stitch has no law."""
        count = n + len(self.rigid_control) + len(self.anchors)
        if len(self.nodes) and not 0 <= self.nodes.min() <= self.nodes.max() < count:
            raise ValueError(f"a stitch joins node {self.nodes.max()} of {count}")
        if len(self.laws.moduli) + len(self.laws.springs) != len(self.nodes):
            raise ValueError("there is another number of laws of stitches than of stitches")

    def __len__(self) -> int:
        return len(self.nodes)

    def corners(self, x: NDArray[np.float64], poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, 4, 3) where the nodes are [m].

        Parameters
        ----------
        x : (n, 3) vertices of bodies [m]; poses : (obstacles, 3, 4) as of `RecordedFrame.obstacle_poses`
        """
        pose = poses[self.anchor_owners]
        there = np.einsum("aij,aj->ai", pose[:, :, :3], self.anchors) + pose[:, :, 3]
        on_rigid = np.einsum("rk,rki->ri", self.rigid_weights, x[self.rigid_control])
        return np.concatenate([x, on_rigid, there])[self.nodes]

    def segments(self, x: NDArray[np.float64], poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, 2, 3) ends of the stitches [m]; parameters as of `corners`."""
        corners = self.corners(x, poses)
        return np.stack([corners[:, 0], np.einsum("kc,kci->ki", self.weights, corners[:, 1:])], axis=1)


def recorded_stitches(system: System) -> RecordedStitches:
    """The stitches of a system."""
    stitching = system.stitching
    nodes, weights = attachments(stitching, stitching.points(initial_state(system.scene).positions, 0.0))
    rigid, anchors, tets, springs = stitching.apart, stitching.anchors, stitching.tets, stitching.springs
    laws = StitchLaws(
        tets.rest_shape_inverse,
        np.column_stack([tets.mu, tets.lam]),
        np.column_stack([springs.stiffness, springs.rest_lengths]),
    )
    return RecordedStitches(nodes, weights, rigid.control, rigid.weights, anchors.owner, anchors.points, laws)


def no_stitches() -> RecordedStitches:
    """Of a scene without stitches."""
    nothing, rows = np.zeros(0, dtype=np.int32), np.zeros((0, 4), dtype=np.int32)
    laws = StitchLaws(np.zeros((0, 3, 3)), np.zeros((0, 2)), np.zeros((0, 2)))
    return RecordedStitches(rows, np.zeros((0, 3)), rows, np.zeros((0, 4)), nothing, np.zeros((0, 3)), laws)
