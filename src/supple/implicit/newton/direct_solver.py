"""Direct solution of symmetric linear systems: Pardiso where it is installed, SuperLU otherwise."""

from __future__ import annotations

import logging
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix, triu

from supple.numerics.sparse.block_csr import BlockRows

logger = logging.getLogger(__name__)

# Pardiso's number for real symmetric indefinite matrices, and which of its parameters (from 1) holds the number of
# negative eigenvalues.
_SYMMETRIC = -2
_NEGATIVE_EIGENVALUES = 23


@cache
def _pardiso() -> tuple[Any, type[Exception]] | None:
    """The solver of pypardiso and its error, or None where it is not installed.

    One instance is for all calls: the library does not support several at once.
    """
    try:
        import pypardiso  # pyright: ignore[reportMissingImports]
    except ImportError:
        return None
    return pypardiso.PyPardisoSolver(mtype=_SYMMETRIC), pypardiso.pardiso_wrapper.PyPardisoError


def solve_directly(
    pattern: BlockRows, data: NDArray[np.float64], b: NDArray[np.float64], require_definite: bool = False
) -> NDArray[np.float64] | None:
    """Solve A x = b, (n, 3), for a symmetric A by the factorization L D L^T.

    By Sylvester's law of inertia the signs in D are those of the eigenvalues of A.

    Returns
    -------
    x, or None where the matrix is singular to working precision or, with `require_definite`, not positive definite.
    """
    matrix, pardiso = pattern.to_scipy(data), _pardiso()
    if pardiso is not None:
        x, definite = _by_pardiso(*pardiso, matrix, b.ravel())
    else:
        x, definite = _by_superlu(matrix, b.ravel(), require_definite)
    if x is None or not np.isfinite(x).all() or (require_definite and not definite):
        return None
    return np.ascontiguousarray(x.reshape(-1, 3))


def _by_pardiso(
    solver: Any, failure: type[Exception], matrix: bsr_matrix, b: NDArray[np.float64]
) -> tuple[NDArray[np.float64] | None, bool]:
    """The solution, and whether there is no negative eigenvalue."""
    try:
        x = solver.solve(triu(matrix, format="csr"), b)
    except failure as error:
        logger.debug("direct solve: %s", error)
        return None, False
    return x, solver.get_iparm(_NEGATIVE_EIGENVALUES) == 0


def _by_superlu(matrix: bsr_matrix, b: NDArray[np.float64], inertia: bool) -> tuple[NDArray[np.float64] | None, bool]:
    """The solution and, where `inertia` is wanted, whether all eigenvalues are positive."""
    from scipy.sparse.linalg import splu

    try:
        factors = splu(
            matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError as error:
        logger.debug("direct solve: %s", error)
        return None, False
    # The diagonal of U is D, unless a pivot of zero made SuperLU take one beside the diagonal.
    definite = not inertia or (
        np.array_equal(factors.perm_r, factors.perm_c) and bool((factors.U.diagonal() > 0).all())
    )
    return factors.solve(b), definite
