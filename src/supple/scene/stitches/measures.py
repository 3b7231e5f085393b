"""Energies and stretches of stitches, and where to draw them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.numerics.geometry.triangle_tree import closest_places
from supple.scene.body import PlacedBody
from supple.scene.stitches.stitching import Stitching


def stitch_energy(stitching: Stitching, points: NDArray[np.float64]) -> float:
    """Energy of all stitches, zero at rest [J]; points (n + a, 3) as of `Stitching.points` [m]."""
    return float(stitch_energies(stitching, points).sum())


def stitch_energies(stitching: Stitching, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k,) of each pair, tets first, zero at rest [J]; points as of `stitch_energy`."""
    tets, springs = stitching.tets, stitching.springs
    F = _deformation_gradients(stitching, points)
    grown = np.linalg.det(F) - 1.0
    shape = 0.5 * (np.einsum("tij,tij->t", F, F) - 3.0) - grown
    longer = np.linalg.norm(springs.extensions(points), axis=1) - springs.rest_lengths
    of_tets = (tets.mu * shape + 0.5 * tets.lam * grown * grown) * tets.rest_volumes
    return np.concatenate([of_tets, 0.5 * springs.stiffness * longer * longer])


def stitch_loads(
    stitching: Stitching, points: NDArray[np.float64], known: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """(k,) what each pair carries, tets first [N].

    Of a spring, how hard it pulls, 0 where it is shorter than at rest. Of a tet, the size of the elastic force on its
    vertex, without what presses the vertex away from the triangle. A seam does not break where its sides are pressed
    onto each other; a tet that starts flat presses them apart.

    Parameters
    ----------
    points : as of `stitch_energy`
    known : (k, 3) forces on the vertices that are known otherwise, NaN for those that follow from the points [N]

    Source: Camanho and Dávila, "Mixed-Mode Decohesion Finite Elements" (2002): traction that closes a seam counts as 0.
    """
    tets, springs, count = stitching.tets, stitching.springs, len(stitching.tets)
    F = _deformation_gradients(stitching, points)
    a, b, c = np.moveaxis(F, 2, 0)
    cofactor = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=2)
    beyond = tets.lam * (np.einsum("ti,ti->t", a, cofactor[:, :, 0]) - 1.0) - tets.mu
    stress = tets.mu[:, None, None] * F + beyond[:, None, None] * cofactor
    of_tets = np.einsum("tij,tj,t->ti", stress, tets.rest_shape_inverse.sum(axis=1), tets.rest_volumes)
    x1, x2, x3 = points[tets.vertices[:, 1:]].transpose(1, 0, 2)
    d = springs.extensions(points)
    lengths = np.linalg.norm(d, axis=1)
    # From the vertex to the other side: of a tet, the normal of the triangle at rest.
    directions = np.concatenate([np.cross(x2 - x1, x3 - x1), -d])
    directions /= np.maximum(np.linalg.norm(directions, axis=1), np.finfo(np.float64).tiny)[:, None]
    tensions = springs.stiffness * (lengths - springs.rest_lengths)
    forces = np.concatenate([of_tets, tensions[:, None] * directions[count:]])
    if known is not None:
        forces = np.where(np.isnan(known), forces, known)
    along = np.einsum("ki,ki->k", forces, directions)
    across = np.linalg.norm(forces - along[:, None] * directions, axis=1)
    across[count:] = 0.0  # of springs: what has turned since the last sweep
    return np.hypot(across, np.maximum(along, 0.0))


def largest_stitch_stretch(stitching: Stitching, points: NDArray[np.float64]) -> float | None:
    """The largest of the principal stretches of stitch tets and of the lengths of springs over their rest lengths.

    1 at rest. A tet whose vertex moves off its triangle is stretched in proportion to its rest distance, which is at
    least `min_separate_distance`. Springs of rest length zero have no stretch. None where no stitch has one.
    """
    F, springs = _deformation_gradients(stitching, points), stitching.springs
    long = springs.rest_lengths > 0.0
    lengths = np.linalg.norm(springs.extensions(points), axis=1)[long] / springs.rest_lengths[long]
    C = np.einsum("tji,tjk->tik", F, F)
    squares = np.linalg.eigvalsh(C)[:, -1] if np.isfinite(C).all() else C.max(axis=(1, 2))
    every = np.concatenate([np.sqrt(np.maximum(squares, 0.0)), lengths])
    return float(every.max()) if len(every) else None


@dataclass(frozen=True, eq=False)
class StitchEnds:
    """The ends of stitches, each from a vertex to the point that was nearest to it at the start.

    Attributes
    ----------
    nodes : (k, 4) the vertex, then the corners of what it is stitched to; of tets first, then of springs. From n on,
        they are points of rigid bodies, and then vertices of obstacles
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

    def __len__(self) -> int:
        return len(self.nodes)

    @classmethod
    def of(cls, stitching: Stitching, bodies: Sequence[PlacedBody]) -> StitchEnds:
        """Those of all stitches of a scene with these bodies."""
        springs, rigid, anchors = stitching.springs, stitching.apart, stitching.anchors
        start = np.concatenate([body.place(body.mesh.vertices) for body in bodies])
        points = stitching.points(start, 0.0)
        others = np.concatenate([stitching.tets.vertices[:, 1:], springs.vertices[:, [1, 2, 2]]])
        vertex = np.concatenate([stitching.tets.vertices[:, 0], springs.vertices[:, 0]])
        weights = closest_places(points[vertex], points, others)
        weights[len(stitching.tets) :] = np.column_stack([1.0 - springs.place, springs.place, np.zeros(len(springs))])
        nodes = np.column_stack([vertex, others]).astype(np.int32)
        return cls(nodes, weights, rigid.control, rigid.weights, anchors.owner, anchors.points)

    def corners(self, x: NDArray[np.float64], poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, 4, 3) where the nodes are [m].

        Parameters
        ----------
        x : (n, 3) vertices of bodies [m]; poses : (obstacles, 3, 4) rotation and translation of each since time 0
        """
        pose = poses[self.anchor_owners]
        there = np.einsum("aij,aj->ai", pose[:, :, :3], self.anchors) + pose[:, :, 3]
        on_rigid = np.einsum("rk,rki->ri", self.rigid_weights, x[self.rigid_control])
        return np.concatenate([x, on_rigid, there])[self.nodes]

    def segments(
        self, x: NDArray[np.float64], poses: NDArray[np.float64], broken: NDArray[np.int64] | None = None
    ) -> NDArray[np.float64]:
        """(k, 2, 3) ends of the stitches [m], of broken ones (b,) the same point twice; parameters as of `corners`."""
        corners = self.corners(x, poses)
        ends = np.stack([corners[:, 0], np.einsum("kc,kci->ki", self.weights, corners[:, 1:])], axis=1)
        if broken is not None:
            ends[broken, 1] = ends[broken, 0]
        return ends


def _deformation_gradients(stitching: Stitching, points: NDArray[np.float64]) -> NDArray[np.float64]:
    tets = stitching.tets
    corners = points[tets.vertices]
    Ds = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    return Ds @ tets.rest_shape_inverse
