"""Energies and stretches of stitches, and where to draw them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.numerics.geometry.triangle_tree import closest_places
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
    ways = np.concatenate([np.cross(x2 - x1, x3 - x1), -d])
    ways /= np.maximum(np.linalg.norm(ways, axis=1), np.finfo(np.float64).tiny)[:, None]
    forces = np.concatenate([of_tets, (springs.stiffness * (lengths - springs.rest_lengths))[:, None] * ways[count:]])
    if known is not None:
        forces = np.where(np.isnan(known), forces, known)
    along = np.einsum("ki,ki->k", forces, ways)
    across = np.linalg.norm(forces - along[:, None] * ways, axis=1)
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


def attachments(stitching: Stitching, points: NDArray[np.float64]) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """The ends of each stitch: nodes (k, 4), the vertex first, and weights (k, 3) of the others at the point nearest to
    it; points (n + a, 3) at the start [m]."""
    springs = stitching.springs
    others = np.concatenate([stitching.tets.vertices[:, 1:], springs.vertices[:, [1, 2, 2]]])
    vertex = np.concatenate([stitching.tets.vertices[:, 0], springs.vertices[:, 0]])
    weights = closest_places(points[vertex], points, others)
    weights[len(stitching.tets) :] = np.column_stack([1.0 - springs.place, springs.place, np.zeros(len(springs))])
    return np.column_stack([vertex, others]).astype(np.int32), weights


def _deformation_gradients(stitching: Stitching, points: NDArray[np.float64]) -> NDArray[np.float64]:
    tets = stitching.tets
    corners = points[tets.vertices]
    Ds = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    return Ds @ tets.rest_shape_inverse
