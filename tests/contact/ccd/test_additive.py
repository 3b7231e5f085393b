"""Additive detection of collisions: no step is too long, and none is needlessly short."""

from decimal import Decimal, localcontext
from fractions import Fraction

import ipctk
import numpy as np
import pytest

from supple.contact.ccd import KEEP, NO_FLOOR, ROUND_OFF, collision_time
from supple.contact.features.pair_geometry import EDGE_EDGE
from supple.contact.features.pair_geometry import VERTEX_TRIANGLE as POINT_TRIANGLE
from supple.runtime.kernel_cache import njit


@njit
def all_times(kind, x, way, offsets, out):
    for k in range(len(x)):
        out[k] = collision_time(x[k], way[k], kind, (0, 1, 2, 3), 1.0, NO_FLOOR, offsets[k])


def times(kind, x, way, offsets=None):
    out = np.empty(len(x))
    all_times(kind, x, way, np.zeros(len(x)) if offsets is None else offsets, out)
    return out


def configurations(kind, count, seed=0):
    """Four points and their ways: random, coplanar, parallel, without area or length, nearly touching, sliding.

    Sizes are 1e-9 to 1e3 m, and the places up to 1e3 m from the origin, as far as the points remain distinct.
    """
    rng = np.random.default_rng(7 + (kind == EDGE_EDGE) + 1000 * seed)
    x, way = rng.normal(size=(count, 4, 3)), rng.normal(size=(count, 4, 3)) * 10.0 ** rng.uniform(-2, 1, (count, 1, 1))
    family = np.arange(count) % 8
    first = slice(0, 1) if kind == POINT_TRIANGLE else slice(0, 2)
    near = family == 1  # parts near each other
    x[near] *= np.array([1.0, 1.0, 1e-6])
    flat = family == 2  # in one plane at the start, parts apart in it
    x[flat, :, 2] = 0.0
    x[flat, first, 0] += 3.0
    parallel = family == 3
    x[parallel, 3] = x[parallel, 2] + (x[parallel, 1] - x[parallel, 0])
    almost = family == 4
    x[almost, 3] = x[almost, 2] + (x[almost, 1] - x[almost, 0]) + 1e-8 * rng.normal(size=(almost.sum(), 3))
    thin = family == 5  # a triangle without area; an edge without length
    x[thin, 3] = x[thin, 2]
    together = family == 6  # nearly all of the motion is common
    way[together] = 100.0 * way[together, :1] + way[together]
    sliding = family == 7  # past each other at a small distance
    x[sliding] *= np.array([1.0, 1.0, 0.0])
    x[sliding, first, 2] = 1e-4
    way[sliding, :, 2] *= 1e-5
    towards = np.arange(count) % 3 > 0  # two thirds are sent towards each other
    between = x.mean(axis=1, keepdims=True) - x[:, first].mean(axis=1, keepdims=True)
    way[towards, first] += 4.0 * between[towards]
    size = 10.0 ** rng.uniform(-9, 3, count)
    x, way = x * size[:, None, None], way * size[:, None, None]
    far = 10.0 ** rng.uniform(-9, 3, count)
    far[far > 1e3 * size] = 0.0
    return x + far[:, None, None] * rng.normal(size=(count, 1, 3)), way, family


def distances(kind, x, way, t):
    """(n,) at the rounded positions x + t way, from exact differences of coordinates."""
    out = np.empty(len(x))
    for k, place in enumerate(x + t[:, None, None] * way):
        exact = [[Fraction(c) for c in point] for point in place.tolist()]
        local = np.array([[float(a - b) for a, b in zip(point, exact[0], strict=True)] for point in exact])
        size = np.abs(local).max() or 1.0  # the library squares lengths
        out[k] = size * np.sqrt(distance(kind, local / size))
    return out


def distance(kind, points):
    """Squared; the library's formula for two edges is wrong where one of them has no length."""
    a, b, c, d = points
    if kind == EDGE_EDGE and (c == d).all():
        return ipctk.point_edge_distance(c, a, b)
    return (ipctk.point_triangle_distance, ipctk.edge_edge_distance)[kind == EDGE_EDGE](a, b, c, d)


def errors(x, way):
    return 2.0 * ROUND_OFF * (np.abs(x).max(axis=(1, 2)) + np.abs(way).max(axis=(1, 2)))


@pytest.mark.parametrize("count", [3000, pytest.param(10_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", [POINT_TRIANGLE, EDGE_EDGE])
def test_every_pair_keeps_a_tenth_of_its_distance_and_no_step_is_needlessly_short(kind, count):
    x, way, family = configurations(kind, count)
    t = times(kind, x, way)
    start = distances(kind, x, way, np.zeros(len(x)))
    limited = t <= 1.0
    taken = np.where(limited, t, 1.0)
    error = errors(x, way)
    for share in (0.1, 0.4, 0.7, 0.9, 1.0):
        kept = distances(kind, x, way, share * taken)
        assert (kept >= KEEP * start - error).all(), family[kept < KEEP * start - error]
        assert (kept[start > 20.0 * error] > 0.0).all()
    # A step ends only where little more than the tenth is left.
    assert (kept[limited] <= 1.06 * KEEP * start[limited] + 4.0 * error[limited]).all()
    assert 0.2 < limited.mean() < 0.8
    assert set(family[limited]) == set(range(8))


@pytest.mark.parametrize("kind", [POINT_TRIANGLE, EDGE_EDGE])
def test_every_pair_keeps_a_tenth_of_what_is_beyond_its_offset(kind):
    x, way, family = configurations(kind, 3000)
    start = distances(kind, x, way, np.zeros(len(x)))
    # The library's squared distances lose digits where parts are large for their distance.
    precise = start > 1e-4 * np.ptp(x, axis=1).max(axis=1)
    x, way, family, start = x[precise], way[precise], family[precise], start[precise]
    offsets = start * np.random.default_rng(9).choice([0.3, 0.9, 0.999], len(x))
    t = times(kind, x, way, offsets)
    limited, error = t <= 1.0, errors(x, way)
    taken, gaps = np.where(limited, t, 1.0), start - offsets
    for share in (0.1, 0.4, 0.7, 0.9, 1.0):
        kept = distances(kind, x, way, share * taken) - offsets
        assert (kept >= KEEP * gaps - error).all(), family[kept < KEEP * gaps - error]
    assert (kept[limited] <= 1.06 * KEEP * gaps[limited] + 4.0 * error[limited]).all()
    assert 0.2 < limited.mean() < 0.9


@pytest.mark.parametrize("seed", [7, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 3, 9, 10, 13))])
def test_edges_of_every_size_keep_a_tenth_of_what_is_beyond_their_offset_by_exact_sums(seed):
    """The direction of the distance is round-off where edges are long for it; pairs that are near a tenth are summed in
    fractions."""
    x, way, _ = configurations(EDGE_EDGE, 3000, seed)
    start = distances(EDGE_EDGE, x, way, np.zeros(len(x)))
    apart = start > 0.0
    x, way, start = x[apart], way[apart], start[apart]
    offsets = start * np.random.default_rng(seed).choice([0.3, 0.9, 0.999], len(x))
    taken, error = np.minimum(times(EDGE_EDGE, x, way, offsets), 1.0), errors(x, way)
    for share in (0.4, 0.7, 1.0):
        left = distances(EDGE_EDGE, x, way, share * taken) - offsets
        for k in np.flatnonzero(left < 1.2 * KEEP * (start - offsets) + error):
            gap = exact_distance(x[k]) - Fraction(offsets[k])
            kept = exact_distance(x[k] + share * taken[k] * way[k]) - Fraction(offsets[k])
            assert kept >= Fraction(KEEP) * gap - Fraction(error[k]) or gap <= 0, (k, share, float(kept / gap))


def exact_distance(edges):
    """Of two edges, four points (4, 3), without round-off but that of the root, of 60 digits."""
    a, b, c, d = (np.array([Fraction(v) for v in point]) for point in edges.tolist())
    u, v, w = b - a, d - c, a - c
    squares = [_to_edge(p, *edge) for p, edge in ((a, (c, d)), (b, (c, d)), (c, (a, b)), (d, (a, b)))]
    uu, uv, vv, uw, vw = u @ u, u @ v, v @ v, u @ w, v @ w
    if (det := uu * vv - uv * uv) > 0:
        s, t = (uv * vw - vv * uw) / det, (uu * vw - uv * uw) / det
        if 0 <= s <= 1 and 0 <= t <= 1:
            r = w + s * u - t * v
            squares.append(r @ r)
    least = min(squares)
    with localcontext() as context:
        context.prec = 60
        return Fraction((Decimal(least.numerator) / Decimal(least.denominator)).sqrt()) if least else Fraction(0)


def _to_edge(p, a, b):
    e, d = b - a, p - a
    square = e @ e
    r = d - (min(max(d @ e / square, Fraction(0)), Fraction(1)) if square else 0) * e
    return r @ r


@pytest.mark.parametrize("kind", [POINT_TRIANGLE, EDGE_EDGE])
def test_steps_agree_with_the_library(kind):
    """Both keep a tenth of the distance. Where it falls to about that and grows again, one may stop, the other not."""
    x, way, _ = configurations(kind, 2000)
    start = distances(kind, x, way, np.zeros(len(x)))
    plain = start > 1e-6 * np.abs(x).max(axis=(1, 2))  # where round-off is no issue for the library either
    ccd = ipctk.AdditiveCCD()
    detect = (ccd.point_triangle_ccd, ccd.edge_edge_ccd)[kind == EDGE_EDGE]
    expected = []
    for a, p in zip(x[plain], way[plain], strict=True):
        hit, toi = detect(*(a / np.abs(a).max()), *((a + p) / np.abs(a).max()))
        expected.append(toi if hit else 1.0)
    found = np.minimum(times(kind, x[plain], way[plain]), 1.0)
    assert len(found) > 1000
    ratio = found / np.array(expected)
    assert (np.quantile(ratio, [0.01, 0.5, 0.99]) > [0.95, 0.99, 0.99]).all()
    assert (np.quantile(ratio, [0.01, 0.5, 0.99]) < [1.01, 1.01, 1.4]).all()


@pytest.mark.parametrize("kind", [POINT_TRIANGLE, EDGE_EDGE])
def test_pairs_that_touch_do_not_move_and_pairs_that_part_do(kind):
    x = np.array([[0.2, 0.2, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    if kind == EDGE_EDGE:
        x = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
    first = slice(0, 1) if kind == POINT_TRIANGLE else slice(0, 2)
    way = np.zeros((4, 3))
    way[first, 2] = -1.0
    assert times(kind, x[None], way[None])[0] == 0.0
    apart = x.copy()
    apart[first, 2] = 1e-9
    assert times(kind, apart[None], -way[None])[0] > 1.0
    assert times(kind, apart[None], np.zeros((1, 4, 3)))[0] > 1.0
    assert times(kind, apart[None], way[None])[0] == pytest.approx(0.9e-9, rel=1e-3)


@pytest.mark.parametrize("kind", [POINT_TRIANGLE, EDGE_EDGE])
def test_a_common_motion_changes_nothing(kind):
    x, way, _ = configurations(kind, 800)
    x, way = x / np.abs(x).max(axis=(1, 2))[:, None, None], way / np.abs(x).max(axis=(1, 2))[:, None, None]
    alone = times(kind, x, way)
    limited = alone <= 1.0
    carried = times(kind, x, way + np.array([3.0, -2.0, 1.0]))
    np.testing.assert_allclose(carried[limited], alone[limited], rtol=2e-3)
