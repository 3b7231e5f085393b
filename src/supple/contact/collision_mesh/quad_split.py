"""Splits flat quads, which a mesh divides into two triangles, into four triangles for contact.

The surface of a box of cells has one diagonal in each quad. Contact forces depend on its direction: two such quads
above each other push each other sideways, along their diagonals. With both diagonals the quad is symmetric. The new
point is the middle of the existing diagonal, so that the surface does not change, also where it is bent.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# How far a quad may be from a flat rectangle, as a share of its diagonal.
_TOLERANCE = 1e-6

# Bodies with fewer quads are not split: contact along their outlines dominates.
MIN_QUADS = 50


def split_quads(
    points: NDArray[np.float64], faces: NDArray[np.int32], owner: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Split the flat quads of things that have at least `MIN_QUADS` of them.

    Parameters
    ----------
    points : (s, 3) at rest [m]; faces : (f, 3)
    owner : (s,) which thing each point belongs to

    Returns
    -------
    faces : (f + 2 k, 3), where s + i is the middle of the i-th diagonal
    diagonals : (k, 2) their ends
    """
    corners = points[faces]
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    rows, longest = np.arange(len(faces)), sides.argmax(axis=1)
    a, b, c = (faces[rows, (longest + k) % 3] for k in range(3))
    low, high = np.minimum(a, b), np.maximum(a, b)
    order = np.lexsort((high, low))
    again = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    # An edge of three triangles is no edge of a quad.
    again &= ~np.append(False, again[:-1]) & ~np.append(again[1:], False)
    one, other = order[:-1][again], order[1:][again]
    tips, ends = points[c[one]], points[c[other]]
    span = sides[one, longest[one]]
    off = np.linalg.norm(tips + ends - points[a[one]] - points[b[one]], axis=1)
    flat = (off <= _TOLERANCE * span) & (np.abs(np.linalg.norm(tips - ends, axis=1) - span) <= _TOLERANCE * span)
    one, other = one[flat], other[flat]
    enough = np.bincount(owner[c[one]], minlength=int(owner.max(initial=0)) + 1) >= MIN_QUADS
    chosen = enough[owner[c[one]]]
    one, other = one[chosen], other[chosen]
    middle = np.full(len(faces), -1, dtype=np.int32)
    middle[one] = middle[other] = len(points) + np.arange(len(one))
    split = middle >= 0
    a, b, c, m = a[split], b[split], c[split], middle[split]
    quarters = np.concatenate([np.column_stack([a, m, c]), np.column_stack([m, b, c])])
    diagonals = np.column_stack([low[one], high[one]])
    return np.concatenate([faces[~split], quarters]).astype(np.int32), diagonals.astype(np.int32)
