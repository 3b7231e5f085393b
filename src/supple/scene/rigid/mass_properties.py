"""Mass, center and second moments of a solid, exact for polyhedra.

The second moment is the tensor M = int rho (x - c)(x - c)^T dV about the center c; the inertia tensor is tr(M) 1 - M. A
closed surface is the boundary of the sum of the tetrahedra of a reference point and each triangle, with the signs of
their volumes (the divergence theorem); the point cancels. For one tetrahedron (0, a, b, c), with D = det[a, b, c] and
s = a + b + c:

    int 1 = D / 6,   int x = D s / 24,   int x x^T = D (s s^T + a a^T + b b^T + c c^T) / 120

Source: Tonon, "Explicit exact formulas for the 3-D tetrahedron inertia tensor" (2005).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.checks import float_array
from supple.kinds.validators import Validator
from supple.mesh.closed_surfaces import require_closed
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh

# Flatter than this, relative to its largest second moment, a body has no thickness: the motion across it would have
# no inertia that double precision can distinguish from zero.
_FLAT = 1e-12

# Masses and inertia whose products double precision can hold.
_SMALLEST, _LARGEST = 1e-90, 1e90

# Round-off in numbers that a user has computed, such as a rotated inertia tensor.
_ROUND_OFF = 1e-9


@dataclass(frozen=True)
class Inertia(Validator):
    """An inertia tensor (3, 3), or its diagonal (3,)."""

    def checked(self, value: Any, what: str) -> NDArray[np.float64]:
        given = float_array(value, what)
        given = np.diag(given) if given.shape == (3,) else given
        if given.shape != (3, 3) or not np.isfinite(given).all():
            raise SceneError(f"{what} must be finite, (3, 3) or its diagonal (3,) [kg m^2]")
        return given


@dataclass(frozen=True, eq=False)
class MassProperties:
    """How the mass of a body is distributed.

    Attributes
    ----------
    mass : [kg]; volume : [m^3]
    center : (3,) of mass, in the body's own coordinates [m]
    second_moment : (3, 3) M about the center [kg m^2]
    """

    mass: float
    volume: float
    center: NDArray[np.float64]
    second_moment: NDArray[np.float64]

    @property
    def inertia(self) -> NDArray[np.float64]:
        """(3, 3) about the center [kg m^2]: tr(M) 1 - M."""
        return np.trace(self.second_moment) * np.eye(3) - self.second_moment


def of_solid(shape: SurfaceMesh | TetMesh, owner: str) -> MassProperties:
    """The properties of a solid of density 1 kg/m^3.

    Parameters
    ----------
    shape : a closed surface that faces outwards, or a tet mesh
    owner : begins the text of an error

    Raises
    ------
    SceneError : where a surface is open, faces inwards, or contains no volume.
    """
    if isinstance(shape, TetMesh):
        corners = shape.vertices[shape.tets]
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    else:
        require_closed(shape, owner)
        corners = shape.vertices[shape.triangles]
        low, high = shape.bounds
    least = _FLAT * float(np.linalg.norm(high - low)) ** 3
    # The second time about the center itself, where the second moment is not the difference of two large numbers.
    center = 0.5 * (low + high)
    for _ in range(2):
        volume, first, second = _moments(corners - center)
        if volume < -least:
            raise SceneError(f"{owner}: its surface is inside out (volume {volume:.3g} m^3); give surface.flipped()")
        if volume <= least:
            raise SceneError(f"{owner}: it contains no volume; give a solid with a thickness")
        center = center + first / volume
    moment = second - np.outer(first, first) / volume
    if np.linalg.eigvalsh(moment)[0] <= _FLAT * np.linalg.eigvalsh(moment)[2]:
        raise SceneError(f"{owner}: it is flat; give a solid with a thickness, or its mass and inertia")
    return MassProperties(volume, volume, center, 0.5 * (moment + moment.T))


def with_inertia(properties: MassProperties, mass: float, inertia: ArrayLike, owner: str) -> MassProperties:
    """The properties with a mass [kg] and an inertia tensor (3, 3), or its diagonal (3,), about the center [kg m^2].

    Raises
    ------
    SceneError : where no body has this inertia tensor.
    """
    given = Inertia().checked(inertia, f"{owner}: inertia")
    size = float(np.abs(given).max())
    _within_range(size, f"{owner}: inertia", "kg m^2")
    if np.abs(given - given.T).max() > _ROUND_OFF * size:
        raise SceneError(f"{owner}: inertia is not symmetric; give the tensor about the center of mass")
    tensor = 0.5 * (given + given.T)
    principal = np.linalg.eigvalsh(tensor)
    text = ", ".join(f"{value:.6g}" for value in principal)
    if principal[0] <= 0.0:
        raise SceneError(f"{owner}: inertia has the principal moments {text}; they must be above zero [kg m^2]")
    if principal[0] + principal[1] - principal[2] <= _FLAT * principal[2]:
        raise SceneError(
            f"{owner}: inertia has the principal moments {text}; the two smaller ones together must be larger than the "
            "largest (triangle inequality)"
        )
    return MassProperties(mass, properties.volume, properties.center, 0.5 * np.trace(tensor) * np.eye(3) - tensor)


def with_mass(properties: MassProperties, mass: float, owner: str) -> MassProperties:
    """The same distribution with another mass [kg].

    Raises
    ------
    SceneError : where the mass is so small or large that its products are not numbers.
    """
    _within_range(mass, f"{owner}: its mass", "kg")
    moment = mass / properties.mass * properties.second_moment
    return MassProperties(mass, properties.volume, properties.center, moment)


def _within_range(value: float, what: str, unit: str) -> None:
    if not _SMALLEST < value < _LARGEST:
        raise SceneError(f"{what} is {value:g} {unit}; give one from {_SMALLEST:g} to {_LARGEST:g} {unit}")


def _moments(corners: NDArray[np.float64]) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """Volume, first (3,) and second (3, 3) moment of tets: corners (k, 4, 3), or (k, 3, 3) with the origin first."""
    o = corners[:, 0] if corners.shape[1] == 4 else np.zeros((len(corners), 3))
    a, b, c = corners[:, -3:].transpose(1, 0, 2)
    six = np.einsum("ij,ij->i", a - o, np.cross(b - o, c - o))
    total = o + a + b + c
    second = sum(np.einsum("k,ki,kj->ij", six, x, x) for x in (total, o, a, b, c))
    return float(six.sum()) / 6.0, six @ total / 24.0, np.asarray(second) / 120.0
