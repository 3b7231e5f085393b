"""An elastic energy in principal stretches, and how kernels choose the energy of a material by its kind."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from supple.numerics.kernel_cache import njit


class StretchFunctions(NamedTuple):
    """An elastic energy as four compiled functions of (s, mu, lam).

    s : the principal stretches (s0, s1, s2), s2 with the sign of J.

    All results are floats, and all formulas must be free of the division 0/0 that finite differences of gradients have
    where two stretches meet.

    Attributes
    ----------
    density : -> psi [Pa], zero at rest
    gradient : -> (psi_0, psi_1, psi_2), psi_i = d psi / d s_i
    curvature : -> (psi_00, psi_11, psi_22, psi_12, psi_02, psi_01)
    quotients : -> (d_12, d_02, d_01, t_12, t_02, t_01) with d_ij = (psi_i - psi_j) / (s_i - s_j), the stiffness against
        a symmetric in-plane change, and t_ij = (psi_i + psi_j) / (s_i + s_j), the stiffness against an in-plane twist
    needs_positive_volume : whether the energy is infinite for J <= 0
    """

    density: Any
    gradient: Any
    curvature: Any
    quotients: Any
    needs_positive_volume: bool = False


@njit(error_model="numpy")
def volume_change(s):
    """J - 1, without cancellation where all stretches are near 1."""
    a, b, c = s[0] - 1.0, s[1] - 1.0, s[2] - 1.0
    return a + b + c + (a * b + b * c + c * a) + a * b * c


@njit(error_model="numpy")
def shape_energy(s):
    """(Ic - 3) / 2 - (J - 1), without cancellation where all stretches are near 1: the part of the neo-Hookean energies
    multiplied by mu."""
    a, b, c = s[0] - 1.0, s[1] - 1.0, s[2] - 1.0
    return 0.5 * (a * a + b * b + c * c) - (a * b + b * c + c * a) - a * b * c


@njit(error_model="numpy")
def distance_from_rotations(s):
    """sum (s_i - 1)^2 = |F - R|^2, R the nearest rotation."""
    a, b, c = s[0] - 1.0, s[1] - 1.0, s[2] - 1.0
    return a * a + b * b + c * c


@njit(error_model="numpy")
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
    """One compiled function (kind, s, mu, lam) that calls `functions[kind]`, or `unknown` for any other kind.

    Parameters
    ----------
    name : unique. Every function of the chain is named after it. The linker takes compiled functions of one name for
        the same function, and would confuse those of kernels that different processes have cached.
    """
    chosen = _constant(name, unknown)
    for kind in reversed(range(len(functions))):
        chosen = _first_or_rest(f"{name}_{kind}", kind, functions[kind], chosen)
    return chosen


def _constant(name: str, unknown: Any) -> Any:
    def constant(kind, s, mu, lam):
        return unknown

    constant.__qualname__ = constant.__name__ = f"{name}_of_unknown"
    return njit(error_model="numpy")(constant)


def _first_or_rest(name: str, own_kind: int, first: Any, rest: Any) -> Any:
    def choose(kind, s, mu, lam):
        if kind == own_kind:
            return first(s, mu, lam)
        return rest(kind, s, mu, lam)

    choose.__qualname__ = choose.__name__ = f"{name}_or_rest"
    return njit(error_model="numpy")(choose)


UNKNOWN_ONE = float(np.nan)
UNKNOWN_THREE = (np.nan, np.nan, np.nan)
UNKNOWN_SIX = (np.nan, np.nan, np.nan, np.nan, np.nan, np.nan)
