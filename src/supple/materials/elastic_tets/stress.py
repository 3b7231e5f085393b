"""Stresses and energy densities of all tets, from positions.

The first Piola stress P of a tet is the one whose nodal forces -V P Dm^-T, added up, are the elastic forces on the
vertices, d psi / dF.

A quadratic tet has one value of each quantity, too, the mean over its volume: at rest of F, P and the energy density,
as it is deformed of the Cauchy stress. J is the ratio of the volumes. At its points the stress has the pressure of the
mean volume (see `mean_volume`), d psi' / dF + p cof F.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.active import add_active_piolas
from supple.materials.elastic_tets.edge_springs import cofactors
from supple.materials.elastic_tets.laws import TetLaws
from supple.materials.elastic_tets.quadratic import QuadraticTets
from supple.materials.laws.internal import add_densities, add_piolas
from supple.materials.laws.pointwise import densities_at, piolas_at
from supple.numerics.bernstein import determinant_coefficients
from supple.numerics.deformation import deformation_gradients, determinants
from supple.numerics.mat3 import det, load_mat, mat_mul_transposed, store_mat
from supple.runtime.kernel_cache import njit


def energy_densities(
    laws: TetLaws, x: NDArray[np.float64], F: NDArray[np.float64], internal: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(m,) strain energy per rest volume [J/m^3], zero at rest; NaN where a tet has no law.

    Their sum, weighted with rest volumes, is the elastic energy.

    Parameters
    ----------
    x : (n, 3) positions [m]; F : (m, 3, 3) deformation gradients of the tets at x
    internal : (k, 11) internal variables of what flows, or (0, 11) where nothing has flowed, see `State`
    """
    if laws.growth is not None:
        return laws.growth.ratios * energy_densities(laws.stress_free, x, F @ laws.growth.inverses, internal)
    out = densities_at(laws.material, F)
    add_densities(laws.material, F, internal, out)
    if laws.quadratic is not None:
        out[laws.quadratic.rows] = (
            quadratic_energies(laws, laws.quadratic, x, internal) / laws.volumes[laws.quadratic.rows]
        )
    for springs in laws.springs:
        volumes = laws.volumes[springs.rows]
        out[springs.rows] = springs.energies(x, determinants(F[springs.rows]), volumes) / volumes
    return out


def elastic_energy(laws: TetLaws, x: NDArray[np.float64], internal: NDArray[np.float64]) -> float:
    """Of all tets with a law [J]; parameters as of `energy_densities`."""
    densities = energy_densities(laws, x, mean_deformation_gradients(laws, x), internal)
    return float((densities * laws.volumes)[laws.known].sum())


def first_piolas(
    laws: TetLaws, x: NDArray[np.float64], F: NDArray[np.float64], internal: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(m, 3, 3) first Piola stress of the elastic forces and of muscles [Pa], without viscous ones.

    NaN where a tet has no law, or holds something rigid. Parameters as of `energy_densities`.
    """
    if laws.active:
        growth, free = laws.growth, laws.stress_free
        if growth is None:
            out = first_piolas(free, x, F, internal)
        else:
            grown = first_piolas(free, x, F @ growth.inverses, internal)
            out = growth.ratios[:, None, None] * grown @ np.swapaxes(growth.inverses, 1, 2)
        add_active_piolas(laws.active, F, out)
        return out
    out = piolas_at(laws.material, F)
    add_piolas(laws.material, F, internal, out)
    if laws.quadratic is not None:
        out[laws.quadratic.rows] = laws.quadratic.quadrature.means(_at_points(laws, laws.quadratic, x, internal)[1])
    for springs in laws.springs:
        own = F[springs.rows]
        out[springs.rows] = springs.first_piolas(x, own, determinants(own), laws.volumes[springs.rows])
    return out


def mean_deformation_gradients(laws: TetLaws, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, 3, 3) F of every tet at x (n, 3); of a quadratic one its mean."""
    F = deformation_gradients(x, laws.tets, laws.Dm_inv)
    if laws.quadratic is not None:
        quadrature = laws.quadratic.quadrature
        F[laws.quadratic.rows] = quadrature.means(quadrature.deformation_gradients(x))
    return F


def volume_ratios(laws: TetLaws, x: NDArray[np.float64], F: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m,) the volume of every tet at x (n, 3) over that at rest: J = det F, where F (m, 3, 3) is constant in it."""
    J = determinants(F)
    if laws.quadratic is not None:
        rows = laws.quadratic.rows
        J[rows] = determinant_coefficients(x, laws.quadratic.nodes).mean(axis=1) / (6.0 * laws.volumes[rows])
    return J


def least_ratios(laws: TetLaws, x: NDArray[np.float64], F: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m,) J = det F of every tet, F (m, 3, 3); of quadratic ones the smallest at their nodes and quadrature points."""
    J = determinants(F)
    if laws.quadratic is not None:
        J[laws.quadratic.rows] = laws.quadratic.smallest_ratios(x)
    return J


def quadratic_energies(
    laws: TetLaws, tets: QuadraticTets, x: NDArray[np.float64], internal: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(k,) of every quadratic tet [J]."""
    F, volumes = tets.quadrature.deformation_gradients(x).reshape(-1, 3, 3), tets.quadrature.volumes
    means, material = laws.at_points
    at_points = densities_at(material, F)
    add_densities(material, F, laws.internal_at_points(internal), at_points)
    energies = (at_points.reshape(volumes.shape) * volumes).sum(axis=1)
    return energies if means is None else energies + means.states(determinants(F).reshape(volumes.shape))[0]


def _at_points(
    laws: TetLaws, tets: QuadraticTets, x: NDArray[np.float64], internal: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(k, s, 3, 3) F and first Piola stress at the quadrature points."""
    F = tets.quadrature.deformation_gradients(x)
    of_points = F.reshape(-1, 3, 3)
    means, material = laws.at_points
    P = piolas_at(material, of_points)
    add_piolas(material, of_points, laws.internal_at_points(internal), P)
    if means is not None:
        pressures = means.states(determinants(of_points).reshape(F.shape[:2]))[1]
        P += np.repeat(pressures, F.shape[1])[:, None, None] * cofactors(of_points)
    return F, P.reshape(F.shape)


def cauchy_of_tets(
    laws: TetLaws,
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    F: NDArray[np.float64],
    internal: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(m, 3, 3) Cauchy stress of every tet at x (n, 3), with its P and F (m, 3, 3) [Pa] and internal variables."""
    stresses = cauchy_stresses(P, F)
    if laws.quadratic is not None:
        free = laws.stress_free
        quadratic = free.quadratic
        assert quadratic is not None
        at, stress = _at_points(free, quadratic, x, internal)
        forces = quadratic.quadrature.means(stress @ np.swapaxes(at, 2, 3))
        J = quadratic.quadrature.means(np.linalg.det(at))
        pulls = np.zeros_like(F)
        add_active_piolas(laws.active, F, pulls)
        pulls = cauchy_stresses(pulls, F)[quadratic.rows]
        stresses[quadratic.rows] = 0.5 * (forces + np.swapaxes(forces, 1, 2)) / J[:, None, None] + pulls
    return stresses


@njit(cache=True)
def cauchy_stresses(P, F):
    """(m, 3, 3) the symmetric part of P F^T / J [Pa], from P and F (m, 3, 3)."""
    out = np.empty_like(P)
    for e in range(len(P)):
        f = load_mat(F, e)
        s, J = mat_mul_transposed(load_mat(P, e), f), det(f)
        xy, xz, yz = 0.5 * (s[1] + s[3]) / J, 0.5 * (s[2] + s[6]) / J, 0.5 * (s[5] + s[7]) / J
        store_mat((s[0] / J, xy, xz, xy, s[4] / J, yz, xz, yz, s[8] / J), out, e)
    return out


@njit(cache=True)
def von_mises(cauchy):
    """(m,) sqrt(3/2 s : s) [Pa] of Cauchy stresses (m, 3, 3) with the deviator s."""
    out = np.empty(len(cauchy))
    for e in range(len(cauchy)):
        s = load_mat(cauchy, e)
        normal = (s[0] - s[4]) ** 2 + (s[4] - s[8]) ** 2 + (s[8] - s[0]) ** 2
        shear = s[1] ** 2 + s[2] ** 2 + s[3] ** 2 + s[5] ** 2 + s[6] ** 2 + s[7] ** 2
        out[e] = np.sqrt(0.5 * normal + 1.5 * shear)
    return out
