"""Positions of vertices as those of the points of surfaces, and back."""

from supple.numerics.kernel_cache import njit


@njit(cache=True)
def take_rows(x, rows, out):
    """Copy the vertices `rows` (b,) of x (n, 3) to the first b points of `out`."""
    for i in range(len(rows)):
        for j in range(3):
            out[i, j] = x[rows[i], j]


@njit(cache=True)
def give_rows(points, rows, x):
    """Copy the first b of the points back to the vertices `rows` (b,) of x (n, 3)."""
    for i in range(len(rows)):
        for j in range(3):
            x[rows[i], j] = points[i, j]
