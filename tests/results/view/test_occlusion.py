"""Ambient occlusion: dark between surfaces that are near each other, and nowhere else."""

import numpy as np

import supple as sp
from supple.results.view.normals import vertex_normals
from supple.results.view.occlusion import occlusion


def surface_of(x, triangles):
    return x, triangles, vertex_normals(x, triangles)


def test_a_ball_alone_is_bright_and_two_that_touch_are_dark_between_them():
    ball = sp.shapes.sphere_surface(radius=1.0, edge_length=0.15)
    x, triangles = ball.vertices, ball.triangles
    (alone,) = occlusion([surface_of(x, triangles)], 1, [1])
    assert alone.max() < 0.06
    right = x + np.array([2.02, 0.0, 0.0])
    dark, other = occlusion([surface_of(x, triangles), surface_of(right, triangles)], 2, [1, 1])
    assert dark[x[:, 0] > 0.97].min() > 0.2
    assert dark[x[:, 0] < 0.5].max() < 0.06
    np.testing.assert_allclose(other[x[:, 0] < -0.97].mean(), dark[x[:, 0] > 0.97].mean(), rtol=0.2)


def test_vertices_of_large_triangles_are_left_alone():
    plate = sp.shapes.box_surface((4.0, 0.1, 4.0), (1, 1, 1))
    ball = sp.shapes.sphere_surface(radius=1.0, edge_length=0.15)
    above = ball.vertices + np.array([0.0, 1.1, 0.0])
    made = [surface_of(above, ball.triangles), surface_of(plate.vertices, plate.triangles)]
    assert not occlusion(made, 1, [1, 1])[1].any()
