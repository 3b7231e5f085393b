"""What a recording contains about stitches: what they join, so that they can be drawn, and the laws of their energy."""

from __future__ import annotations

from dataclasses import dataclass

import h5py
import numpy as np
from numpy.typing import NDArray

from supple.output.recording.checked_hdf5 import CheckedFile
from supple.scene.stitches.measures import attachments
from supple.system import System, initial_state


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
    nodes : (k, 4) the vertex, then the corners of what it is stitched to; from n on, vertices of obstacles
    weights : (k, 3) of the corners
    anchor_owners : (a,) which obstacle those vertices belong to; anchors : (a, 3) at time 0, before its pose [m]
    laws : None in recordings of older versions
    """

    nodes: NDArray[np.int32]
    weights: NDArray[np.float64]
    anchor_owners: NDArray[np.int32]
    anchors: NDArray[np.float64]
    laws: StitchLaws | None = None

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
        return np.concatenate([x, there])[self.nodes]

    def segments(self, x: NDArray[np.float64], poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, 2, 3) ends of the stitches [m]; parameters as of `corners`."""
        corners = self.corners(x, poses)
        return np.stack([corners[:, 0], np.einsum("kc,kci->ki", self.weights, corners[:, 1:])], axis=1)


def write_stitches(own: h5py.Group, system: System) -> None:
    """Write the stitches to the group of a recording; nothing where there are none."""
    stitching = system.stitching
    if not len(stitching):
        return
    start = initial_state(system.scene).positions
    nodes, weights = attachments(stitching, stitching.points(start, 0.0))
    group = own.create_group("stitches")
    group["nodes"], group["weights"] = nodes, weights
    group["anchor_owners"], group["anchors"] = stitching.anchors.owner, stitching.anchors.points
    tets, springs = stitching.tets, stitching.springs
    group["rest_shape_inverse"], group["moduli"] = tets.rest_shape_inverse, np.column_stack([tets.mu, tets.lam])
    group["springs"] = np.column_stack([springs.stiffness, springs.rest_lengths])


def read_stitches(file: CheckedFile, n: int, obstacles: int) -> RecordedStitches:
    """The stitches of a recording with n vertices."""
    if "supple/stitches" not in file:
        nothing = np.zeros(0, dtype=np.int32)
        return RecordedStitches(nothing.reshape(0, 4), np.zeros((0, 3)), nothing, np.zeros((0, 3)))
    anchors = file.array("supple/stitches/anchors", "f", (None, 3))
    owners = file.array("supple/stitches/anchor_owners", "i", (len(anchors),))
    if len(owners) and not 0 <= owners.min() <= owners.max() < obstacles:
        raise file.broken("a stitch is attached to an obstacle that does not exist")
    nodes = file.indices("supple/stitches/nodes", 4, n + len(anchors))
    weights = file.array("supple/stitches/weights", "f", (len(nodes), 3))
    laws = None
    if "supple/stitches/moduli" in file:
        moduli = file.array("supple/stitches/moduli", "f", (None, 2))
        inverses = file.array("supple/stitches/rest_shape_inverse", "f", (len(moduli), 3, 3))
        springs = file.array("supple/stitches/springs", "f", (len(nodes) - len(moduli), 2))
        laws = StitchLaws(inverses, moduli, springs)
    return RecordedStitches(nodes, weights, owners, anchors, laws)
