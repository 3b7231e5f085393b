"""The four control points of a rigid body.

An affine motion x = A X + t is that of four points, and every point of the body is a combination of them. They lie at

    c + S^(1/2) v_k,   v = (1, 1, 1), (1, -1, -1), (-1, -1, 1), (-1, 1, -1),

with the center c and the second moment per mass S, and each has a quarter of the mass. Since sum v_k = 0 and
sum v_k v_k^T = 4 1, their mass, center and second moment are the body's, and so are the kinetic energy, the momentum
and the angular momentum of every affine motion.

Source: Lan et al., "Affine Body Dynamics" (2022), section 3, with points instead of the coefficients A and t.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.mesh.tetmesh import TetMesh
from supple.scene.rigid.mass_properties import MassProperties

_CORNERS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0]])


class ControlPoints(NamedTuple):
    """The control points, and the points of a surface as combinations of them.

    Attributes
    ----------
    mesh : one tet with the control points as its vertices
    weights : (s, 4); each row sums to 1
    """

    mesh: TetMesh
    weights: NDArray[np.float64]


def control_points(properties: MassProperties, surface: NDArray[np.float64]) -> ControlPoints:
    """The control points of a body, and the weights of points (s, 3) given in its own coordinates [m]."""
    squares, axes = np.linalg.eigh(properties.second_moment / properties.mass)
    lengths = np.sqrt(squares)
    root, inverse = (axes * lengths) @ axes.T, (axes / lengths) @ axes.T
    mesh = TetMesh(properties.center + _CORNERS @ root, [[0, 1, 2, 3]])
    return ControlPoints(mesh, 0.25 + 0.25 * (surface - properties.center) @ inverse @ _CORNERS.T)
