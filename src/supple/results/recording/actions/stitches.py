"""What a recording contains about stitches: what they join, so that they can be drawn, and the laws of their energy."""

from __future__ import annotations

from dataclasses import dataclass

import h5py
import numpy as np
from numpy.typing import NDArray

from supple.model.system import System, initial_state
from supple.results.recording.checked_hdf5 import CheckedFile
from supple.scene.stitches.measures import attachments


@dataclass(frozen=True, eq=False)
class StitchLaws:
    """The energies of recorded stitches: tets first, then springs.

    Attributes
    ----------
    rest_shape_inverse : (t, 3, 3) Dm^-1 of the tets [1/m]; moduli : (t, 2) mu and lam of their energy density [Pa]
    springs : (s, 2) stiffness [N/m] and rest length [m]
    """

    rest_shape_inverse: NDArray[np.float64]
    moduli: NDArray[np.float64]
    springs: NDArray[np.float64]


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

    nodes: NDArray[np.int32]
    weights: NDArray[np.float64]
    rigid_control: NDArray[np.int32]
    rigid_weights: NDArray[np.float64]
    anchor_owners: NDArray[np.int32]
    anchors: NDArray[np.float64]
    laws: StitchLaws

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


def write_stitches(own: h5py.Group, system: System) -> None:
    """Write the stitches to the group of a recording; nothing where there are none."""
    if not len(system.stitching):
        return
    group, stitches = own.create_group("stitches"), recorded_stitches(system)
    for name in ("nodes", "weights", "rigid_control", "rigid_weights", "anchor_owners", "anchors"):
        group[name] = getattr(stitches, name)
    for name, values in vars(stitches.laws).items():
        group[name] = values


def read_stitches(file: CheckedFile, n: int, obstacles: int) -> RecordedStitches:
    """The stitches of a recording with n vertices."""
    if "supple/stitches" not in file:
        return no_stitches()
    anchors = file.array("supple/stitches/anchors", "f", (None, 3))
    owners = file.array("supple/stitches/anchor_owners", "i", (len(anchors),))
    if len(owners) and not 0 <= owners.min() <= owners.max() < obstacles:
        raise file.broken("a stitch is attached to an obstacle that does not exist")
    control = file.indices("supple/stitches/rigid_control", 4, n)
    on_rigid = file.array("supple/stitches/rigid_weights", "f", (len(control), 4))
    nodes = file.indices("supple/stitches/nodes", 4, n + len(control) + len(anchors))
    weights = file.array("supple/stitches/weights", "f", (len(nodes), 3))
    moduli = file.array("supple/stitches/moduli", "f", (None, 2))
    inverses = file.array("supple/stitches/rest_shape_inverse", "f", (len(moduli), 3, 3))
    springs = file.array("supple/stitches/springs", "f", (len(nodes) - len(moduli), 2))
    return RecordedStitches(nodes, weights, control, on_rigid, owners, anchors, StitchLaws(inverses, moduli, springs))


def no_stitches() -> RecordedStitches:
    """Of a scene without stitches."""
    nothing, rows = np.zeros(0, dtype=np.int32), np.zeros((0, 4), dtype=np.int32)
    laws = StitchLaws(np.zeros((0, 3, 3)), np.zeros((0, 2)), np.zeros((0, 2)))
    return RecordedStitches(rows, np.zeros((0, 3)), rows, np.zeros((0, 4)), nothing, np.zeros((0, 3)), laws)
