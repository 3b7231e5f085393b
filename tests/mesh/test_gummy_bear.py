"""The gummy bear as tets and as a surface: closed, well shaped, and oriented."""

import numpy as np
import pytest

from supple.errors import MeshError
from supple.mesh.primitives.gummy_bear import bear_distance, gummy_bear, gummy_bear_surface


@pytest.mark.parametrize("edge_length", [0.14, 0.1, 0.08, 0.05])
def test_tets(edge_length):
    bear = gummy_bear(1.0, edge_length)
    assert bear.min_dihedrals.min() > 10
    assert bear.components.count == 1
    assert bear.surface.check().ok
    assert 0.09 < bear.volume < 0.12


@pytest.mark.parametrize("resolution", [16, 32, 48])
def test_surface(resolution):
    skin = gummy_bear_surface(1.0, resolution)
    report = skin.check()
    assert report.ok, report
    assert report.component_count == 1
    # A ball with limbs: Euler's number is 2.
    assert len(skin.vertices) - len(skin.edges) + len(skin.triangles) == 2
    assert skin.volume == pytest.approx(0.118, rel=0.03)
    corners = skin.vertices[skin.triangles]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    heights = 2 * np.linalg.norm(skin.area_vectors, axis=1) / sides.max(axis=1)
    assert (heights / sides.max(axis=1)).min() > 0.15  # no slivers


def test_height_and_place():
    low, high = gummy_bear_surface(0.02, 40).bounds
    assert high[1] - low[1] == pytest.approx(0.02, rel=0.02)
    assert np.abs(low + high).max() < 0.02 * 0.02
    assert gummy_bear(0.02, 0.0016).volume == pytest.approx(0.02**3 * gummy_bear(1.0, 0.08).volume)


def test_it_is_symmetric_and_looks_along_z():
    points = np.random.default_rng(0).uniform((-0.3, 0, -0.3), (0.3, 1, 0.4), (500, 3))
    assert np.array_equal(bear_distance(points), bear_distance(points * (-1, 1, 1)))
    nose, back_of_head = bear_distance(np.array([[0, 0.713, 0.29], [0, 0.713, -0.2]]))
    assert nose < 0 < back_of_head
    ear, between = bear_distance(np.array([[0.15, 0.97, -0.01], [0, 0.97, -0.01]]))
    assert ear < 0 < between


def test_tets_and_surface_have_the_same_shape():
    # Vertices of the tets' surface lie on the implicit surface of the bear.
    bear = gummy_bear(1.0, 0.08)
    skin = gummy_bear_surface(1.0, 48)
    middle = np.array([0.0, 0.5, 0.07])  # the bear of height 1 stands on y = 0
    assert np.abs(bear_distance(bear.vertices[bear.surface.used_vertices] + middle)).max() < 1e-9
    assert np.abs(bear_distance(skin.vertices + middle)).max() < 1e-5


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: gummy_bear(0), "height is 0"),
        (lambda: gummy_bear(1.0, 0.2), "a seventh of the height"),
        (lambda: gummy_bear(1.0, 1e-5), "longer"),
        (lambda: gummy_bear_surface(1.0, 5), "resolution is 5"),
        (lambda: gummy_bear_surface(1.0, 32.5), "whole number"),  # pyright: ignore[reportArgumentType]
        (lambda: gummy_bear_surface(1.0, 10**6), "smaller"),
        (lambda: gummy_bear_surface(float("nan")), "height is nan"),
    ],
)
def test_impossible_sizes_are_errors(make, words):
    with pytest.raises(MeshError, match=words):
        make()
