"""Sums over the points of quadratic tets: from virtual tets to nodes, and from elements to pairs of vertices."""

from __future__ import annotations

from supple.numerics.mat3 import cross, det
from supple.runtime.kernel_cache import njit, prange


@njit(cache=True, parallel=True)
def place_virtual_tets(F, out):
    """The corners (m, 4, 3) of virtual tets: the first at zero, the others the columns of F (m, 3, 3)."""
    for e in prange(len(F)):
        for i in range(3):
            out[e, 0, i] = 0.0
            for j in range(3):
                out[e, j + 1, i] = F[e, i, j]


@njit(cache=True, parallel=True)
def element_forces(gradients, forces, out):
    """(k, 10, 3) sums over an element's points of the forces (k s, 4, 3) on the corners of their virtual tets, with the
    gradients (k, s, 10, 3) of the shape functions as weights."""
    for e in prange(len(gradients)):
        points = gradients.shape[1]
        for a in range(10):
            for i in range(3):
                total = 0.0
                for q in range(points):
                    for j in range(3):
                        total += gradients[e, q, a, j] * forces[e * points + q, j + 1, i]
                out[e, a, i] = total


@njit(cache=True, parallel=True)
def element_blocks(gradients, hessians, out):
    """(k, 10, 10, 3, 3) blocks of nodes a <= b of each element, from the Hessians (k s, 12, 12) of virtual tets."""
    for e in prange(len(gradients)):
        points = gradients.shape[1]
        for a in range(10):
            for b in range(a, 10):
                for i in range(3):
                    for j in range(3):
                        out[e, a, b, i, j] = 0.0
        for q in range(points):
            H = hessians[e * points + q]
            for b in range(10):
                g0, g1, g2 = gradients[e, q, b, 0], gradients[e, q, b, 1], gradients[e, q, b, 2]
                for j in range(3):
                    # One column of the product with the gradients of node b.
                    c0 = H[3, 3 + j] * g0 + H[3, 6 + j] * g1 + H[3, 9 + j] * g2
                    c1 = H[4, 3 + j] * g0 + H[4, 6 + j] * g1 + H[4, 9 + j] * g2
                    c2 = H[5, 3 + j] * g0 + H[5, 6 + j] * g1 + H[5, 9 + j] * g2
                    d0 = H[6, 3 + j] * g0 + H[6, 6 + j] * g1 + H[6, 9 + j] * g2
                    d1 = H[7, 3 + j] * g0 + H[7, 6 + j] * g1 + H[7, 9 + j] * g2
                    d2 = H[8, 3 + j] * g0 + H[8, 6 + j] * g1 + H[8, 9 + j] * g2
                    f0 = H[9, 3 + j] * g0 + H[9, 6 + j] * g1 + H[9, 9 + j] * g2
                    f1 = H[10, 3 + j] * g0 + H[10, 6 + j] * g1 + H[10, 9 + j] * g2
                    f2 = H[11, 3 + j] * g0 + H[11, 6 + j] * g1 + H[11, 9 + j] * g2
                    for a in range(b + 1):
                        h0, h1, h2 = gradients[e, q, a, 0], gradients[e, q, a, 1], gradients[e, q, a, 2]
                        out[e, a, b, 0, j] += h0 * c0 + h1 * d0 + h2 * f0
                        out[e, a, b, 1, j] += h0 * c1 + h1 * d1 + h2 * f1
                        out[e, a, b, 2, j] += h0 * c2 + h1 * d2 + h2 * f2


@njit(cache=True, parallel=True)
def sum_pairs(start, entries, blocks, out):
    """Sum the blocks (m, 3, 3) of each pair of vertices; an entry is 2 m, or 2 m + 1 where the transpose is meant."""
    for p in prange(len(start) - 1):
        for i in range(3):
            for j in range(3):
                total = 0.0
                for t in range(start[p], start[p + 1]):
                    m = entries[t] >> 1
                    total += blocks[m, j, i] if entries[t] & 1 else blocks[m, i, j]
                out[p, i, j] = total


@njit(cache=True, parallel=True)
def add_products(factors, g, out):
    """Add c g_a g_b^T to the blocks (k, 10, 10, 3, 3) of nodes a <= b, for factors c (k,) and g (k, 10, 3)."""
    for e in prange(len(factors)):
        for a in range(10):
            for i in range(3):
                scaled = factors[e] * g[e, a, i]
                for b in range(a, 10):
                    for j in range(3):
                        out[e, a, b, i, j] += scaled * g[e, b, j]


@njit
def _columns(y, e):
    """The columns of F of a virtual tet."""
    return (
        (y[e, 1, 0], y[e, 1, 1], y[e, 1, 2]),
        (y[e, 2, 0], y[e, 2, 1], y[e, 2, 2]),
        (y[e, 3, 0], y[e, 3, 1], y[e, 3, 2]),
    )


@njit(cache=True)
def determinants_of(y, out):
    """J (m,) of virtual tets with corners y (m, 4, 3)."""
    for e in range(len(y)):
        a, b, c = _columns(y, e)
        out[e] = det((a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2]))


@njit(cache=True, parallel=True)
def volume_pushes(y, volumes, out):
    """V dJ/dF (m, 4, 3) of virtual tets with corners y (m, 4, 3), by the corners 1, 2 and 3."""
    for e in prange(len(y)):
        a, b, c = _columns(y, e)
        u, v, w = cross(b, c), cross(c, a), cross(a, b)
        for i in range(3):
            out[e, 0, i] = 0.0
            out[e, 1, i], out[e, 2, i], out[e, 3, i] = volumes[e] * u[i], volumes[e] * v[i], volumes[e] * w[i]
