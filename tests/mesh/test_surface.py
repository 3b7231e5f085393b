"""SurfaceMesh: what it accepts, what it rejects, and what it measures."""

import numpy as np
import pytest

from supple.errors import MeshError
from supple.mesh import shapes
from supple.mesh.surface import SurfaceMesh

CORNERS = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
TETRAHEDRON = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


def test_measures_of_a_tetrahedron():
    surface = SurfaceMesh(CORNERS, TETRAHEDRON)
    assert surface.volume == pytest.approx(1 / 6)
    assert surface.area == pytest.approx(1.5 + np.sqrt(3) / 2)
    assert surface.edges.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]
    assert surface.bounds[0].tolist() == [0, 0, 0]
    assert surface.bounds[1].tolist() == [1, 1, 1]
    assert surface.components.count == 1
    assert surface.flipped().volume == pytest.approx(-1 / 6)


def test_arrays_are_read_only_copies_of_the_right_kind():
    given = np.array(CORNERS, dtype=np.float32, order="F")
    surface = SurfaceMesh(given, np.array(TETRAHEDRON, dtype=np.uint64))
    assert surface.vertices.dtype == np.float64
    assert surface.vertices.flags.c_contiguous
    assert surface.triangles.dtype == np.int32
    assert surface.triangles.flags.c_contiguous
    given[0] = 7
    assert surface.vertices[0, 0] == 0
    with pytest.raises(ValueError):
        surface.vertices[0] = 1
    with pytest.raises(ValueError):
        surface.edges[0] = 1
    with pytest.raises(AttributeError):
        surface.vertices = given  # pyright: ignore[reportAttributeAccessIssue]


def test_volume_is_accurate_far_from_the_origin():
    surface = SurfaceMesh(CORNERS, TETRAHEDRON).transformed(scale=1e-3, translation=(100, 100, 100))
    assert surface.volume == pytest.approx(1e-9 / 6, rel=1e-6)


def test_components_and_compact():
    ball = shapes.sphere_surface(1.0, 0.7)
    two = SurfaceMesh(
        np.vstack([ball.vertices, [[9, 9, 9]], ball.vertices + 5]),
        np.vstack([ball.triangles, ball.triangles + len(ball.vertices) + 1]),
    )
    assert two.components.count == 2
    assert two.components.labels.tolist() == [0] * len(ball.triangles) + [1] * len(ball.triangles)
    assert len(two.used_vertices) == 2 * len(ball.vertices)
    small = two.compact()
    assert len(small.vertices) == 2 * len(ball.vertices)
    assert small.volume == pytest.approx(2 * ball.volume)
    assert two.bounds[1].max() < 7


def test_mirroring_keeps_triangles_outward():
    mirrored = SurfaceMesh(CORNERS, TETRAHEDRON).transformed(scale=(-1, 2, 1))
    assert mirrored.volume == pytest.approx(2 / 6)
    assert mirrored.bounds[0][0] == -1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"scale": 0}, "flatten"),
        ({"scale": np.nan}, "finite"),
        ({"rotation": np.eye(2)}, "rotation"),
        ({"translation": (1, 2)}, "translation"),
        ({"translation": (1, np.inf, 0)}, "finite"),
    ],
)
def test_bad_transforms_are_errors(arguments, words):
    with pytest.raises(MeshError, match=words):
        SurfaceMesh(CORNERS, TETRAHEDRON).transformed(**arguments)


@pytest.mark.parametrize(
    ("vertices", "triangles", "words"),
    [
        ([], TETRAHEDRON, "shape"),
        (np.empty((0, 3)), TETRAHEDRON, "vertices are missing"),
        (CORNERS, [], "triangles are missing"),
        (CORNERS, np.empty((0, 3), dtype=int), "triangles are missing"),
        (np.array(CORNERS)[:, :2], TETRAHEDRON, r"\(n, 3\)"),
        ("bear.stl", TETRAHEDRON, "real numbers"),
        ([[0, 0, 0], [1, 0]], TETRAHEDRON, "real numbers"),
        (np.array(CORNERS) * 1j, TETRAHEDRON, "real numbers"),
        ([*CORNERS[:3], [0, np.nan, 1]], TETRAHEDRON, "vertex 3 .*not finite"),
        ([[0, 0, np.inf], *CORNERS[1:]], TETRAHEDRON, "vertex 0 .*not finite"),
        ([*CORNERS[:3], [0, 1e200, 1]], TETRAHEDRON, "vertex 3 .*1e90"),
        (CORNERS, np.array(TETRAHEDRON, dtype=float), "integers"),
        (CORNERS, [[0, 1, 2, 3]], r"\(m, 3\)"),
        (CORNERS, [0, 1, 2], r"\(m, 3\)"),
        (CORNERS, [[0, 1, 2], [0, 1, 4]], "triangle 1 .*0 to 3"),
        (CORNERS, [[0, 1, 2], [-1, 1, 2]], "triangle 1 .*0 to 3"),
        (CORNERS, np.array(TETRAHEDRON) + 1, "1-based"),
        (CORNERS, [[0, 1, 2**40]], "triangle 0"),
        (CORNERS, [["a", "b", "c"]], "integers"),
        (CORNERS, [[True, False, True]], "integers"),
    ],
)
def test_malformed_arrays_are_errors_of_one_line(vertices, triangles, words):
    with pytest.raises(MeshError, match=words):
        SurfaceMesh(vertices, triangles)
