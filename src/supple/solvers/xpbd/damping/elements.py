"""The elements of Kelvin-Voigt damping: tetrahedra and springs, with their stiffness and their times tau.

A damped constraint with stiffness k has the viscosity tau k. An edge or a volume that is so stiff that a substep of h
keeps it rigid, h^2 k sum w |grad C|^2 >> 1, has almost no rate of strain to resist, and its viscosity goes to zero:
tau k / (1 + h^2 k sum w |grad C|^2)^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.materials.elastic import EdgesAndVolume
from supple.materials.material import Elastic
from supple.model.system import BodyRange, System
from supple.runtime.kernel_cache import njit, prange
from supple.solvers.xpbd.damping.forces import softened, viscous_spring, viscous_tet


def matrices_of_tets(points, vertices, constants, h):
    """(m, 12, 12) of tets at positions `points` [kg/s]; `constants` as in `ViscousTets.constants`."""
    out = np.empty((len(vertices), 12, 12))
    _fill_tets(points, vertices, constants, h, out)
    return out


def matrices_of_springs(points, vertices, constants, h):
    """(m, 9, 9) of springs; `constants` as in `ViscousSprings.constants`."""
    out = np.empty((len(vertices), 9, 9))
    _fill_springs(points, vertices, constants, h, out)
    return out


@njit(cache=True, parallel=True)
def _fill_tets(points, vertices, constants, h, out):
    for e in prange(len(vertices)):
        c = constants[e]
        a, b, d, q = points[vertices[e, 0]], points[vertices[e, 1]], points[vertices[e, 2]], points[vertices[e, 3]]
        x = (a[0], a[1], a[2], b[0], b[1], b[2], d[0], d[1], d[2], q[0], q[1], q[2])
        gradients = (c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8])
        tau = max(c[12] - h, 0.0)
        v = np.zeros(12)
        for k in range(12):
            v[:] = 0.0
            v[k] = 1.0
            unit = (v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8], v[9], v[10], v[11])
            f = viscous_tet(x, unit, gradients, tau * c[9], tau * softened(c[10], c[11], h))
            for j in range(12):
                out[e, j, k] = f[j]


@njit(cache=True, parallel=True)
def _fill_springs(points, vertices, constants, h, out):
    for e in prange(len(vertices)):
        t, stiffness, slope, tau = constants[e, 0], constants[e, 1], constants[e, 2], constants[e, 3]
        a, b, d = points[vertices[e, 0]], points[vertices[e, 1]], points[vertices[e, 2]]
        x = (a[0], a[1], a[2], b[0], b[1], b[2], d[0], d[1], d[2])
        v = np.zeros(9)
        for k in range(9):
            v[:] = 0.0
            v[k] = 1.0
            unit = (v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8])
            f = viscous_spring(x, unit, t, max(tau - h, 0.0) * softened(stiffness, slope, h))
            for j in range(9):
                out[e, j, k] = f[j]


@dataclass(frozen=True, eq=False)
class ViscousTets:
    """Tetrahedra that resist a rate of strain.

    Attributes
    ----------
    vertices : (m, 4); Dm_inv : (m, 3, 3) [1/m]; tau : (m,) [s]
    shear : (m,) mu V [J]
    bulk : (m,) bulk modulus times V [J]; slope : (m,) sum w |grad J|^2 of volume constraints [1/(kg m^2)], otherwise 0
    """

    vertices: NDArray[np.int32]
    Dm_inv: NDArray[np.float64]
    tau: NDArray[np.float64]
    shear: NDArray[np.float64]
    bulk: NDArray[np.float64]
    slope: NDArray[np.float64]

    def constants(self) -> NDArray[np.float64]:
        """(m, 13) rows of the tables of `viscous_tet`."""
        rest = [self.shear, self.bulk, self.slope, self.tau]
        return np.hstack([self.Dm_inv.reshape(-1, 9), np.column_stack(rest)])


@dataclass(frozen=True, eq=False)
class ViscousSprings:
    """Springs from a vertex to a place on an edge that resist a rate of length.

    Attributes
    ----------
    vertices : (m, 3), the last two the same where the place is a vertex; place : (m,); tau : (m,) [s]
    stiffness : (m,) [N/m]; slope : (m,) sum w |grad C|^2 of edges [1/kg], 0 for springs of stitches
    """

    vertices: NDArray[np.int32]
    place: NDArray[np.float64]
    tau: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    slope: NDArray[np.float64]

    def constants(self) -> NDArray[np.float64]:
        """(m, 4) rows of the tables of `viscous_spring`."""
        return np.column_stack([self.place, self.stiffness, self.slope, self.tau])


def viscous_tets(system: System, inverse_masses: NDArray[np.float64]) -> ViscousTets:
    """All damped tetrahedra of bodies and stitches; `inverse_masses` (n + a,) includes those of the anchors."""
    made: list[tuple[NDArray, ...]] = [_of_body(system, part, inverse_masses) for part in system.bodies]
    stitches = system.stitching.tets
    V, mu, lam = stitches.rest_volumes, stitches.mu, stitches.lam
    made.append((stitches.vertices, stitches.rest_shape_inverse, stitches.damping, mu * V, *_bulk(mu, lam, V)))
    columns = [np.concatenate(column) for column in zip(*made, strict=True)]
    resists = (columns[2] > 0.0) & (columns[3] + columns[4] > 0.0)
    chosen = resists & (inverse_masses[columns[0]] > 0.0).any(axis=1)
    return ViscousTets(*(np.ascontiguousarray(column[chosen]) for column in columns))


def _of_body(system: System, part: BodyRange, w: NDArray[np.float64]) -> tuple[NDArray, ...]:
    corners, Dm_inv, V = system.tets[part.tets], system.rest_shape_inverse[part.tets], system.rest_volumes[part.tets]
    material = part.body.material
    if isinstance(material, EdgesAndVolume):
        tau = np.full(len(V), _one_damping(part))
        b = np.concatenate([-Dm_inv.sum(axis=1, keepdims=True), Dm_inv], axis=1)
        slope = np.einsum("tp,tpi,tpi->t", w[corners], b, b)
        return corners, Dm_inv, tau, np.zeros(len(V)), V**2 * _stiffness(material.volume_compliance), slope
    tet = cast(Elastic, material).per_tet(len(V))
    return corners, Dm_inv, tet.damping, tet.mu * V, *_bulk(tet.mu, tet.lam, V)


def _bulk(mu: NDArray, lam: NDArray, V: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The bulk modulus times V of stable Neo-Hookean tets, and a slope of 0.

    Their bulk modulus at rest is lam - mu / 3. That of a stitch may be negative; damping must not add energy there.
    """
    return np.maximum(lam - mu / 3.0, 0.0) * V, np.zeros(len(V))


def _stiffness(compliance: float) -> float:
    """0 where the constraint is rigid; see the module."""
    return 1.0 / compliance if compliance > 0.0 else 0.0


def viscous_springs(system: System, inverse_masses: NDArray[np.float64]) -> ViscousSprings:
    """All damped edges of bodies and springs of stitches; `inverse_masses` as above."""
    springs = system.stitching.springs
    nothing = np.zeros(len(springs))
    made: list[tuple[NDArray, ...]] = [(springs.vertices, springs.place, springs.damping, springs.stiffness, nothing)]
    for part in system.bodies:
        material = part.body.material
        if isinstance(material, EdgesAndVolume):
            ends = system.edges[part.edges][:, [0, 1, 1]]
            count = len(ends)
            tau, k = np.full(count, _one_damping(part)), np.full(count, _stiffness(material.edge_compliance))
            made.append((ends, np.zeros(count), tau, k, inverse_masses[ends[:, :2]].sum(axis=1)))
    columns = [np.concatenate(column) for column in zip(*made, strict=True)]
    chosen = (columns[2] * columns[3] > 0.0) & (inverse_masses[columns[0]] > 0.0).any(axis=1)
    return ViscousSprings(*(np.ascontiguousarray(column[chosen]) for column in columns))


def _one_damping(part: BodyRange) -> float:
    damping = part.body.material.damping
    if np.ndim(damping):
        raise SolverError(
            f"XPBD: body {part.name!r}: EdgesAndVolume needs one damping for the whole body; give a number"
        )
    return float(damping)
