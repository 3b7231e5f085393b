"""An elastic energy in principal stretches, and how kernels choose the energy of a material by its kind."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from supple.numerics.mat3 import det
from supple.runtime.kernel_cache import njit


@njit
def no_volume_term(J):
    return (0.0, 0.0, 0.0)


@njit
def squared_volume_change(J):
    """(J - 1)^2 / 2 and its derivatives."""
    j = J - 1.0
    return (0.5 * j * j, j, 1.0)


class StretchFunctions(NamedTuple):
    """An elastic energy as four compiled functions of (s, mu, lam), the first also of F.

    s : the principal stretches (s0, s1, s2), s2 with the sign of J. F : nine numbers, row after row.

    All results are floats, and all formulas must be free of the division 0/0 that finite differences of gradients have
    where two stretches meet.

    Attributes
    ----------
    density : (F, s, mu, lam) -> psi [Pa], zero at rest
    gradient : -> (psi_0, psi_1, psi_2), psi_i = d psi / d s_i
    curvature : -> (psi_00, psi_11, psi_22, psi_12, psi_02, psi_01)
    quotients : -> (d_12, d_02, d_01, t_12, t_02, t_01) with d_ij = (psi_i - psi_j) / (s_i - s_j), the stiffness against
        a symmetric in-plane change, and t_ij = (psi_i + psi_j) / (s_i + s_j), the stiffness against an in-plane twist
    needs_positive_volume : whether the energy is infinite for J <= 0
    volume_term : J -> (U, U', U''), where lam stands in the energy as the factor of U(J) alone; `no_volume_term` of
        other energies
    density_of_stretches : whether `density` reads s. False for energies of the invariants of F^T F, which need no
        decomposition of F.
    """

    density: Any
    gradient: Any
    curvature: Any
    quotients: Any
    needs_positive_volume: bool = False
    volume_term: Any = no_volume_term
    density_of_stretches: bool = False


@njit
def volume_change(s):
    """J - 1, without cancellation where all stretches are near 1."""
    a, b, c = s[0] - 1.0, s[1] - 1.0, s[2] - 1.0
    return a + b + c + (a * b + b * c + c * a) + a * b * c


@njit
def green_strain(F):
    """E = (F^T F - I) / 2 as (E00, E11, E22, E12, E02, E01)."""
    return (
        0.5 * (F[0] * F[0] + F[3] * F[3] + F[6] * F[6] - 1.0),
        0.5 * (F[1] * F[1] + F[4] * F[4] + F[7] * F[7] - 1.0),
        0.5 * (F[2] * F[2] + F[5] * F[5] + F[8] * F[8] - 1.0),
        0.5 * (F[1] * F[2] + F[4] * F[5] + F[7] * F[8]),
        0.5 * (F[0] * F[2] + F[3] * F[5] + F[6] * F[8]),
        0.5 * (F[0] * F[1] + F[3] * F[4] + F[6] * F[7]),
    )


@njit
def shape_and_volume(F):
    """(Ic - 3) / 2 - (J - 1), the part of the neo-Hookean energies multiplied by mu, and J - 1.

    At small strains the two terms of the first cancel. With the invariants I = tr E, II, III = det E of the Green
    strain, J^2 = 1 + 2 I + 4 II + 8 III gives it as (I (J - 1) - 4 II - 8 III) / (J + 1), in which nothing cancels.
    """
    J = det(F)
    a, b, c, d, e, f = green_strain(F)
    trace = a + b + c
    if J > 0.0 and a * a + b * b + c * c + 2.0 * (d * d + e * e + f * f) < 0.25:
        third = 8.0 * (a * (b * c - d * d) - f * (f * c - d * e) + e * (f * d - b * e))
        rest = 4.0 * (a * b + b * c + c * a - d * d - e * e - f * f) + third
        j = (2.0 * trace + rest) / (J + 1.0)
        return (trace * j - rest) / (J + 1.0), j
    return trace - (J - 1.0), J - 1.0


@njit
def distance_from_rotations(s):
    """sum (s_i - 1)^2 = |F - R|^2, R the nearest rotation."""
    a, b, c = s[0] - 1.0, s[1] - 1.0, s[2] - 1.0
    return a * a + b * b + c * c


@njit
def rotation_quotients(s):
    """t_ij of sum (s_i - 1)^2 / 2: 1 - 2 / (s_i + s_j).

    The density has a kink where s_i + s_j = 0, because the nearest rotation is not unique there. The quotient tends to
    minus infinity. The sum is kept above 1e-12, which no state in double precision distinguishes from zero.
    """
    return (
        1.0 - 2.0 / max(s[1] + s[2], 1e-12),
        1.0 - 2.0 / max(s[0] + s[2], 1e-12),
        1.0 - 2.0 / max(s[0] + s[1], 1e-12),
    )


def dispatch(name: str, functions: list[Any], unknown: Any) -> Any:
    """One compiled function (kind, *arguments) that calls `functions[kind]`, or returns `unknown` for any other kind.

    Parameters
    ----------
    name : unique. Every function of the chain is named after it. The linker takes compiled functions of one name for
        the same function, and would confuse those of kernels that different processes have cached.
    """
    chosen = _otherwise(name, unknown)
    for kind in reversed(range(len(functions))):
        chosen = _first_or_rest(f"{name}_{kind}", kind, functions[kind], chosen)
    return chosen


def _otherwise(name: str, unknown: Any) -> Any:
    def otherwise(kind, *arguments):
        return unknown

    otherwise.__qualname__ = otherwise.__name__ = f"{name}_of_unknown"
    return njit(otherwise)


def _first_or_rest(name: str, own_kind: int, first: Any, rest: Any) -> Any:
    def choose(kind, *arguments):
        if kind == own_kind:
            return first(*arguments)
        return rest(kind, *arguments)

    choose.__qualname__ = choose.__name__ = f"{name}_or_rest"
    return njit(choose)


UNKNOWN_THREE = (np.nan, np.nan, np.nan)


@njit
def _unknown_density(F, s, mu, lam):
    return np.nan


@njit
def _unknown_three(s, mu, lam):
    return (np.nan, np.nan, np.nan)


@njit
def _unknown_six(s, mu, lam):
    return (np.nan, np.nan, np.nan, np.nan, np.nan, np.nan)


NOTHING_KNOWN = StretchFunctions(_unknown_density, _unknown_three, _unknown_six, _unknown_six)
