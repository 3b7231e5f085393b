"""Rows: the pairs that take part in a substep, found at x_n, where nothing crosses.

There the nearest places of both sides, the unit normal n and the distance d = n . r are always defined. A row asks for
n . r >= min(gap, d) at the end of the substep, and for as little slip across n as Coulomb friction can prevent.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.mat3 import dot, row
from supple.runtime.kernel_cache import njit
from trials.xpbd_rows.pairs import SHAPE, Pairs, along, is_loaded, room_between, weights_of
from trials.xpbd_rows.shapes import Walls


class Rows(NamedTuple):
    """Room for rows, of which the first are used.

    Attributes
    ----------
    pairs : (r,) the number of each row's pair; nodes : (r, 4) its nodes, kinds : (r,) its kind
    weights : (r, 4) c_i; places : (r, 3) q (see `pairs`); normals : (r, 3) n
    targets, distances : (r,) the least n . r, and d [m]
    masses : (r,) 1 / sum w_i c_i^2, the impulse [kg m] that changes r by one; 0 where nothing can move or pushes
    friction : (r,); impulses : (r, 3), accumulated [kg m]
    """

    pairs: NDArray[np.int64]
    nodes: NDArray[np.int32]
    kinds: NDArray[np.int8]
    weights: NDArray[np.float64]
    places: NDArray[np.float64]
    normals: NDArray[np.float64]
    targets: NDArray[np.float64]
    distances: NDArray[np.float64]
    masses: NDArray[np.float64]
    friction: NDArray[np.float64]
    impulses: NDArray[np.float64]

    @classmethod
    def room(cls, r: int) -> Rows:
        """For r rows."""
        wide = (np.empty((r, 4)), np.empty((r, 3)), np.empty((r, 3)))
        flat = (np.empty(r), np.empty(r), np.empty(r), np.empty(r))
        return cls(
            np.empty(r, np.int64), np.empty((r, 4), np.int32), np.empty(r, np.int8), *wide, *flat, np.empty((r, 3))
        )


@njit(cache=True)
def detect(begin, end, near, pairs, walls, reach, targets, chosen, moved, first, rows):
    """Append the rows of all pairs that are not sure to keep `reach` [m] on the way; returns the number of rows.

    Parameters
    ----------
    begin : (N, >= 3) x_n; end : (N, 4) places to which nodes would go, and inverse masses
    near : (m,) the pairs that are asked; walls : of the last of these, those with shapes
    targets : the gap that surfaces keep, and that from shapes [m]
    chosen : (k,) the pairs that are rows already; out
    moved : (N,) of a pair, one node is among these; empty: all pairs are asked
    first : how many rows there are already
    """
    count = first
    shape = len(near) - len(walls.gaps)
    for m in range(len(near)):
        k = near[m]
        kind = pairs.kinds[k]
        if chosen[k]:
            continue
        p, q, r, s = pairs.nodes[k, 0], pairs.nodes[k, 1], pairs.nodes[k, 2], pairs.nodes[k, 3]
        if len(moved) and not (moved[p] or moved[q] or moved[r] or moved[s]):
            continue
        loaded = is_loaded(pairs.impulses, k)
        if kind == SHAPE:
            w = m - shape
            n, place = row(walls.normals, w), row(walls.places, w)
            if not loaded and along(end, p, n) - dot(place, n) > reach:
                continue
            c, d, target = (1.0, 0.0, 0.0, 0.0), walls.gaps[w], targets[1]
        else:
            if room_between(begin, end, pairs.nodes, k, kind, row(pairs.normals, k)) > reach and not loaded:
                continue
            c, v = weights_of(begin, pairs.nodes, k, kind)
            d = math.sqrt(dot(v, v))
            n, place = (v[0] / d, v[1] / d, v[2] / d), (0.0, 0.0, 0.0)
            target = min(targets[0], d)
        for j in range(3):
            pairs.normals[k, j] = n[j]
        if kind != SHAPE and not loaded and room_between(begin, end, pairs.nodes, k, kind, n) > reach:
            continue
        chosen[k] = True
        softness = 0.0
        for i in range(4):
            rows.nodes[count, i] = pairs.nodes[k, i]
            rows.weights[count, i] = c[i]
            softness += end[pairs.nodes[k, i], 3] * c[i] * c[i]
        for j in range(3):
            rows.normals[count, j], rows.places[count, j] = n[j], place[j]
            rows.impulses[count, j] = pairs.impulses[k, j]
        rows.pairs[count], rows.kinds[count] = k, kind
        rows.targets[count], rows.distances[count] = target, d
        rows.masses[count] = 1.0 / softness if softness > 0.0 and pairs.pushes[k] else 0.0
        rows.friction[count] = pairs.friction[k]
        count += 1
    return count


def no_walls() -> Walls:
    """Of no pairs with shapes."""
    return Walls(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))


def is_last_shape(pairs: Pairs, near: NDArray[np.int64]) -> NDArray[np.int64]:
    """The near pairs with shapes, which are the last of the near pairs."""
    first = int(np.searchsorted(pairs.kinds[near], SHAPE))
    return near[first:]
