"""Which patches of a body are deformed so little that nothing near them within the body can touch: no search there.

Let x = M X + r be the places of a body whose places at rest are X, for any matrix M. Two places P and Q of it are at

    |x_P - x_Q| >= s |X_P - X_Q| - |r_P - r_Q| >= s |X_P - X_Q| - e G(P, Q)

with s the least singular value of M, e the largest norm of F - M in tets through which a way from P to Q goes, and G
its length at rest. For a point and a triangle, or two edges, with nearest places along the unit vector n at rest, this
is at least s min(n . (X_i - X_j) - (e / s) G(i, j)) over the nodes i, j of both sides, because G may be taken as linear
in the weights of the nodes. The minimum over all pairs of two neighbouring patches is tabulated over e / s. Pairs that
are too near at rest for that stay in a fixed list.

Source: after Zheng and James, "Energy-based Self-Collision Culling for Arbitrary Mesh Deformations" (2012).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.numerics.adjacency import adjacency
from supple.numerics.mat3 import dot, row, subtract, symmetric_eigen
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.pairs import EDGES, POINT, weights_of
from supple.solvers.xpbd.contact.search.surface import RowSurface

# e / s of the columns of the table; the column and the share of the mean edge by which a pair is fixed.
STEP, LEVELS = 0.05, 14
FIXED_AT, FIXED_BELOW = 6, 0.36


class OwnPairs(NamedTuple):
    """See the module.

    Attributes
    ----------
    start, neighbours : of each patch (q,), itself and the later patches of its body that share a node with it
    tet_start, tets : of each patch, the tets that have a vertex of it
    least : (k, `LEVELS`) of each neighbour, the least distances over s [m]
    point_start, points : of each neighbour, fixed pairs of a point and a triangle; edge_start, edges : of two edges
    """

    start: NDArray[np.int32]
    neighbours: NDArray[np.int32]
    tet_start: NDArray[np.int32]
    tets: NDArray[np.int32]
    least: NDArray[np.float64]
    point_start: NDArray[np.int32]
    points: NDArray[np.int32]
    edge_start: NDArray[np.int32]
    edges: NDArray[np.int32]


def own_pairs(system: System, surface: RowSurface) -> OwnPairs:
    """Measure the patches of a surface at rest."""
    s, p = surface.simplices, surface.patches
    q = len(p.owner)
    patch_of_node = np.repeat(np.arange(q, dtype=np.int32), np.diff(p.node_start))
    # Patches that share a node.
    by_node = adjacency(p.nodes, patch_of_node, surface.count)
    count = np.diff(by_node.start)
    pairs: list[NDArray[np.integer]] = [np.zeros((0, 2), dtype=np.int64)]
    for node in np.flatnonzero(count > 1):
        mine = by_node.items[by_node.start[node] : by_node.start[node + 1]]
        pairs.append(np.stack(np.meshgrid(mine, mine), axis=-1).reshape(-1, 2))
    pairs.append(np.stack([np.arange(q), np.arange(q)], axis=1))
    near = np.unique(np.concatenate(pairs), axis=0)
    near = near[near[:, 0] <= near[:, 1]]
    corners = by_node.start[system.tets], by_node.start[system.tets + 1]
    parts: list[NDArray[np.integer]] = [np.zeros((0, 2), dtype=np.int64)]
    for j in range(4):
        lengths = corners[1][:, j] - corners[0][:, j]
        rows = np.repeat(np.arange(len(system.tets)), lengths)
        places = np.arange(len(rows)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
        parts.append(np.stack([by_node.items[corners[0][rows, j] + places], rows], axis=1))
    of_tet = np.concatenate(parts)
    start, neighbours = adjacency(near[:, 0], near[:, 1], q)
    tet_start, tets = adjacency(of_tet[:, 0], of_tet[:, 1], q)
    rest = surface.simplices.rest.copy()
    rest[: len(system.rest_positions)] = system.rest_positions
    least = np.full((len(neighbours), LEVELS), np.inf)
    bodies = (p.owner < len(system.bodies)) & s.collide[p.owner, p.owner]
    room = 1024
    while True:
        fixed = np.empty((room, 3), dtype=np.int32), np.empty((room, 3), dtype=np.int32)
        counts = _measure(
            rest,
            s,
            p,
            system.tets,
            (start, neighbours, tet_start, tets),
            bodies,
            FIXED_BELOW * surface.edge_length,
            least,
            fixed,
        )
        if max(counts) <= room:
            break
        room = max(counts)
        least[:] = np.inf
    points, edges = (np.unique(each[:count], axis=0) for each, count in zip(fixed, counts, strict=True))
    point_start, point_items = adjacency(points[:, 0], np.arange(len(points)), len(neighbours))
    edge_start, edge_items = adjacency(edges[:, 0], np.arange(len(edges)), len(neighbours))
    return OwnPairs(
        start, neighbours, tet_start, tets, least,
        point_start, np.ascontiguousarray(points[point_items, 1:]),
        edge_start, np.ascontiguousarray(edges[edge_items, 1:]),
    )  # fmt: skip


@njit
def slot_of(start, neighbours, a, b):
    """The number of b among the neighbours of a, -1 where it is not."""
    for k in range(start[a], start[a + 1]):
        if neighbours[k] == b:
            return k
    return -1


@njit
def _number(nodes, local, members):
    for i in nodes:
        if local[i] < 0:
            local[i] = members
            members += 1
    return members


@njit
def _shorten_ways(rest, tets, own, first, last, local, ways):
    changed = False
    for e in range(first, last):
        for u in range(4):
            for w in range(u):
                i, j = tets[own[e], u], tets[own[e], w]
                d = subtract(row(rest, i), row(rest, j))
                length = math.sqrt(dot(d, d))
                g, h = local[i], local[j]
                for m in range(len(ways)):
                    if ways[m, g] + length < ways[m, h]:
                        ways[m, h] = ways[m, g] + length
                        changed = True
                    elif ways[m, h] + length < ways[m, g]:
                        ways[m, g] = ways[m, h] + length
                        changed = True
    return changed


@njit(cache=True)
def _measure(rest, simplices, patches, tets, clusters, bodies, fixed_below, least, fixed):
    """Write the least distances, and (slot, part, part) of fixed pairs; returns the numbers of both kinds."""
    s, p = simplices, patches
    start, neighbours, tet_start, own = clusters
    local = np.full(len(rest), -1, dtype=np.int64)
    points = edges = 0
    nodes = np.zeros((1, 4), dtype=np.int32)
    for a in range(len(start) - 1):
        for slot in range(start[a], start[a + 1]):
            b = neighbours[slot]
            if not bodies[a]:
                least[slot, :] = -np.inf
                continue
            # Lengths of ways from the nodes of a along edges of tets that have a vertex of one of the patches.
            local[:] = -1
            sources = _number(p.nodes[p.node_start[a] : p.node_start[a + 1]], local, 0)
            members = _number(p.nodes[p.node_start[b] : p.node_start[b + 1]], local, sources)
            for turn in range(2):
                c = a if turn == 0 else b
                for e in range(tet_start[c], tet_start[c + 1]):
                    members = _number(tets[own[e]], local, members)
            ways = np.full((sources, members), np.inf)
            for m in range(sources):
                ways[m, m] = 0.0
            changed = True
            while changed:
                changed = _shorten_ways(rest, tets, own, tet_start[a], tet_start[a + 1], local, ways)
                changed = _shorten_ways(rest, tets, own, tet_start[b], tet_start[b + 1], local, ways) or changed
            for turn in range(2):
                u, w = (a, b) if turn == 0 else (b, a)
                if turn == 1 and a == b:
                    break
                for i in range(p.point_start[u], p.point_start[u + 1]):
                    k = p.points[i]
                    v = s.nodes[k]
                    for j in range(p.triangle_start[w], p.triangle_start[w + 1]):
                        t = p.triangles[j]
                        if v in (s.triangles[t, 0], s.triangles[t, 1], s.triangles[t, 2]):
                            continue
                        nodes[0, 0] = v
                        for c in range(3):
                            nodes[0, 1 + c] = s.triangles[t, c]
                        if _note(rest, nodes, POINT, local, ways, fixed_below, least, slot):
                            if points < len(fixed[0]):
                                fixed[0][points, 0], fixed[0][points, 1], fixed[0][points, 2] = slot, k, t
                            points += 1
            for i in range(p.edge_start[a], p.edge_start[a + 1]):
                e = p.edges[i]
                for j in range(p.edge_start[b], p.edge_start[b + 1]):
                    f = p.edges[j]
                    c, d, g, h = s.edges[e, 0], s.edges[e, 1], s.edges[f, 0], s.edges[f, 1]
                    if (a == b and e >= f) or c in (g, h) or d in (g, h):
                        continue
                    nodes[0, 0], nodes[0, 1], nodes[0, 2], nodes[0, 3] = c, d, g, h
                    if _note(rest, nodes, EDGES, local, ways, fixed_below, least, slot):
                        if edges < len(fixed[1]):
                            fixed[1][edges, 0], fixed[1][edges, 1], fixed[1][edges, 2] = slot, min(e, f), max(e, f)
                        edges += 1
    return points, edges


@njit
def _note(rest, nodes, kind, local, ways, fixed_below, least, slot):
    """Lower the least distances of a slot by those of a pair. Returns whether the pair is to be fixed instead."""
    _, r = weights_of(rest, nodes, 0, kind)
    size = math.sqrt(dot(r, r))
    if not size > 0.0:
        return True
    n = (r[0] / size, r[1] / size, r[2] / size)
    split = 1 if kind == POINT else 2
    if _least(rest, nodes, split, local, ways, n, FIXED_AT * STEP) < fixed_below:
        return True
    for level in range(LEVELS):
        least[slot, level] = min(least[slot, level], _least(rest, nodes, split, local, ways, n, level * STEP))
    return False


@njit
def _least(rest, nodes, split, local, ways, n, ratio):
    least = np.inf
    for i in range(split):
        for j in range(split, 4):
            p, q = nodes[0, i], nodes[0, j]
            g, h = local[p], local[q]
            way = np.inf
            if g < len(ways):
                way = ways[g, h]
            if h < len(ways):
                way = min(way, ways[h, g])
            least = min(least, dot(n, subtract(row(rest, p), row(rest, q))) - ratio * way)
    return least


@njit(cache=True)
def measure_patches(x, way, own, asked, nodes, inverse, F, means, spread, singular):
    """Measure how much the tets of patches that are asked (q,), and of their neighbours, are deformed on a way.

    Parameters
    ----------
    x, way : (N, 3) of the nodes [m]; nodes : (m, 4) of the tets; inverse : (m, 3, 3) `System.rest_shape_inverse`
    F : (k, 2, 9) of the tets of a patch, scratch memory
    means : (q, 2, 9) of F, out; spread : (q,) the largest |F - mean|, out
    singular : (q,) a lower bound of the least singular value of the mean on the way, out
    """
    wanted = asked.copy()
    for a in range(len(asked)):
        for slot in range(own.start[a], own.start[a + 1]):
            b = own.neighbours[slot]
            wanted[a] = wanted[a] or asked[b]
            wanted[b] = wanted[b] or asked[a]
    for a in range(len(spread)):
        first, count = own.tet_start[a], own.tet_start[a + 1] - own.tet_start[a]
        if not wanted[a] or count == 0:
            continue
        means[a, :, :] = 0.0
        for k in range(count):
            t = own.tets[first + k]
            o, one, two, three = nodes[t, 0], nodes[t, 1], nodes[t, 2], nodes[t, 3]
            for i in range(3):
                p, u = x[o, i], way[o, i]
                d, e, f = x[one, i] - p, x[two, i] - p, x[three, i] - p
                r, s, w = way[one, i] - u, way[two, i] - u, way[three, i] - u
                for j in range(3):
                    c, g, h = inverse[t, 0, j], inverse[t, 1, j], inverse[t, 2, j]
                    begin = d * c + e * g + f * h
                    end = begin + r * c + s * g + w * h
                    F[k, 0, 3 * i + j], F[k, 1, 3 * i + j] = begin, end
                    means[a, 0, 3 * i + j] += begin
                    means[a, 1, 3 * i + j] += end
        most = 0.0
        for end in range(2):
            for i in range(9):
                means[a, end, i] /= count
            for k in range(count):
                most = max(most, _norm(F[k, end], means[a, end], most))
        spread[a] = most
        turned = _norm(means[a, 0], means[a, 1], 0.0)
        singular[a] = 0.5 * (_least_singular(means[a, 0]) + _least_singular(means[a, 1]) - turned)


@njit
def keeps_apart(own, slot, a, b, means, spread, singular, reach):
    """Whether the pairs of two patches that are not fixed stay farther apart than `reach` [m] on the way."""
    half = 0.5 * max(_norm(means[a, 0], means[b, 0], 0.0), _norm(means[a, 1], means[b, 1], 0.0))
    e, s = max(spread[a], spread[b]) + half, min(singular[a], singular[b]) - half
    if not e < s * STEP * (LEVELS - 1):
        return False
    return s * own.least[slot, math.ceil(e / (s * STEP))] > reach


@njit
def _norm(A, B, least):
    """An upper bound of the spectral norm of the difference D of two matrices; `least`, if it is below.

    The Frobenius norm of D^T D bounds the square of the spectral norm better than that of D itself.
    """
    p, q, r = A[0] - B[0], A[1] - B[1], A[2] - B[2]
    s, t, u = A[3] - B[3], A[4] - B[4], A[5] - B[5]
    v, w, z = A[6] - B[6], A[7] - B[7], A[8] - B[8]
    a, b, c = p * p + s * s + v * v, q * q + t * t + w * w, r * r + u * u + z * z
    if a + b + c <= least * least:
        return least
    d, e, f = p * q + s * t + v * w, p * r + s * u + v * z, q * r + t * u + w * z
    return math.sqrt(math.sqrt(a * a + b * b + c * c + 2.0 * (d * d + e * e + f * f)))


@njit
def _least_singular(M):
    c, d, e = (M[0], M[3], M[6]), (M[1], M[4], M[7]), (M[2], M[5], M[8])
    w, _ = symmetric_eigen(dot(c, c), dot(d, d), dot(e, e), dot(d, e), dot(c, e), dot(c, d))
    return math.sqrt(max(0.0, min(w[0], w[1], w[2])))
