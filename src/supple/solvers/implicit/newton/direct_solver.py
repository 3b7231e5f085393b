"""Direct solution of symmetric linear systems: Pardiso where it is installed, SuperLU otherwise."""

from __future__ import annotations

import logging
import os
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix, triu

from supple.numerics.sparse.block_csr import BlockRows
from supple.numerics.sparse.pcg import Product, gradients_by_products

logger = logging.getLogger(__name__)

NOTHING_MORE = np.zeros((0, 0, 3))

# Pardiso's number for real symmetric indefinite matrices, and which of its parameters (from 1) holds the number of
# negative eigenvalues.
_SYMMETRIC = -2
_NEGATIVE_EIGENVALUES = 23

# Of the residual's preconditioned norm where a correction follows: the last Newton steps are quadratic down to it. The
# correction of shells is less than three quarters of the matrix; that is a tenth of the residual in two iterations.
_CORRECTED = 1e-6
_MOST_CORRECTIONS = 100

_LIBRARY = "PYPARDISO_MKL_RT"  # the environment variable in which pypardiso takes the path of its library


@cache
def _pardiso() -> tuple[Any, type[Exception]] | None:
    """The solver of pypardiso and its error, or None where it is not installed.

    One instance is for all calls: the library does not support several at once.
    """
    library = mkl_library()
    added = library is not None and _LIBRARY not in os.environ
    if added:
        os.environ[_LIBRARY] = str(library)
    try:
        import pypardiso  # pyright: ignore[reportMissingImports]

        return pypardiso.PyPardisoSolver(mtype=_SYMMETRIC), pypardiso.pardiso_wrapper.PyPardisoError
    except ImportError:
        return None
    finally:
        if added:
            del os.environ[_LIBRARY]


def mkl_library() -> Path | None:
    """Where the package `mkl` has Pardiso's library; None where it is not installed.

    Without this path, pypardiso searches every folder of the environment, twice: seconds where it has many packages.
    """
    try:
        files = metadata.files("mkl") or []
    except metadata.PackageNotFoundError:
        return None
    found = [Path(str(file.locate())).resolve() for file in files if "mkl_rt" in file.name]
    return next((path for path in found if path.exists()), None)


def solve_directly(
    pattern: BlockRows,
    data: NDArray[np.float64],
    b: NDArray[np.float64],
    require_definite: bool = False,
    low_rank: NDArray[np.float64] = NOTHING_MORE,
    correct: Product | None = None,
) -> NDArray[np.float64] | None:
    """Solve (A + G G^T + C) x = b, (n, 3), for a symmetric A by the factorization L D L^T.

    By Sylvester's law of inertia the signs in D are those of the eigenvalues of A. With M = 1 + G^T A^-1 G, the matrix
    has as many negative eigenvalues as A has, less those of M (Haynsworth 1968), and
    x = A^-1 b - A^-1 G M^-1 G^T A^-1 b (Woodbury).

    Parameters
    ----------
    low_rank : (k, n, 3) the columns of G
    correct : the products (n, 3) -> (n, 3) with C, which is not above zero. CG follows, preconditioned by the factors

    Returns
    -------
    x, or None where A is singular to working precision or, with `require_definite`, the sum is not positive definite.
    """
    matrix, pardiso = pattern.to_scipy(data), _pardiso()
    G = low_rank.reshape(len(low_rank), b.size).T if len(low_rank) else np.zeros((b.size, 0))
    right = np.column_stack([b.ravel(), G]) if len(low_rank) else b.ravel()
    if pardiso is not None:
        x, negative, solve = _by_pardiso(*pardiso, matrix, right, correct is not None)
    else:
        x, negative, solve = _by_superlu(matrix, right, require_definite)
    if x is None or not np.isfinite(x).all():
        return None
    if len(low_rank):
        x, of_G = x[:, 0], x[:, 1:]
        M = np.eye(len(low_rank)) + G.T @ of_G
        negative -= int((np.linalg.eigvalsh(M) < 0.0).sum())
        x = x - of_G @ np.linalg.solve(M, G.T @ x)
        if not np.isfinite(x).all():
            return None
        factored, solve = solve, lambda r: (y := factored(r)) - of_G @ np.linalg.solve(M, G.T @ y)
    if require_definite and negative:
        return None
    if correct is not None:

        def product(p: NDArray[np.float64]) -> NDArray[np.float64]:
            return matrix @ p + G @ (G.T @ p) + correct(p.reshape(-1, 3)).ravel()

        x, result = gradients_by_products(product, solve, b.ravel(), _CORRECTED, _MOST_CORRECTIONS)
        if result.indefinite:
            return None
    return np.ascontiguousarray(x.reshape(-1, 3))


def _by_pardiso(
    solver: Any, failure: type[Exception], matrix: bsr_matrix, b: NDArray[np.float64], kept: bool
) -> tuple[NDArray[np.float64] | None, int, Product]:
    """The solution, the number of negative eigenvalues, and what solves for more right-hand sides; kept : whether some
    follow, for which the factors stay."""
    upper = triu(matrix, format="csr")
    try:
        if kept:
            solver.factorize(upper)
        x = solver.solve(upper, b)
    except failure as error:
        logger.debug("direct solve: %s", error)
        return None, 0, np.copy
    return x, solver.get_iparm(_NEGATIVE_EIGENVALUES), lambda r: solver.solve(upper, r)


def _by_superlu(
    matrix: bsr_matrix, b: NDArray[np.float64], inertia: bool
) -> tuple[NDArray[np.float64] | None, int, Product]:
    """The solution; where `inertia` is wanted, the number of eigenvalues that are not positive; and what solves for
    more right-hand sides."""
    from scipy.sparse.linalg import splu

    try:
        factors = splu(
            matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError as error:
        logger.debug("direct solve: %s", error)
        return None, 0, np.copy
    negative = 0
    if inertia:
        # The diagonal of U is D, unless a pivot of zero made SuperLU take one beside the diagonal.
        regular = np.array_equal(factors.perm_r, factors.perm_c)
        negative = int((factors.U.diagonal() <= 0).sum()) if regular else len(b)
    return factors.solve(b), negative, factors.solve
