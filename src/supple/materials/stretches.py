"""What a material tells of itself in principal stretches, and how kernels pick the right material by its number."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit


class StretchFunctions(NamedTuple):
    """A material as four compiled functions of (s, mu, lam).

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
    """

    density: Any
    gradient: Any
    curvature: Any
    quotients: Any


@njit(error_model="numpy")
def volume_change(s):
    """J - 1, without cancellation where all stretches are near 1."""
    a, b, c = s[0] - 1.0, s[1] - 1.0, s[2] - 1.0
    return a + b + c + (a * b + b * c + c * a) + a * b * c


@njit(error_model="numpy")
def shape_energy(s):
    """(Ic - 3) / 2 - (J - 1), without cancellation where all stretches are near 1: the part of the neo-Hookean energies
    that stands with mu."""
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

    The density has a kink where s_i + s_j = 0 (the nearest rotation is not unique there): the quotient tends to minus
    infinity, and is cut off at a size that no double-precision state can tell from it.
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
    name : unique. Every link of the chain is named after it: the linker takes compiled functions of one name for one
        function, and would confuse the links of kernels that were cached by different processes.
    """
    chosen = _otherwise(name, unknown)
    for kind in reversed(range(len(functions))):
        chosen = _first_or_rest(f"{name}_{kind}", kind, functions[kind], chosen)
    return chosen


def _otherwise(name: str, unknown: Any) -> Any:
    def otherwise(kind, s, mu, lam):
        return unknown

    otherwise.__qualname__ = otherwise.__name__ = f"{name}_of_unknown"
    return njit(error_model="numpy")(otherwise)


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
