"""Columns of local arrays as tuples, for kernels that work on a group of constraints."""

from supple.runtime.kernel_cache import njit


@njit(forceinline=True)
def six(X, i):
    """The rows 0 to 5 of column i."""
    return X[0, i], X[1, i], X[2, i], X[3, i], X[4, i], X[5, i]


@njit(forceinline=True)
def nine(X, i):
    """The rows 0 to 8 of column i."""
    return X[0, i], X[1, i], X[2, i], X[3, i], X[4, i], X[5, i], X[6, i], X[7, i], X[8, i]


@njit(forceinline=True)
def twelve(X, i):
    """The rows 0 to 11 of column i."""
    return (
        X[0, i],
        X[1, i],
        X[2, i],
        X[3, i],
        X[4, i],
        X[5, i],
        X[6, i],
        X[7, i],
        X[8, i],
        X[9, i],
        X[10, i],
        X[11, i],
    )


@njit(forceinline=True)
def put_six(X, i, x):
    """Write the rows 0 to 5 of column i."""
    X[0, i], X[1, i], X[2, i], X[3, i], X[4, i], X[5, i] = x


@njit(forceinline=True)
def put_nine(X, i, x):
    """Write the first entries of x into the rows 0 to 8 of column i."""
    X[0, i], X[1, i], X[2, i], X[3, i], X[4, i] = x[0], x[1], x[2], x[3], x[4]
    X[5, i], X[6, i], X[7, i], X[8, i] = x[5], x[6], x[7], x[8]


@njit(forceinline=True)
def put_twelve(X, i, x):
    """Write the first entries of x into the rows 0 to 11 of column i."""
    X[0, i], X[1, i], X[2, i], X[3, i], X[4, i], X[5, i] = x[0], x[1], x[2], x[3], x[4], x[5]
    X[6, i], X[7, i], X[8, i], X[9, i], X[10, i], X[11, i] = x[6], x[7], x[8], x[9], x[10], x[11]
