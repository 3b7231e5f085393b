"""Isotropic hyperelasticity in principal stretches: energy, stress and Hessian of any material.

With F = U diag(s) V^T (rotations U, V) and psi(s):

    P = U diag(psi_i) V^T
    d^2 psi: in the frame of U and V, dF' = U^T dF V,
        the diagonal entries are coupled by the 3x3 matrix psi_ij,
        the entries (i, j) and (j, i) by [[alpha, beta], [beta, alpha]], alpha = (d + t)/2, beta = (d - t)/2,
        d_ij = (psi_i - psi_j)/(s_i - s_j),  t_ij = (psi_i + psi_j)/(s_i + s_j).

The nine eigenvalues are those of psi_ij, the three d_ij and the three t_ij: projection to the nearest positive
semi-definite matrix clamps them at zero. In this frame the Hessian is so sparse that its contraction with the shape
gradients costs less than writing the result.

Sources: Stomakhin et al., "Energetically Consistent Invertible Elasticity" (2012), section 4; Smith, de Goes, Kim,
"Analytic Eigensystems for Isotropic Distortion Energies" (2019); Li, Jiang, Luo, "Physics-Based Simulation", chapter
"Stress and Its Derivatives".
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from supple.materials.kinds import STRETCH_ENERGIES
from supple.materials.per_tet import BY_LAW, UNKNOWN, TetMaterial
from supple.materials.stretch_energies import stable_neo_hookean
from supple.materials.stretch_energies.stretches import (
    NOTHING_KNOWN,
    UNKNOWN_THREE,
    dispatch,
    shape_and_volume,
)
from supple.numerics.mat3 import cross, load_mat, mat_mul, mat_mul_transposed, store_mat, symmetric_eigen
from supple.numerics.svd3 import svd3 as decompose
from supple.runtime.kernel_cache import kernel_with, njit, prange

volume_term = dispatch("volume_term", [energy.volume_term for energy in STRETCH_ENERGIES], UNKNOWN_THREE)
STABLE = STRETCH_ENERGIES.index(stable_neo_hookean.FUNCTIONS)

if TYPE_CHECKING:  # `functions_of` gives these names to each copy of the functions below
    KIND, OF_STRETCHES = 0, False

    def density(F, s, mu, lam) -> Any: ...

    def gradient(s, mu, lam) -> Any: ...

    def curvature(s, mu, lam) -> Any: ...

    def quotients(s, mu, lam) -> Any: ...

    def energy_density(F, mu, lam) -> Any: ...

    def stress(U, s, V, mu, lam) -> Any: ...

    def principal_hessian(s, mu, lam, pressure, project) -> Any: ...


def _energy_density(F, mu, lam):
    """psi of one F."""
    s = (0.0, 0.0, 0.0)
    if OF_STRETCHES:
        s = decompose(F)[1]
    return density(F, s, mu, lam)


def _stress(U, s, V, mu, lam):
    """P = U diag(psi_i) V^T, nine numbers, for F = U diag(s) V^T."""
    p = gradient(s, mu, lam)
    Up = (
        U[0] * p[0],
        U[1] * p[1],
        U[2] * p[2],
        U[3] * p[0],
        U[4] * p[1],
        U[5] * p[2],
        U[6] * p[0],
        U[7] * p[1],
        U[8] * p[2],
    )
    return mat_mul_transposed(Up, V)


@njit
def stable_piola(F, mu, lam):
    """P = mu F + (lam (J - 1) - mu) cof F of Stable Neo-Hookean material, which needs no stretches."""
    return add_scaled(F, mu, cofactor(F), lam * shape_and_volume(F)[1] - mu)


@njit
def add_scaled(A, a, B, b):
    """a A + b B of nine numbers each."""
    return (
        a * A[0] + b * B[0],
        a * A[1] + b * B[1],
        a * A[2] + b * B[2],
        a * A[3] + b * B[3],
        a * A[4] + b * B[4],
        a * A[5] + b * B[5],
        a * A[6] + b * B[6],
        a * A[7] + b * B[7],
        a * A[8] + b * B[8],
    )


@njit
def cofactor(F):
    """dJ/dF, nine numbers."""
    return (*cross(F[3:6], F[6:9]), *cross(F[6:9], F[0:3]), *cross(F[0:3], F[3:6]))


@njit
def nearest_semidefinite(A):
    """A symmetric 3x3 matrix (a00, a11, a22, a12, a02, a01) with its negative eigenvalues set to zero."""
    a00, a11, a22, a12, a02, a01 = A
    scale = abs(a00) + abs(a11) + abs(a22)
    minor = a00 * a11 - a01 * a01
    full = a22 * minor - a12 * (a00 * a12 - a01 * a02) + a02 * (a01 * a12 - a11 * a02)
    # Sylvester's criterion, with a margin far above round-off: no eigenvalue is negative.
    if a00 > 1e-9 * scale and minor > 1e-9 * scale * scale and full > 1e-9 * scale * scale * scale:
        return A
    w, Q = symmetric_eigen(a00, a11, a22, a12, a02, a01)
    x, y, z = max(w[0], 0.0), max(w[1], 0.0), max(w[2], 0.0)
    return (
        x * Q[0] * Q[0] + y * Q[1] * Q[1] + z * Q[2] * Q[2],
        x * Q[3] * Q[3] + y * Q[4] * Q[4] + z * Q[5] * Q[5],
        x * Q[6] * Q[6] + y * Q[7] * Q[7] + z * Q[8] * Q[8],
        x * Q[3] * Q[6] + y * Q[4] * Q[7] + z * Q[5] * Q[8],
        x * Q[0] * Q[6] + y * Q[1] * Q[7] + z * Q[2] * Q[8],
        x * Q[0] * Q[3] + y * Q[1] * Q[4] + z * Q[2] * Q[5],
    )


@njit
def add_pressure(s, pressure, A, q):
    """psi_ij and the quotients d and t of psi + pressure J, from those of psi (`StretchFunctions`)."""
    a, b, c = pressure * s[0], pressure * s[1], pressure * s[2]
    A = (A[0], A[1], A[2], A[3] + a, A[4] + b, A[5] + c)
    return A, (q[0] - a, q[1] - b, q[2] - c, q[3] + a, q[4] + b, q[5] + c)


def _principal_hessian(s, mu, lam, pressure, project):
    """The Hessian of psi + pressure J in the frame of U and V.

    Returns
    -------
    A : psi_ij as (a00, a11, a22, a12, a02, a01)
    alpha, beta : (three numbers each, for the pairs 12, 02, 01)
    """
    A, q = add_pressure(s, pressure, curvature(s, mu, lam), quotients(s, mu, lam))
    if project:
        A = nearest_semidefinite(A)
        q = (max(q[0], 0.0), max(q[1], 0.0), max(q[2], 0.0), max(q[3], 0.0), max(q[4], 0.0), max(q[5], 0.0))
    alpha = (0.5 * (q[0] + q[3]), 0.5 * (q[1] + q[4]), 0.5 * (q[2] + q[5]))
    beta = (0.5 * (q[0] - q[3]), 0.5 * (q[1] - q[4]), 0.5 * (q[2] - q[5]))
    return A, alpha, beta


@njit
def hessian_block(U, A, alpha, beta, g, h):
    """sum_jl (d^2 psi / dF_ij dF_kl) G_j H_l for g = V^T G, h = V^T H: the 3x3 block (i, k) of two nodes with shape
    gradients G and H, per rest volume."""
    x, y, z = g[0] * h[0], g[1] * h[1], g[2] * h[2]
    K = (
        A[0] * x + alpha[2] * y + alpha[1] * z,
        A[5] * g[0] * h[1] + beta[2] * g[1] * h[0],
        A[4] * g[0] * h[2] + beta[1] * g[2] * h[0],
        A[5] * g[1] * h[0] + beta[2] * g[0] * h[1],
        alpha[2] * x + A[1] * y + alpha[0] * z,
        A[3] * g[1] * h[2] + beta[0] * g[2] * h[1],
        A[4] * g[2] * h[0] + beta[1] * g[0] * h[2],
        A[3] * g[2] * h[1] + beta[0] * g[1] * h[2],
        alpha[1] * x + alpha[0] * y + A[2] * z,
    )
    return mat_mul_transposed(mat_mul(U, K), U)


def functions_of(kind: int) -> dict[str, Any]:
    """The functions of one kind of energy, or of `UNKNOWN` with NaN as all values, by the names that kernels use."""
    energy = STRETCH_ENERGIES[kind] if kind != UNKNOWN else NOTHING_KNOWN
    names: dict[str, Any] = {name: getattr(energy, name) for name in ("density", "gradient", "curvature", "quotients")}
    names |= {"KIND": kind, "OF_STRETCHES": energy.density_of_stretches}
    for function in (_energy_density, _stress, _principal_hessian):
        name = function.__name__[1:]
        names[name] = njit(kernel_with(function, f"of_kind_{kind}", **names))
    return names


# Tets from which several threads evaluate what is cheap, once a frame; fewer compile no second form of a kernel.
_SHARED_FROM = 20_000

_FUNCTIONS = {kind: functions_of(kind) for kind in (UNKNOWN, *range(len(STRETCH_ENERGIES)))}


class KernelOfKinds:
    """A kernel over tets that is compiled for each kind of energy by itself, where a scene has it.

    Parameters
    ----------
    kernel : with an argument `kind` (m,); it computes those of which `is_kind(kind[e], KIND)`, with the functions of
        `functions_of` by their names
    options : as of `njit`
    """

    def __init__(self, kernel: FunctionType, **options: Any) -> None:
        self._place = kernel.__code__.co_varnames.index("kind")
        self.of = {
            kind: njit(cache=True, **options)(kernel_with(kernel, f"of_kind_{kind}", **names))
            for kind, names in _FUNCTIONS.items()
        }

    def __call__(self, *arguments: Any) -> None:
        kind = arguments[self._place]
        if not len(kind):
            return
        low, high = int(kind.min()), int(kind.max())
        for law in [low] if low == high else np.unique(kind).tolist():
            if law >= 0 or law == low:
                self.of[max(law, UNKNOWN)](*arguments)


def kernel_of_kinds(**options: Any) -> Callable[[FunctionType], KernelOfKinds]:
    """Decorate a function to make a `KernelOfKinds` of it."""
    return lambda kernel: KernelOfKinds(kernel, **options)


@njit
def is_kind(given, kind):
    """Whether a kind is this one; all below zero are `UNKNOWN`."""
    return given == kind or (given < 0 and kind < 0)


@kernel_of_kinds()
def _rest_moduli(kind, mu, lam, rest_mu, rest_lam):
    for e in range(len(kind)):
        if is_kind(kind[e], KIND):
            # psi_ii = lam_L + 2 mu_L, psi_ij = lam_L at s = (1, 1, 1)
            A = curvature((1.0, 1.0, 1.0), mu[e], lam[e])
            rest_mu[e] = 0.5 * (A[0] - A[3])
            rest_lam[e] = A[3]


@kernel_of_kinds(parallel=True, rows=_SHARED_FROM)
def densities(F, kind, mu, lam, out):
    """Energy densities (m,) of F (m, 3, 3), into `out`."""
    for e in prange(len(F)):
        if is_kind(kind[e], KIND):
            out[e] = energy_density(load_mat(F, e), mu[e], lam[e])


@kernel_of_kinds(parallel=True, rows=_SHARED_FROM)
def piolas(F, kind, mu, lam, out):
    """Stresses (m, 3, 3) of F (m, 3, 3), into `out`."""
    for e in prange(len(F)):
        if is_kind(kind[e], KIND):
            if KIND == STABLE:
                P = stable_piola(load_mat(F, e), mu[e], lam[e])
            else:
                U, s, V = decompose(load_mat(F, e))
                P = stress(U, s, V, mu[e], lam[e])
            store_mat(P, out, e)


@njit
def store_hessian(U, A, alpha, beta, V, out, e):
    """Write the Hessian (9, 9) in F, from its parts in the principal axes U and V, to out[e]."""
    for j in range(3):
        g = (V[3 * j], V[3 * j + 1], V[3 * j + 2])
        for k in range(j + 1):
            K = hessian_block(U, A, alpha, beta, g, (V[3 * k], V[3 * k + 1], V[3 * k + 2]))
            for i in range(3):
                for n in range(3):
                    out[e, 3 * i + j, 3 * n + k] = K[3 * i + n]
                    out[e, 3 * n + k, 3 * i + j] = K[3 * i + n]


@kernel_of_kinds()
def hessians(F, kind, mu, lam, project, out):
    """Hessians (m, 9, 9) of F (m, 3, 3), into `out`."""
    for e in range(len(F)):
        if is_kind(kind[e], KIND):
            U, s, V = decompose(load_mat(F, e))
            A, alpha, beta = principal_hessian(s, mu[e], lam[e], 0.0, project)
            store_hessian(U, A, alpha, beta, V, out, e)


def rest_lame_parameters(material: TetMaterial) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """mu_L and lam_L (m,) of every tet's own linearization at rest [Pa]."""
    mu, lam = np.empty_like(material.mu), np.empty_like(material.lam)
    _rest_moduli(material.kind, material.mu, material.lam, mu, lam)
    by_law = material.kind == BY_LAW
    return np.where(by_law, material.mu, mu), np.where(by_law, material.lam, lam)
