"""Flat rectangles that a mesh cuts into two triangles, cut into four for contact.

A box of cells has one diagonal in each square of its surface. Which one is the mesh's affair, but contact feels it: two
such squares above each other push each other sideways, along their diagonals. Both diagonals together are their own
mirror image. They cross in the middle of the one that is there, so the surface stays what it was, however it is bent.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Of the diagonal: how far from a flat rectangle a square may be.
_ALMOST = 1e-6

# Bodies with fewer squares are left as they are: their outlines weigh more than what is between them.
FEWEST = 50


def cut_evenly(
    points: NDArray[np.float64], faces: NDArray[np.int32], owner: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Cut flat rectangles' two halves into four, at a new point in the middle of the diagonal, in things with many.

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
    # Three triangles with one side in common are no surface.
    again &= ~np.append(False, again[:-1]) & ~np.append(again[1:], False)
    one, other = order[:-1][again], order[1:][again]
    tips, ends = points[c[one]], points[c[other]]
    span = sides[one, longest[one]]
    off = np.linalg.norm(tips + ends - points[a[one]] - points[b[one]], axis=1)
    even = (off <= _ALMOST * span) & (np.abs(np.linalg.norm(tips - ends, axis=1) - span) <= _ALMOST * span)
    one, other = one[even], other[even]
    many = np.bincount(owner[c[one]], minlength=int(owner.max(initial=0)) + 1) >= FEWEST
    some = many[owner[c[one]]]
    one, other = one[some], other[some]
    middle = np.full(len(faces), -1, dtype=np.int32)
    middle[one] = middle[other] = len(points) + np.arange(len(one))
    cut = middle >= 0
    a, b, c, m = a[cut], b[cut], c[cut], middle[cut]
    quarters = np.concatenate([np.column_stack([a, m, c]), np.column_stack([m, b, c])])
    diagonals = np.column_stack([low[one], high[one]])
    return np.concatenate([faces[~cut], quarters]).astype(np.int32), diagonals.astype(np.int32)
