"""Conversion between engineering constants and Lamé parameters (isotropic linear elasticity)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def lame_from_engineering(youngs: ArrayLike, poisson: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lamé parameters of a linear isotropic material.

    Parameters
    ----------
    youngs : Young's modulus E [Pa], scalar or array.
    poisson : Poisson's ratio nu [-], scalar or array, below 0.5.

    Returns
    -------
    mu, lam : shear modulus mu_L and first Lamé parameter lam_L [Pa].
    """
    E = np.asarray(youngs, dtype=np.float64)
    nu = np.asarray(poisson, dtype=np.float64)
    mu = E / (2.0 * (1.0 + nu))
    lam = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return mu, lam
