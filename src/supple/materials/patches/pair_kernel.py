"""The Hessian of patches, one 3x3 block for each pair of vertices."""

from __future__ import annotations

from supple.materials.isotropic import hessian_block
from supple.runtime.kernel_cache import njit, prange


@njit
def _edge_block(frames, turned, k, b, c):
    """The block of slots b and c of edge patch k."""
    f = frames[k]
    U = (f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8])
    A = (f[9], f[10], f[11], f[12], f[13], f[14])
    alpha, beta = (f[15], f[16], f[17]), (f[18], f[19], f[20])
    g, h = (turned[b, 0], turned[b, 1], turned[b, 2]), (turned[c, 0], turned[c, 1], turned[c, 2])
    return hessian_block(U, A, alpha, beta, g, h)


@njit(cache=True, parallel=True)
def pair_blocks(
    rows, columns, edge_start, edge_slots, star_start, star_slots, edge_owner, frames, turned, star_owner,
    stiffness, directions, out,
):  # fmt: skip
    """Sum the blocks of each pair into out (p, 3, 3), those of edges first, in the order of the patches.

    Parameters
    ----------
    frames, turned : of `edge_models`; stiffness : of `star_pressures`; directions : of `slot_gradients`
    """
    for n in prange(len(rows)):
        d0 = d1 = d2 = d3 = d4 = d5 = d6 = d7 = d8 = 0.0
        for p in range(edge_start[n], edge_start[n + 1]):
            b, c = edge_slots[p, 0], edge_slots[p, 1]
            K = _edge_block(frames, turned, edge_owner[b], b, c)
            d0 += K[0]
            d1 += K[1]
            d2 += K[2]
            d3 += K[3]
            d4 += K[4]
            d5 += K[5]
            d6 += K[6]
            d7 += K[7]
            d8 += K[8]
        for p in range(star_start[n], star_start[n + 1]):
            b, c = star_slots[p, 0], star_slots[p, 1]
            w = stiffness[star_owner[b]]
            u, v, t = w * directions[b, 0], w * directions[b, 1], w * directions[b, 2]
            x, y, z = directions[c, 0], directions[c, 1], directions[c, 2]
            d0 += u * x
            d1 += u * y
            d2 += u * z
            d3 += v * x
            d4 += v * y
            d5 += v * z
            d6 += t * x
            d7 += t * y
            d8 += t * z
        if rows[n] == columns[n]:
            d1 = d3 = 0.5 * (d1 + d3)
            d2 = d6 = 0.5 * (d2 + d6)
            d5 = d7 = 0.5 * (d5 + d7)
        out[n, 0, 0], out[n, 0, 1], out[n, 0, 2] = d0, d1, d2
        out[n, 1, 0], out[n, 1, 1], out[n, 1, 2] = d3, d4, d5
        out[n, 2, 0], out[n, 2, 1], out[n, 2, 2] = d6, d7, d8
