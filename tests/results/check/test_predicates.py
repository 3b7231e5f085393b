"""The exact predicates against rational arithmetic, on input where floating point alone is wrong."""

from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from supple.results.check.geometry.containment import is_inside
from supple.results.check.geometry.orientation import area_sign, plane_sides, volume_sign, volume_signs
from supple.results.check.geometry.triangle_pairs import triangles_meet

# Few values on a coarse grid: most points are coplanar, collinear or equal; then moved by a bit or two, or not at all.
STEPS = st.integers(-2, 2)
SCALES = st.sampled_from([1e-9, 0.1, 1.0, 1e3, 1e-120, 1e110])
BITS = st.sampled_from([0, 0, 0, 0, -1, 1, 3])


@st.composite
def points(draw, count):
    scale = draw(SCALES)
    offset = draw(st.sampled_from([0.0, 0.0, 1e3, 1.0 / 3.0])) * scale
    grid = np.array([[draw(STEPS) for _ in range(3)] for _ in range(count)], dtype=np.float64)
    bits = np.array([[draw(BITS) for _ in range(3)] for _ in range(count)])
    x = grid * (scale * 0.1) + offset
    return np.ascontiguousarray(x + bits * np.spacing(x))


@settings(max_examples=200, deadline=None)
@given(points(4))
def test_the_side_of_a_plane_is_exact(x):
    assert volume_sign(x, 0, 1, 2, 3) == exact_volume_sign(*x)


@settings(max_examples=200, deadline=None)
@given(points(3))
def test_the_side_of_a_line_is_exact(x):
    for i, j in ((0, 1), (1, 2), (2, 0)):
        a, b, c = map(exact, x)
        (p, q), (r, s) = ((end[i] - a[i], end[j] - a[j]) for end in (b, c))
        assert area_sign(x, 0, 1, 2, i, j) == sign(p * s - q * r)


@settings(max_examples=200, deadline=None)
@given(points(3))
def test_the_side_of_a_half_space_is_exact(x):
    p, point, normal = map(exact, x)
    assert plane_sides(x, np.array([0]), x[1], x[2])[0] == sign(dot(minus(p, point), normal))


def test_floating_point_alone_is_wrong_on_such_points():
    # Otherwise these tests would prove nothing.
    rng = np.random.default_rng(1)
    x = rng.integers(-2, 3, (4000, 3)) * 0.1 + 1.0 / 3.0
    tets = np.arange(4000, dtype=np.int32).reshape(-1, 4)
    D = x[tets[:, 1:]] - x[tets[:, :1]]
    naive = np.sign(np.einsum("ij,ij->i", D[:, 0], np.cross(D[:, 1], D[:, 2])))
    exact = volume_signs(x, tets)
    truth = [exact_volume_sign(*x[tet]) for tet in tets]
    np.testing.assert_array_equal(exact, truth)
    assert np.count_nonzero(naive != truth) > 5


def exact(p):
    return tuple(Fraction(float(v)) for v in p)


def minus(p, q):
    return tuple(a - b for a, b in zip(p, q, strict=True))


def dot(p, q):
    return sum((a * b for a, b in zip(p, q, strict=True)), Fraction(0))


def cross(p, q):
    return (p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0])


def sign(value):
    return (value > 0) - (value < 0)


def exact_volume_sign(a, b, c, d):
    a, b, c, d = map(exact, (a, b, c, d))
    return sign(dot(minus(b, a), cross(minus(c, a), minus(d, a))))


def clipped(polygon, origin, normal):
    """The part of a convex polygon, segment or point with (p - origin) . normal >= 0."""
    sides = [dot(minus(p, origin), normal) for p in polygon]
    kept = []
    for k, p in enumerate(polygon):
        q, at_p, at_q = polygon[k - 1], sides[k], sides[k - 1]
        if at_p * at_q < 0:
            t = at_q / (at_q - at_p)
            kept.append(tuple(a + t * (b - a) for a, b in zip(q, p, strict=True)))
        if at_p >= 0:
            kept.append(p)
    return kept


def common_part(A, B):
    """Corners of what two triangles with area have in common: another algorithm than the one that is tested."""
    A, B = [exact(p) for p in A], [exact(p) for p in B]
    normal = cross(minus(A[1], A[0]), minus(A[2], A[0]))
    part = clipped(clipped(B, A[0], normal), A[0], tuple(-v for v in normal))
    for k in range(3):
        side = minus(A[(k + 1) % 3], A[k])
        part = clipped(part, A[k], cross(normal, side))
    return part


def has_area(A):
    A = [exact(p) for p in A]
    return any(cross(minus(A[1], A[0]), minus(A[2], A[0])))


@settings(max_examples=200, deadline=None)
@given(points(6))
def test_degenerate_triangles_meet_exactly_where_they_have_a_common_point(x):
    if has_area(x[:3]) and has_area(x[3:]):
        s, t = np.array([0, 1, 2]), np.array([3, 4, 5])
        assert triangles_meet(x, s, t) == bool(common_part(x[:3], x[3:]))
        assert triangles_meet(x, t, s[[1, 2, 0]]) == bool(common_part(x[:3], x[3:]))


@settings(max_examples=300, deadline=None)
@given(points(5), st.permutations([0, 1, 2]))
def test_neighbours_with_a_common_corner(x, order):
    s, t = np.array([0, 1, 2]), np.array([0, 3, 4])[list(order)]
    if has_area(x[s]) and has_area(x[t]):
        beyond = any(p != exact(x[0]) for p in common_part(x[s], x[t]))
        assert triangles_meet(x, s, t) == beyond


@settings(max_examples=300, deadline=None)
@given(points(4), st.permutations([0, 1, 2]))
def test_neighbours_with_a_common_side(x, order):
    s, t = np.array([0, 1, 2]), np.array([1, 0, 3])[list(order)]
    if has_area(x[s]) and has_area(x[t]):
        a, side = exact(x[0]), minus(exact(x[1]), exact(x[0]))
        beyond = any(any(cross(minus(p, a), side)) for p in common_part(x[s], x[t]))
        assert triangles_meet(x, s, t) == beyond


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e3])
def test_a_corner_one_bit_through_a_triangle(scale):
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.25, 0.25, 0], [0.3, 0.2, 1], [0.2, 0.3, 1]]) * scale
    s, t = np.array([0, 1, 2]), np.array([3, 4, 5])
    assert triangles_meet(x, s, t)
    for depth, meets in ((5e-324, False), (1e-250, False), (-1e-250, True), (-5e-324, True)):
        x[3, 2] = depth
        assert triangles_meet(x, s, t) == meets, depth


def test_points_in_and_out_of_a_box_whose_faces_rays_meet_at_corners():
    corners = np.array([[i, j, k] for i in (0.0, 1.0) for j in (0.0, 1.0) for k in (0.0, 1.0)])
    faces = [(0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7), (0, 5, 1), (0, 4, 5)]
    faces += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
    x = np.concatenate([corners, np.zeros((2, 3))])
    triangles, rows = np.array(faces), np.arange(12)
    inside = [0.5, 1e-12, 1.0 - 1e-12, 0.25]
    for p in permutations(inside, 3):
        assert is_inside(x, np.array(p), triangles, rows)
    for p in ([1.0 + 1e-12, 0.5, 0.5], [0.5, -1e-300, 0.5], [2.0, 2.0, 2.0]):
        assert not is_inside(x, np.array(p), triangles, rows)
