"""The step filter against exact rational arithmetic."""

from fractions import Fraction

import numpy as np
import pytest

from supple.errors import SolverError
from supple.numerics.noninverting_step import largest_noninverting_step, noninverting_step
from supple.solvers.implicit.inversion_guard import keeps_volume

REGULAR = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.8, 0.0], [0.4, 0.3, 0.9]])


def exact_cubic(x, p):
    """Six times the volume along x + t p: its coefficients, t^0 first, as fractions of the doubles given."""
    x = [[Fraction(float(v)) for v in r] for r in x]
    p = [[Fraction(float(v)) for v in r] for r in p]
    edges = [[[x[k][i] - x[0][i], p[k][i] - p[0][i]] for i in range(3)] for k in (1, 2, 3)]

    def times(f, g):
        out = [Fraction(0)] * (len(f) + len(g) - 1)
        for i, u in enumerate(f):
            for j, v in enumerate(g):
                out[i + j] += u * v
        return out

    total = [Fraction(0)] * 4
    for i, j, k, sign in ((0, 1, 2, 1), (1, 2, 0, 1), (2, 0, 1, 1), (0, 2, 1, -1), (2, 1, 0, -1), (1, 0, 2, -1)):
        term = times(times(edges[0][i], edges[1][j]), edges[2][k])
        total = [s + sign * v for s, v in zip(total, term, strict=True)]
    return total


def value(f, t):
    return ((f[3] * t + f[2]) * t + f[1]) * t + f[0]


def falls_below(f, share, t):
    """Whether the volume falls below `share` of its start anywhere in (0, t]: sampled at the ends and extrema."""
    g = [f[0] * (1 - Fraction(share)), f[1], f[2], f[3]]
    points = [Fraction(t)]
    extrema = np.roots([3.0 * float(g[3] / f[0]), 2.0 * float(g[2] / f[0]), float(g[1] / f[0])])
    points += [Fraction(float(r.real)) for r in np.atleast_1d(extrema) if abs(r.imag) == 0.0 and 0.0 < r.real < t]
    return any(value(g, s) < 0 for s in points)


def random_tets(rng, n, thinness):
    """Tets with unit edges and positive volume, the last node at height `thinness` above the others' plane."""
    x = np.empty((n, 4, 3))
    flat = rng.normal(size=(n, 4, 3)) * [1.0, 1.0, 0.0]
    flat[:, 3] = flat[:, :3].mean(axis=1)
    flat[:, 3, 2] = np.sign(np.cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0])[:, 2]) * thinness
    q = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    q *= np.sign(np.linalg.det(q))[:, None, None]
    x[:] = np.einsum("eij,ekj->eki", q, flat)
    return x


def directions(rng, kind, x):
    n = len(x)
    size = 10.0 ** rng.uniform(-1, 2, size=(n, 1, 1))
    p = rng.normal(size=(n, 4, 3))
    if kind == "near-planar":
        # All nodes move almost in one plane: the leading coefficient nearly vanishes beside the others.
        normal = rng.normal(size=(n, 1, 3))
        normal /= np.linalg.norm(normal, axis=2, keepdims=True)
        p -= (1.0 - 10.0 ** rng.uniform(-9, -3, size=(n, 1, 1))) * (p @ normal.swapaxes(1, 2)) * normal
    elif kind == "biaxial":
        # The tet is stretched along two axes and compressed along the third.
        axes = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
        p = np.einsum("eij,j,ekj,enk->eni", axes, [1.0, 1.0, -1.0], axes, x)
    return p * size


@pytest.mark.parametrize("kind", ["random", "near-planar", "biaxial"])
@pytest.mark.parametrize(
    ("scale", "thinness"), [(1.0, 0.7), (1e-9, 0.7), (1e3, 0.7), (1.0, 1e-4), (1e-9, 1e-8), (1e3, 1e-12)]
)
def test_step_is_at_most_the_true_one_and_close_to_it(kind, scale, thinness):
    rng = np.random.default_rng(7)
    n = 120
    x = random_tets(rng, n, thinness) * scale
    p = directions(rng, kind, x / scale) * scale
    if thinness < 0.1:
        p *= 10.0 ** rng.uniform(-6, 0, size=(n, 1, 1))
    tets = np.arange(4, dtype=np.int32)[None]
    limited = 0
    for e in range(n):
        f = exact_cubic(x[e], p[e])
        step = largest_noninverting_step(x[e], p[e], tets)
        assert 0.0 < step <= 1.0
        assert not falls_below(f, 0.2, step)
        assert value(f, Fraction(step)) > 0
        if step < 1.0:
            limited += 1
            assert falls_below(f, 0.2, Fraction(step) * (1 + Fraction(1, 10**6)))
    assert limited >= 10


def test_thousands_of_tets_at_once_never_invert():
    rng = np.random.default_rng(3)
    for thinness in (0.5, 1e-3, 1e-6):
        x = random_tets(rng, 4000, thinness).reshape(-1, 3)
        tets = np.arange(len(x), dtype=np.int32).reshape(-1, 4)
        p = directions(rng, "near-planar", x.reshape(-1, 4, 3)).reshape(-1, 3)
        step = largest_noninverting_step(x, p, tets)
        volume = exact_volumes_ratio(x, x + step * p, tets)
        assert volume.min() >= 0.2 * (1.0 - 1e-8 / thinness)


def exact_volumes_ratio(x, y, tets):
    before, after = (np.linalg.det((z[tets[:, 1:]] - z[tets[:, :1]]).astype(np.float64)) for z in (x, y))
    return after / before


def test_published_failures_as_tets():
    """Directions for whose scaled cubic the published closed form misses a root or returns one too large."""
    for a, b, c, truth in ((2e-6, 2000.0, -200.0, 0.0041742430504), (1e-5, 500.0, -300.0, 0.0026786250536)):
        # Stretches 1 + u t, 1 + v t, 1 + w t of the unit tet: the product's coefficients are the cubic's.
        roots = np.roots([1.0, -c, b, -a])
        if np.abs(roots.imag).max() > 0.0:
            pytest.fail("the case should come from real stretches")
        x = np.vstack([np.zeros(3), np.eye(3)])
        p = np.vstack([np.zeros(3), np.diag(roots.real)])
        step = largest_noninverting_step(x, p, [[0, 1, 2, 3]])
        assert step == pytest.approx(truth, rel=1e-6)


def test_steps_without_a_limit_are_whole():
    tets = [[0, 1, 2, 3]]
    assert largest_noninverting_step(REGULAR, np.zeros((4, 3)), tets) == 1.0
    assert largest_noninverting_step(REGULAR, np.ones((4, 3)), tets) == 1.0
    assert largest_noninverting_step(REGULAR, 5.0 * REGULAR, tets) == 1.0


def test_linear_root_and_keep():
    x = np.vstack([np.zeros(3), np.eye(3)])
    p = np.zeros((4, 3))
    p[3, 2] = -2.0
    assert largest_noninverting_step(x, p, [[0, 1, 2, 3]]) == pytest.approx(0.4, rel=1e-12)
    assert largest_noninverting_step(x, p, [[0, 1, 2, 3]], keep=0.5) == pytest.approx(0.25, rel=1e-12)


def test_inverted_tets_are_an_error_that_names_them_unless_ignored():
    x = np.vstack([REGULAR, REGULAR])
    p = np.zeros_like(x)
    p[3, 2] = -2.0
    tets = [[0, 1, 2, 3], [4, 6, 5, 7]]
    with pytest.raises(SolverError, match=r"1 of 2 tets .*tets 1"):
        largest_noninverting_step(x, p, tets)
    assert 0.0 < largest_noninverting_step(x, p, tets, ignore=[1]) < 1.0


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"direction": np.zeros((3, 3))}, "direction has shape"),
        ({"keep": 0.0}, "keep is 0"),
        ({"tets": [[0, 1, 2, 9]]}, "vertex 9"),
        ({"direction": np.full((4, 3), np.nan)}, "finite"),
        ({"ignore": [4]}, "ignore names tet 4"),
    ],
)
def test_errors(change, text):
    given = {"vertices": REGULAR, "direction": np.zeros((4, 3)), "tets": [[0, 1, 2, 3]]} | change
    with pytest.raises(SolverError, match=text):
        largest_noninverting_step(**given)


def test_kernel_names_the_limiting_tet_and_skips_unguarded():
    rng = np.random.default_rng(0)
    n = 1000
    x = np.tile(REGULAR, (n, 1)) + rng.normal(size=(4 * n, 3)) * 0.01
    p = rng.normal(size=(4 * n, 3)) * 0.01
    tets = np.arange(4 * n, dtype=np.int32).reshape(-1, 4)
    p[4 * 700 + 3] = (0.0, 0.0, -3.0)
    p[4 * 800 + 3] = (0.0, 0.0, -300.0)
    guarded = np.ones(n, dtype=np.bool_)
    assert noninverting_step(x, p, tets, guarded, 0.2)[1] == 800
    guarded[800] = False
    step, tet = noninverting_step(x, p, tets, guarded, 0.2)
    assert tet == 700
    assert step == largest_noninverting_step(x, p, tets, ignore=[800])


def test_volumes_are_kept_where_every_guarded_tet_has_a_positive_one():
    n = 600
    x = np.tile(REGULAR, (n, 1))
    tets = np.arange(4 * n, dtype=np.int32).reshape(-1, 4)
    Dm_inv = np.linalg.inv((x[tets[:, 1:]] - x[tets[:, :1]]).swapaxes(1, 2)).copy()
    guarded = np.ones(n, dtype=np.bool_)
    assert keeps_volume(x, tets, Dm_inv, guarded)
    for tet, height in ((300, -0.5), (400, 0.0), (500, np.nan)):
        bad = x.copy()
        bad[4 * tet + 3, 2] *= height
        assert not keeps_volume(bad, tets, Dm_inv, guarded)
        assert keeps_volume(bad, tets, Dm_inv, np.arange(n) != tet)
