"""Energy, gradient and Hessian of springs between vertices and points of edges: k/2 (|d| - l)^2.

With d = sum_p c_p x_p, c = (1, t - 1, -t), the block of nodes p and q is c_p c_q K with

    K = k n n^T + k (1 - l / |d|) (I - n n^T),    n = d / |d|.

Projection omits the second term where it is negative: where the spring is shorter than at rest.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.scene.stitches.elements import Springs


def spring_energies(springs: Springs, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k,) [J] at positions `points` (n, 3) [m]."""
    lengths = np.linalg.norm(springs.extensions(points), axis=1)
    return 0.5 * springs.stiffness * (lengths - springs.rest_lengths) ** 2


def spring_gradients(springs: Springs, points: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """By the nodes [N], into out (k, 4, 3); the fourth is no node. A spring of zero length has no force."""
    d = springs.extensions(points)
    lengths = np.linalg.norm(d, axis=1)
    share = springs.rest_lengths / np.where(lengths > 0.0, lengths, np.inf)
    force = (springs.stiffness * (1.0 - share))[:, None] * d
    out[:] = _coefficients(springs)[:, :, None] * force[:, None, :]


def spring_hessians(springs: Springs, points: NDArray[np.float64], project: bool, out: NDArray[np.float64]) -> None:
    """By the nodes [N/m], into out (k, 12, 12); with `project`, of a convex model."""
    d = springs.extensions(points)
    lengths = np.linalg.norm(d, axis=1)
    n = d / np.where(lengths > 0.0, lengths, 1.0)[:, None]
    aside = 1.0 - springs.rest_lengths / np.where(lengths > 0.0, lengths, np.inf)
    if project:
        aside = np.maximum(aside, 0.0)
    both = np.einsum("ki,kj->kij", n, n)
    K = springs.stiffness[:, None, None] * (both + aside[:, None, None] * (np.eye(3) - both))
    c = _coefficients(springs)
    out[:] = np.einsum("kp,kq,kij->kpiqj", c, c, K).reshape(-1, 12, 12)


def _coefficients(springs: Springs) -> NDArray[np.float64]:
    """(k, 4) of each node in d. Where both ends of the edge are one vertex, the first has the whole coefficient."""
    c = np.zeros((len(springs), 4))
    alone = springs.vertices[:, 1] == springs.vertices[:, 2]
    c[:, 0] = 1.0
    c[:, 1] = np.where(alone, -1.0, springs.place - 1.0)
    c[:, 2] = np.where(alone, 0.0, -springs.place)
    return c
