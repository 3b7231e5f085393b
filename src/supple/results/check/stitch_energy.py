"""The energy of the stitches of a frame, from the recorded laws: the check's own sum over stitch tets and springs.

A stitch tet stores V (mu/2 (tr F^T F - 3) - mu (J - 1) + lam/2 (J - 1)^2), a spring k/2 (length - rest length)^2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.results.recording.reader import Recording


def stitch_energy(recording: Recording, x: NDArray[np.float64], poses: NDArray[np.float64]) -> float:
    """[J], zero at rest.

    Parameters
    ----------
    x : (n, 3) positions [m]; poses : (obstacles, 3, 4) of the obstacles that bodies are stitched to
    """
    stitches, laws = recording.stitches, recording.stitches.laws
    corners = stitches.corners(x, poses)
    count = len(laws.moduli)
    edges = (corners[:count, 1:] - corners[:count, :1]).transpose(0, 2, 1)
    F = edges @ laws.rest_shape_inverse
    a, b, c = F[:, :, 0], F[:, :, 1], F[:, :, 2]
    growth = np.einsum("ij,ij->i", a, np.cross(b, c)) - 1.0
    mu, lam = laws.moduli.T
    density = 0.5 * mu * (np.einsum("tij,tij->t", F, F) - 3.0) - mu * growth + 0.5 * lam * growth * growth
    places = np.einsum("kc,kci->ki", stitches.weights[count:], corners[count:, 1:])
    stiffness, rest = laws.springs.T
    extension = np.linalg.norm(corners[count:, 0] - places, axis=1) - rest
    return float(density @ _volumes(laws.rest_shape_inverse)) + 0.5 * float(stiffness @ (extension * extension))


def stitch_scale(recording: Recording) -> float:
    """An energy [J] that round-off of the stitch energy is measured by: of strains of a few percent everywhere."""
    laws = recording.stitches.laws
    stiffness, rest = laws.springs.T
    return 1e-3 * float(np.abs(laws.moduli).sum(axis=1) @ _volumes(laws.rest_shape_inverse) + stiffness @ (rest * rest))


def _volumes(rest_shape_inverse: NDArray[np.float64]) -> NDArray[np.float64]:
    """(t,) [m^3]: a sixth of det Dm."""
    return 1.0 / (6.0 * np.abs(np.linalg.det(rest_shape_inverse)))
