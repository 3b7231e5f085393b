"""Lagged, smoothed Coulomb friction of contacts.

    E = sum_k f_k F(|u_k|),  u = T sum_i c_i (x_i - o_i),  T = I - n n^T

with the largest forces f_k = mu lambda, the coefficients c and normals n of the contacts at an earlier state, and the
points o at the beginning of the step. F' rises smoothly from 0 to 1 at the displacement `reach`:

    F(y) = y^2 / e - y^3 / (3 e^2) + e / 3  for y < e, else y

The gradient by u is f p with p = F'(|u|) u / |u|. Where a contact slides, the Hessian is zero along the slip, so that
Newton's steps overshoot the band in which it sticks by a thousand times its width. Primal-dual steps do not: p is a
second unknown, w, and the equation

    w / r(|u|) - u = 0,    r(y) = F'(y) / y

is linearized in both. Eliminating the change of w leaves f (r I + r' / (r |u|) w u^T) T, made symmetric, in the place
of the Hessian. It is positive semi-definite for |w| <= 1, the exact Hessian for w = p, and the majorizer of
iteratively reweighted least squares for w = 0.

Sources: Li et al., "Incremental Potential Contact" (2020), section 5; Chan, Golub, Mulet, "A Nonlinear Primal-Dual
Method for Total Variation-Based Image Restoration" (1999), sections 3 and 4.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.contact.barrier.on_points import add_forces, product_blocks
from supple.contact.features.contacts import Contacts
from supple.contact.features.pair_geometry import EDGE_EDGE, point_count
from supple.numerics.sparse.couplings import Couplings
from supple.runtime.kernel_cache import njit


class Slips(NamedTuple):
    """Arrays of k contacts with friction; kernels take it as it is.

    Attributes
    ----------
    kinds : (k,) int8; points : (k, 4) int32; coefficients : (k, 4), see `Contacts`
    normals : (k, 3) unit vectors
    offsets : (k, 3) sum_i c_i o_i, the relative position at which the contact has not slipped [m]
    forces : (k,) mu lambda [N]
    """

    kinds: NDArray[np.int8]
    points: NDArray[np.int32]
    coefficients: NDArray[np.float64]
    normals: NDArray[np.float64]
    offsets: NDArray[np.float64]
    forces: NDArray[np.float64]

    def where(self, chosen: NDArray[np.bool_]) -> Slips:
        """The chosen ones (k,)."""
        return Slips._make(array[chosen] for array in self)


@njit
def friction_potential(y, e):
    """F(y) [m]"""
    return y if y >= e else y * y / e * (1.0 - y / (3.0 * e)) + e / 3.0


@njit
def friction_ratio(y, e):
    """r(y) = F'(y) / y [1/m]"""
    return 1.0 / y if y >= e else (2.0 - y / e) / e


@njit
def ratio_slope(y, e):
    """r'(y) / (r(y) y) [1/m^2], not positive; 0 at y = 0, where it is multiplied by zero."""
    if y == 0.0:
        return 0.0
    return -1.0 / (y * y) if y >= e else -1.0 / (y * (2.0 * e - y))


@njit(cache=True)
def slips_at(x, slips, reach):
    """u (k, 3) at x (s, 3) [m]; F(|u|), r(|u|) and `ratio_slope` of it, (k,) each."""
    kinds, points, coefficients, normals, offsets, _ = slips
    u = np.empty((len(kinds), 3))
    potentials, ratios, slopes = np.empty(len(u)), np.empty(len(u)), np.empty(len(u))
    for k in range(len(u)):
        a = b = c = 0.0
        for i in range(point_count(kinds[k])):
            a += coefficients[k, i] * x[points[k, i], 0]
            b += coefficients[k, i] * x[points[k, i], 1]
            c += coefficients[k, i] * x[points[k, i], 2]
        a, b, c = a - offsets[k, 0], b - offsets[k, 1], c - offsets[k, 2]
        n = (normals[k, 0], normals[k, 1], normals[k, 2])
        along = a * n[0] + b * n[1] + c * n[2]
        u[k, 0], u[k, 1], u[k, 2] = a - along * n[0], b - along * n[1], c - along * n[2]
        y = (u[k, 0] * u[k, 0] + u[k, 1] * u[k, 1] + u[k, 2] * u[k, 2]) ** 0.5
        potentials[k], ratios[k], slopes[k] = (
            friction_potential(y, reach),
            friction_ratio(y, reach),
            ratio_slope(y, reach),
        )
    return u, potentials, ratios, slopes


def friction_energy(x: NDArray[np.float64], slips: Slips, reach: float) -> float:
    """E at x (s, 3) [J]."""
    return float(np.cumsum(slips.forces * slips_at(x, slips, reach)[1])[-1]) if len(slips.forces) else 0.0


def add_friction_gradient(x: NDArray[np.float64], slips: Slips, reach: float, out: NDArray[np.float64]) -> None:
    """Add the gradient [N] to `out` (s, 3)."""
    u, _, ratios, _ = slips_at(x, slips, reach)
    add_forces(*slips[:3], slips.forces * ratios, u, out)


def slip_forces(x: NDArray[np.float64], slips: Slips, reach: float) -> NDArray[np.float64]:
    """(k, 3) the force of friction on the first side of every contact [N]."""
    u, _, ratios, _ = slips_at(x, slips, reach)
    return (-slips.forces * ratios)[:, None] * u


def friction_hessian(x: NDArray[np.float64], slips: Slips, reach: float, duals: NDArray[np.float64]) -> Couplings:
    """The matrix of a primal-dual step at x (s, 3), positive semi-definite [N/m].

    Parameters
    ----------
    duals : (k, 3) w, in the contacts' planes, none longer than 1; see the module
    """
    u, _, ratios, slopes = slips_at(x, slips, reach)
    n, across = slips.normals, ratios[:, None, None]
    both = duals[:, :, None] * u[:, None, :] + u[:, :, None] * duals[:, None, :]
    by_slip = (0.5 * slopes)[:, None, None] * both - across * n[:, :, None] * n[:, None, :] + across * np.eye(3)
    return product_blocks(*slips[:3], slips.forces, by_slip)


def held_shares(x: NDArray[np.float64], way: NDArray[np.float64], slips: Slips, reach: float) -> NDArray[np.float64]:
    """(k, 3) f r(|u|) times the slip at the end of all of `way` (s, 3) from x, where u is the one at x, as shares of f:
    the forces that the matrix of the majorizer predicts."""
    return slips_at(x, slips, reach)[2][:, None] * slips_at(x + way, slips, reach)[0]


def renew_duals(
    x: NDArray[np.float64], way: NDArray[np.float64], slips: Slips, reach: float, duals: NDArray[np.float64]
) -> None:
    """Overwrite the duals (k, 3) by those at the end of a primal-dual step from x along all of `way` (s, 3).

    They are the forces, as shares of the largest ones, that the matrix of the step predicts, cut to the length 1.
    """
    u, _, ratios, slopes = slips_at(x, slips, reach)
    d = slips_at(way, slips._replace(offsets=np.zeros_like(u)), reach)[0]
    by_slip, by_dual = (0.5 * slopes * (vectors * d).sum(axis=1) for vectors in (u, duals))
    duals[:] = ratios[:, None] * (u + d) + by_slip[:, None] * duals + by_dual[:, None] * u
    duals /= np.sqrt(np.maximum((duals * duals).sum(axis=1), 1.0))[:, None]


def lagged_slips(
    contacts: Contacts,
    forces: NDArray[np.float64],
    start: NDArray[np.float64],
    owner: NDArray[np.int32],
    coefficients: NDArray[np.float64],
) -> tuple[Slips, NDArray[np.int64]]:
    """Of the contacts that have friction, and their numbers.

    Parameters
    ----------
    forces : (k,) normal forces [N]; start : (s, 3) where the step began [m]
    owner : (s,) of the points; coefficients : (p, p) of friction between owners
    """
    first, second = sides(contacts.kinds, contacts.points)
    mu = coefficients[owner[first], owner[second]]
    rough = np.flatnonzero(mu * forces > 0.0)
    c, points = contacts.coefficients[rough], contacts.points[rough]
    slips = Slips(
        contacts.kinds[rough],
        points,
        c,
        contacts.vectors[rough] / contacts.distances[rough, None],
        np.einsum("ki,kij->kj", c, start[points]),  # points that a kind does not have have the coefficient 0
        mu[rough] * forces[rough],
    )
    return slips, rough


def sides(kinds: NDArray[np.int8], points: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """A point (k,) on the first side of each contact, and one on the second; of kinds (k,) and points (k, 4)."""
    return points[:, 0], np.where(kinds == EDGE_EDGE, points[:, 2], points[:, 1])
