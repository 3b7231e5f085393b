"""Angles between the two triangles at an edge, with their first and second derivatives.

A hinge is (i, j, k, l): the edge runs from i to j as in the triangle of k, and l is the third corner of the other one.
With e = x_j - x_i and the normals n_1 = e x (x_k - x_i), n_2 = (x_l - x_i) x e of the two triangles, the angle is that
from n_1 to n_2 about e, zero where they are in one plane. Its derivatives by the wings are

    d theta/dx_k = -|e| n_1/|n_1|^2,    d theta/dx_l = -|e| n_2/|n_2|^2,

and those by the ends of the edge follow, as a turn of a wing about the edge is the same as a motion of the ends.

Source: Tamstorf, Grinspun, "Discrete bending forces and their Jacobians" (2013).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Bent:
    """Hinges (e, 4) at positions x (n, 3).

    Attributes
    ----------
    angles : (e,) [rad], from -pi to pi
    """

    def __init__(self, x: Floats, hinges: NDArray[np.int32]) -> None:
        i, j, k, l = (x[corner] for corner in hinges.T)  # noqa: E741
        self._edge, self._arms = j - i, (k - i, l - i)
        self._normals = np.cross(self._edge, self._arms[0]), np.cross(self._arms[1], self._edge)
        self._length = np.linalg.norm(self._edge, axis=1)
        across = np.einsum("ei,ei->e", np.cross(*self._normals), self._edge)
        along = self._length * np.einsum("ei,ei->e", *self._normals)
        self.angles: Floats = np.arctan2(across, along)

    def gradients(self) -> Floats:
        """(e, 4, 3) [rad/m]"""
        wings, places = zip(*(self._wing(side)[:2] for side in (0, 1)), strict=True)
        out = np.empty((len(self.angles), 4, 3))
        out[:, 2], out[:, 3] = wings
        out[:, 0] = -sum((1.0 - at)[:, None] * wing for at, wing in zip(places, wings, strict=True))
        out[:, 1] = -sum(at[:, None] * wing for at, wing in zip(places, wings, strict=True))
        return out

    def hessians(self) -> Floats:
        """(e, 4, 4, 3, 3) [rad/m^2]"""
        out = np.zeros((len(self.angles), 4, 4, 3, 3))
        for side, own in ((0, (0, 1, 2)), (1, (0, 1, 3))):
            wing, at, of_wing, of_at = self._wing(side)
            for q, corner in enumerate(own):
                change, turn = of_wing[q], np.einsum("ei,ej->eij", wing, of_at[q])
                out[:, own[2], corner] += change
                out[:, 0, corner] += turn - (1.0 - at)[:, None, None] * change
                out[:, 1, corner] -= turn + at[:, None, None] * change
        return out

    def _wing(self, side: int) -> tuple[Floats, Floats, list[Floats], list[Floats]]:
        """The gradient by a wing (e, 3), where along the edge it stands (e,), and the derivatives of both by the ends
        of the edge and the wing."""
        e, arm, n, sign = self._edge, self._arms[side], self._normals[side], (1.0, -1.0)[side]
        length, area = self._length, np.einsum("ei,ei->e", n, n)
        upright = n / area[:, None]
        wing = -length[:, None] * upright
        at = np.einsum("ei,ei->e", arm, e) / length**2
        R = -(length / area)[:, None, None] * (np.eye(3) - 2.0 * np.einsum("ei,ej->eij", n, upright))
        stretched = -np.einsum("ei,ej->eij", upright, e / length[:, None])
        turns = [sign * R @ _cross(v) for v in (arm - e, -arm, e)]
        of_wing = [turns[0] - stretched, turns[1] + stretched, turns[2]]
        unit = 1.0 / length[:, None] ** 2
        more = 2.0 * at[:, None] * e
        return wing, at, of_wing, [(more - e - arm) * unit, (arm - more) * unit, e * unit]


def _cross(v: Floats) -> Floats:
    """(e, 3, 3) the matrices of w -> v x w."""
    out = np.zeros((len(v), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    out[:, 1, 0], out[:, 2, 0], out[:, 2, 1] = v[:, 2], -v[:, 1], v[:, 0]
    return out
