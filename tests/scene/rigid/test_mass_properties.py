import numpy as np
import pytest

import supple as sp
from supple.scene.rigid.mass_properties import of_solid, with_inertia, with_mass

BOX = sp.shapes.box_surface((1.0, 2.0, 3.0), (1, 2, 3))


def box_moment(mass, size):
    return mass * np.diag(np.square(size)) / 12.0


def torus_of_polygons(n, section):
    """A torus whose sections at constant height are rings of regular n-gons: vertices (r, z) of `section` (m, 2)."""
    angles = 2.0 * np.pi * np.arange(n) / n
    vertices = np.array([[r * np.cos(a), r * np.sin(a), z] for a in angles for r, z in section])
    m, triangles = len(section), []
    for i in range(n):
        for j in range(m):
            a, b, c, d = i * m + j, (i + 1) % n * m + j, (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
            triangles += [[a, b, c], [a, c, d]]
    return sp.SurfaceMesh(vertices, triangles)


def moments_of_rings(n, section):
    """Volume, int x^2 and int z^2 of `torus_of_polygons`, by Gauss's rule, which is exact for these polynomials."""
    sine, cosine = np.sin(2.0 * np.pi / n), np.cos(2.0 * np.pi / n)
    places, weights = np.polynomial.legendre.leggauss(5)
    volume = across = along = 0.0
    # Going up on the outer side adds, going down on the inner side subtracts.
    for (r0, z0), (r1, z1) in zip(section, np.roll(section, -1, axis=0), strict=True):
        for place, weight in zip(0.5 + 0.5 * places, 0.5 * weights, strict=True):
            r, z, dz = r0 + place * (r1 - r0), z0 + place * (z1 - z0), weight * (z1 - z0)
            area = 0.5 * n * sine * r**2
            volume += area * dz
            across += 0.5 * n * sine * r**4 * (2.0 + cosine) / 12.0 * dz
            along += area * z**2 * dz
    return volume, across, along


def test_a_box_as_a_surface_and_as_tets():
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    shift = np.array([300.0, -20.0, 7.0])
    for shape in (BOX, sp.shapes.box((1.0, 2.0, 3.0), (2, 2, 2))):
        middle = 0.5 * (shape.vertices.min(axis=0) + shape.vertices.max(axis=0))
        found = of_solid(shape.transformed(rotation=turn, translation=shift), "box")
        assert found.volume == pytest.approx(6.0, rel=1e-12)
        np.testing.assert_allclose(found.center, turn @ middle + shift, rtol=1e-13)
        expected = turn @ box_moment(6.0, (1.0, 2.0, 3.0)) @ turn.T
        np.testing.assert_allclose(found.second_moment, expected, atol=1e-12 * 4.5)


def test_a_tetrahedron():
    # int x x^T over the unit corner: V / 10 on the diagonal, V / 20 off it; center 1/4.
    mesh = sp.TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])
    expected = (np.eye(3) / 20.0 + 1.0 / 20.0 - 1.0 / 16.0) / 6.0
    for shape in (mesh, mesh.surface):
        found = of_solid(shape, "corner")
        np.testing.assert_allclose(found.center, 0.25, rtol=1e-12)
        np.testing.assert_allclose(found.second_moment, expected, rtol=1e-12)
        np.testing.assert_allclose(found.inertia, np.trace(expected) * np.eye(3) - expected, rtol=1e-12)


def test_a_torus_mesh():
    angles = 2.0 * np.pi * np.arange(7) / 7
    section = np.column_stack([0.5 + 0.2 * np.cos(angles), 0.2 * np.sin(angles)])
    volume, across, along = moments_of_rings(11, section)
    found = of_solid(torus_of_polygons(11, section), "torus")
    assert found.volume == pytest.approx(volume, rel=1e-12)
    centered = along - volume * found.center[2] ** 2
    np.testing.assert_allclose(found.second_moment, np.diag([across, across, centered]), atol=1e-12 * across)
    np.testing.assert_allclose(np.diag(found.inertia), [across + centered] * 2 + [2.0 * across], rtol=1e-12)


def test_the_surface_of_a_tet_mesh_has_its_properties():
    mesh = sp.shapes.torus(0.5, 0.2, 0.15).transformed(translation=(4.0, 0.0, 0.0))
    tets, surface = of_solid(mesh, "torus"), of_solid(mesh.surface, "torus")
    assert surface.volume == pytest.approx(tets.volume, rel=1e-12)
    np.testing.assert_allclose(surface.center, tets.center, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(surface.second_moment, tets.second_moment, atol=1e-12 * tets.second_moment.max())


def test_mass_scales_the_moments_and_inertia_replaces_them():
    box = with_mass(of_solid(BOX, "box"), 12.0, "box")
    np.testing.assert_allclose(box.second_moment, box_moment(12.0, (1.0, 2.0, 3.0)), atol=1e-12)
    assert (box.mass, box.volume) == pytest.approx((12.0, 6.0))
    given = np.array([[3.0, 0.5, 0.0], [0.5, 4.0, 0.0], [0.0, 0.0, 5.0]])
    own = with_inertia(box, 2.0, given, "box")
    np.testing.assert_allclose(own.inertia, given, rtol=1e-14)
    np.testing.assert_allclose(with_inertia(box, 2.0, [3.0, 4.0, 5.0], "box").inertia, np.diag([3.0, 4.0, 5.0]))
    assert own.mass == 2.0


def without_a_triangle():
    return sp.SurfaceMesh(BOX.vertices, BOX.triangles[1:])


def one_triangle_turned():
    return sp.SurfaceMesh(BOX.vertices, np.concatenate([BOX.triangles[:1, ::-1], BOX.triangles[1:]]))


def two_sides_of_a_triangle():
    return sp.SurfaceMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 1]])


@pytest.mark.parametrize(
    ("shape", "text"),
    [
        (without_a_triangle, r"body 'b': its surface is not closed, .* \(3 edges\); repair it"),
        (one_triangle_turned, r"body 'b': its surface is not closed, or its triangles do not all face the same way"),
        (BOX.flipped, r"body 'b': its surface is inside out \(volume -6 m\^3\); give surface.flipped\(\)"),
        (two_sides_of_a_triangle, "body 'b': it contains no volume; give a solid with a thickness"),
    ],
)
def test_a_surface_that_is_not_the_boundary_of_a_solid(shape, text):
    with pytest.raises(sp.SceneError, match=text):
        of_solid(shape(), "body 'b'")


@pytest.mark.parametrize(
    ("inertia", "text"),
    [
        ([1.0, 1.0, -0.1], "has the principal moments -0.1, 1, 1; they must be above zero"),
        ([1.0, 2.0, 3.1], r"1, 2, 3.1; the two smaller ones together must be larger .* \(triangle inequality\)"),
        ([1.0, 2.0, 3.0], "triangle inequality"),
        ([[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], "inertia is not symmetric"),
        ([1.0, 1.0], r"inertia must be finite, \(3, 3\) or its diagonal"),
        ([1.0, 1.0, float("nan")], r"inertia must be finite"),
        ("round", "inertia is not an array of numbers"),
    ],
)
def test_an_inertia_tensor_that_no_body_has(inertia, text):
    with pytest.raises(sp.SceneError, match=rf"^body 'b': .*{text}"):
        with_inertia(of_solid(BOX, "body 'b'"), 1.0, inertia, "body 'b'")
