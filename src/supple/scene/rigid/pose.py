"""Where a rigid body is and how it moves, from its four control points, which have equal masses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Pose:
    """Placement and motion of a rigid body: a point X of its own coordinates is at `rotation @ X + translation`.

    Attributes
    ----------
    rotation : (3, 3) with determinant 1 [-]; translation : (3,) where the origin of its coordinates is [m]
    velocity : (3,) of the center of mass [m/s]; angular_velocity : (3,) [rad/s]
    """

    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]
    velocity: NDArray[np.float64]
    angular_velocity: NDArray[np.float64]


def pose_of(rest: NDArray[np.float64], x: NDArray[np.float64], v: NDArray[np.float64]) -> Pose:
    """The pose of control points x (4, 3) [m] with velocities v (4, 3) [m/s], at rest at `rest` (4, 3) [m].

    The rotation is that of the polar decomposition weighted with the masses (see `rotation_of`); the angular velocity
    is that of a rigid body with the same angular momentum.
    """
    R = rotation_of(rest, x)
    center, velocity = x.mean(axis=0), v.mean(axis=0)
    r = x - center
    inertia = np.einsum("ij,ij->", r, r) * np.eye(3) - r.T @ r
    spin = np.linalg.solve(inertia, np.cross(r, v - velocity).sum(axis=0))
    return Pose(R, center - R @ rest.mean(axis=0), velocity, spin)


def nearest_rigid(rest: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """The control points (4, 3) of the rigid pose that is nearest to x (4, 3) in the sum of squares [m]."""
    return (rest - rest.mean(axis=0)) @ rotation_of(rest, x).T + x.mean(axis=0)


def rotation_of(rest: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """The rotation (3, 3) that takes `rest` (4, 3) nearest to x (4, 3): the orthogonal factor of sum x X^T."""
    U, _, Vt = np.linalg.svd((x - x.mean(axis=0)).T @ (rest - rest.mean(axis=0)))
    U[:, 2] *= np.sign(np.linalg.det(U) * np.linalg.det(Vt))
    return U @ Vt


def orthogonality_error(rest: NDArray[np.float64], x: NDArray[np.float64]) -> float:
    """|F^T F - 1|, the Frobenius norm: zero for a rigid motion."""
    F = deformation_of(rest, x)
    return float(np.linalg.norm(F.T @ F - np.eye(3)))


def deformation_of(rest: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """F (3, 3) of the affine motion that takes four points from `rest` to x (4, 3)."""
    return np.linalg.solve(rest[1:] - rest[0], x[1:] - x[0]).T
