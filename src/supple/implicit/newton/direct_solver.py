"""Direct solution of the linear systems: Pardiso where it is installed, SuperLU otherwise."""

from __future__ import annotations

import logging
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.numerics.sparse.block_csr import BlockRows

logger = logging.getLogger(__name__)


@cache
def _pardiso() -> Any | None:
    """The pypardiso module, or None where it is not installed."""
    try:
        import pypardiso  # pyright: ignore[reportMissingImports]
    except ImportError:
        return None
    return pypardiso


def solve_directly(pattern: BlockRows, data: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Solve A x = b, (n, 3), by factorization; None where the matrix is singular to working precision."""
    matrix = pattern.to_scipy(data)
    pardiso = _pardiso()
    if pardiso is not None:
        x = pardiso.spsolve(matrix.tocsr(), b.ravel())
    else:
        from scipy.sparse.linalg import splu

        try:
            factors = splu(
                matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError as error:
            logger.debug("direct solve: %s", error)
            return None
        x = factors.solve(b.ravel())
    return np.ascontiguousarray(x.reshape(-1, 3)) if np.isfinite(x).all() else None
