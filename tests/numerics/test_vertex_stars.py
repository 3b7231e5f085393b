"""Vertices of which the triangles are certainly apart."""

import numpy as np
import pytest

from supple.mesh import shapes
from supple.numerics.geometry.exact_crossings import triangles_meet
from supple.numerics.geometry.vertex_stars import simple_stars


def fan(angles, heights, closed=True):
    """Triangles about vertex 0, with the others at these angles and heights."""
    ring = np.column_stack([np.cos(angles), np.sin(angles), heights])
    x = np.vstack([np.zeros(3), ring])
    k = np.arange(1, len(x))
    triangles = np.column_stack([np.zeros_like(k), k, np.roll(k, -1)])
    return x, (triangles if closed else triangles[:-1]).astype(np.int32)


def meets(x, triangles):
    """Whether two triangles meet in more than what they share."""
    sides = np.zeros((2, 3), dtype=np.int64)
    return any(triangles_meet(x, triangles[i], triangles[j], sides) for i in range(len(triangles)) for j in range(i))


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_all_vertices_of_a_ball_are_simple(size):
    mesh = shapes.sphere(radius=size, edge_length=0.4 * size)
    simple = simple_stars(mesh.vertices.copy(), mesh.surface.triangles.copy())
    on_surface = np.unique(mesh.surface.triangles)
    assert simple[on_surface].all()
    assert not simple[np.setdiff1d(np.arange(len(simple)), on_surface)].any()


def test_a_star_that_winds_twice_is_not_simple():
    angles = np.linspace(0.0, 4.0 * np.pi, 9)[:-1] + 0.1
    x, triangles = fan(angles, 0.02 * np.arange(8))
    assert meets(x, triangles)
    assert not simple_stars(x, triangles)[0]


def test_a_star_with_ends_is_not_simple():
    x, triangles = fan(np.linspace(0.0, 2.2 * np.pi, 9), 0.02 * np.arange(9), closed=False)
    assert not simple_stars(x, triangles)[0]


def test_random_stars_are_simple_only_where_their_triangles_are_apart():
    rng = np.random.default_rng(3)
    found = []
    for _ in range(300):
        count = int(rng.integers(3, 9))
        turns = 1 if rng.random() < 0.8 else 2
        angles = np.arange(count) * turns * 2.0 * np.pi / count + rng.normal(scale=0.5, size=count)
        x, triangles = fan(angles, rng.normal(scale=0.7, size=count))
        x = x * rng.uniform(0.1, 10.0)
        found.append((bool(simple_stars(x, triangles)[0]), meets(x, triangles)))
    assert not any(simple and crosses for simple, crosses in found)
    assert sum(simple for simple, _ in found) > 50
    assert sum(crosses for _, crosses in found) > 50
