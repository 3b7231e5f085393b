"""Rows: the pairs that take part in a substep, found at x_n, where nothing crosses.

There the nearest places of both sides, the unit normal n and the distance d = n . r are always defined. A row asks for
n . r >= min(gap, d) at the end of the substep, and for as little slip across n as Coulomb friction can prevent.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.levers import set_levers, softness
from supple.solvers.xpbd.contact.pairs import EDGES, NIL, POINT, SHAPE, Pairs, along, facing, is_loaded, room_between
from supple.solvers.xpbd.contact.shapes import Walls

# Of the gap: the distance from simple shapes.
SKIN = 0.01
# Edges at a smaller angle [rad] do not push each other.
PARALLEL = 0.05


class Rows(NamedTuple):
    """Room for rows, of which the first are used.

    Attributes
    ----------
    pairs : (r,) the number of each row's pair; nodes : (r, 4) its nodes, kinds : (r,) its kind
    weights : (r, 4) c_i; places : (r, 3) q (see `pairs`); normals : (r, 3) n
    targets, distances : (r,) the least n . r, and d [m]; gaps : (r,) of the pairs [m]
    masses : (r,) the impulse [kg m] along n that changes n . r by one, see `softness`; 0 where nothing moves or pushes
    across : (r,) the same along the surface, of rows with a rigid body; 0 until something slips
    friction : (r,); impulses : (r, 3), accumulated [kg m]
    rigid : (r,) whether a node is on a rigid body
    movers : (r, 4), levers : (r, 4, 4) share and arm [m], fixed : (r, 3) [m] of rows with rigid bodies; see `levers`
    """

    pairs: NDArray[np.int64]
    nodes: NDArray[np.int32]
    kinds: NDArray[np.int8]
    weights: NDArray[np.float64]
    places: NDArray[np.float64]
    normals: NDArray[np.float64]
    targets: NDArray[np.float64]
    distances: NDArray[np.float64]
    gaps: NDArray[np.float64]
    masses: NDArray[np.float64]
    across: NDArray[np.float64]
    friction: NDArray[np.float64]
    impulses: NDArray[np.float64]
    rigid: NDArray[np.bool_]
    movers: NDArray[np.int32]
    levers: NDArray[np.float64]
    fixed: NDArray[np.float64]

    @classmethod
    def room(cls, r: int) -> Rows:
        """For r rows."""
        wide = (np.empty((r, 4)), np.empty((r, 3)), np.empty((r, 3)))
        flat = (np.empty(r), np.empty(r), np.empty(r), np.empty(r), np.empty(r), np.empty(r))
        numbers = np.empty(r, np.int64), np.empty((r, 4), np.int32), np.empty(r, np.int8)
        of_bodies = np.empty(r, np.bool_), np.empty((r, 4), np.int32), np.empty((r, 4, 4)), np.empty((r, 3))
        return cls(*numbers, *wide, *flat, np.empty((r, 3)), *of_bodies)


@njit(cache=True)
def detect(begin, end, bodies, faces, first_of, near, pairs, walls, slack, chosen, moved, first, rows):
    """Append the rows of all pairs that are not sure to keep their reach on the way; returns the number of rows.

    Parameters
    ----------
    begin : (N, >= 3) x_n; end : (N, 4) places to which nodes would go, and inverse masses
    faces : see `facing`; first_of : see `Simplices.first`
    near : (m,) the pairs that are asked; walls : of the last of these, those with shapes
    slack : the reach of a pair is its gap and this [m]; below zero: the reach is zero
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
        reach = pairs.gaps[k] + slack if slack >= 0.0 else 0.0
        if kind == SHAPE:
            w = m - shape
            n, place = row(walls.normals, w), row(walls.places, w)
            if not loaded and along(end, p, n) - dot(place, n) > reach:
                continue
            c, d = (1.0, 0.0, 0.0, 0.0), walls.gaps[w]
            # What is behind a wall leaves it slowly.
            skin = SKIN * pairs.gaps[k]
            target = min(skin, d) if d >= 0.0 else min(0.0, d + skin)
        else:
            loaded = loaded or pairs.deep[k]
            if not loaded and room_between(begin, end, pairs.nodes, k, kind, row(pairs.normals, k)) > reach:
                continue
            c, n, d = facing(begin, pairs, k, faces)
            if n == (0.0, 0.0, 0.0):
                continue
            place = (0.0, 0.0, 0.0)
            target = min(pairs.gaps[k], d)
        for j in range(3):
            pairs.normals[k, j] = n[j]
        if kind != SHAPE and not loaded and room_between(begin, end, pairs.nodes, k, kind, n) > reach:
            continue
        chosen[k] = True
        pairs.reached[k] = max(pairs.reached[k], min(pairs.gaps[k], d))
        for i in range(4):
            rows.nodes[count, i] = pairs.nodes[k, i]
            rows.weights[count, i] = c[i]
        for j in range(3):
            rows.normals[count, j], rows.places[count, j] = n[j], place[j]
            rows.impulses[count, j] = pairs.impulses[k, j]
        rows.pairs[count], rows.kinds[count] = k, kind
        rows.targets[count], rows.distances[count], rows.gaps[count] = target, d, pairs.gaps[k]
        set_levers(bodies, rows, count)
        soft = softness(end, bodies, rows, count, n)
        pushes = pairs.pushes[k]
        if kind == EDGES and not pairs.deep[k]:
            pushes = pushes and _cross(begin, pairs.nodes, k, c)
        elif kind == POINT and not pairs.deep[k] and d > NIL * pairs.gaps[k]:
            pushes = pushes and _is_own(c, pairs.shapes[k], first_of)
        rows.masses[count] = 1.0 / soft if soft > 0.0 and pushes else 0.0
        rows.across[count], rows.friction[count] = 0.0, pairs.friction[k]
        count += 1
    return count


@njit
def _is_own(c, t, first_of):
    """Whether the nearest place of triangle t is in its interior, or on a side or corner of which it is the first.

    So one place of a surface pushes a point once.
    """
    if c[1] == 0.0 and c[2] == 0.0:
        return first_of[t, 2]
    if c[2] == 0.0 and c[3] == 0.0:
        return first_of[t, 0]
    if c[3] == 0.0 and c[1] == 0.0:
        return first_of[t, 1]
    if c[1] == 0.0:
        return first_of[t, 4]
    if c[2] == 0.0:
        return first_of[t, 5]
    return first_of[t, 3] if c[3] == 0.0 else True


@njit
def _cross(x, nodes, k, c):
    """Whether the nearest places of two edges are within both, and the edges are not parallel.

    Otherwise a point and a triangle carry the load. The nearest places of parallel edges jump along them.
    """
    inside = min(min(c[0], c[1]), min(-c[2], -c[3]))
    a, b = subtract(row(x, nodes[k, 1]), row(x, nodes[k, 0])), subtract(row(x, nodes[k, 3]), row(x, nodes[k, 2]))
    n = cross(a, b)
    return inside > 1e-6 and dot(n, n) > PARALLEL**2 * dot(a, a) * dot(b, b)


def no_walls() -> Walls:
    """Of no pairs with shapes."""
    return Walls(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))


def is_last_shape(pairs: Pairs, near: NDArray[np.int64]) -> NDArray[np.int64]:
    """The near pairs with shapes, which are the last of the near pairs."""
    first = int(np.searchsorted(pairs.kinds[near], SHAPE))
    return near[first:]
