"""Positions of vertices as those of the points of surfaces, and back."""

from supple.runtime.kernel_cache import njit


@njit(cache=True)
def take_points(x, start, vertices, weights, out):
    """Write the places of points (b,) on the vertices x (n, 3), see `EmbeddedPoints`, to the first rows of `out`."""
    for i in range(len(start) - 1):
        first = start[i]
        if start[i + 1] == first + 1:
            for j in range(3):
                out[i, j] = x[vertices[first], j]
        else:
            a = b = c = 0.0
            for k in range(first, start[i + 1]):
                w, v = weights[k], vertices[k]
                a, b, c = a + w * x[v, 0], b + w * x[v, 1], c + w * x[v, 2]
            out[i, 0], out[i, 1], out[i, 2] = a, b, c


@njit
def give_rows(points, start, vertices, x):
    """Copy those of the points back that are vertices of x (n, 3)."""
    for i in range(len(start) - 1):
        if start[i + 1] == start[i] + 1:
            for j in range(3):
                x[vertices[start[i]], j] = points[i, j]
