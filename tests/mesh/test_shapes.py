"""Ready-made bodies: measures compared with analytic ones, quality, conformity, determinism."""

import numpy as np
import pytest

from supple.errors import MeshError
from supple.mesh import shapes

SPHERE, TORUS, CYLINDER = 4 / 3 * np.pi * 0.5**3, 2 * np.pi**2 * 0.5 * 0.2**2, np.pi * 0.5**2


def smallest_angle(surface):
    """Smallest angle of any triangle [degrees]."""
    corners = surface.vertices[surface.triangles]
    smallest = 180.0
    for k in range(3):
        a, b = (corners[:, (k + j) % 3] - corners[:, k] for j in (1, 2))
        cosine = np.einsum("ij,ij->i", a, b) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
        smallest = min(smallest, np.degrees(np.arccos(cosine.max())))
    return smallest


def mean_edge(mesh):
    return np.linalg.norm(np.diff(mesh.vertices[mesh.edges], axis=1), axis=2).mean()


@pytest.mark.parametrize("divisions", [(1, 1, 1), (2, 3, 4), (10, 1, 2)])
def test_box(divisions):
    mesh = shapes.box((1.0, 0.2, 0.3), divisions)
    a, b, c = divisions
    assert len(mesh.vertices) == (a + 1) * (b + 1) * (c + 1)
    assert len(mesh.tets) == 6 * a * b * c
    assert mesh.reoriented == 0
    assert mesh.volume == pytest.approx(0.06)
    assert np.ptp(mesh.volumes) < 1e-12
    assert np.allclose(mesh.surface.bounds, [(-0.5, -0.1, -0.15), (0.5, 0.1, 0.15)])
    assert len(mesh.surface.triangles) == 4 * (a * b + b * c + c * a)
    assert mesh.surface.check().ok
    # z runs fastest, then y, then x.
    expected = np.stack(np.meshgrid(*(np.linspace(-0.5, 0.5, n + 1) for n in divisions), indexing="ij"), -1)
    assert np.allclose(mesh.vertices, expected.reshape(-1, 3) * (1.0, 0.2, 0.3))


@pytest.mark.parametrize("edge_length", [0.5, 0.37, 0.21, 0.1, 0.06])
def test_sphere(edge_length):
    mesh = shapes.sphere(0.5, edge_length)
    assert mesh.min_dihedrals.min() > 18
    assert mesh.surface.check().ok
    assert mesh.components.count == 1
    on_surface = np.linalg.norm(mesh.vertices[mesh.surface.used_vertices], axis=1)
    assert np.abs(on_surface - 0.5).max() < 1e-12
    # Flat facets lose volume in proportion to the square of their size.
    assert 0 < 1 - mesh.volume / SPHERE < 0.4 * (edge_length / 0.5) ** 2
    if edge_length <= 0.21:
        assert mean_edge(mesh) == pytest.approx(edge_length, rel=0.1)


def test_sphere_is_symmetric_about_its_center():
    mesh = shapes.sphere(0.5, 0.11)
    center = (mesh.volumes[:, None] * mesh.vertices[mesh.tets].mean(axis=1)).sum(axis=0) / mesh.volume
    assert np.abs(center).max() < 1e-3
    assert np.allclose(mesh.surface.bounds, [(-0.5,) * 3, (0.5,) * 3])


@pytest.mark.parametrize("edge_length", [0.2, 0.13, 0.1, 0.07])
def test_torus(edge_length):
    mesh = shapes.torus(0.5, 0.2, edge_length)
    assert mesh.min_dihedrals.min() > 15
    assert mesh.surface.check().ok
    assert mesh.components.count == 1
    # Genus 1: as many vertices and facets as edges.
    surface = mesh.surface
    assert len(surface.used_vertices) - len(surface.edges) + len(surface.triangles) == 0
    assert 0 < 1 - mesh.volume / TORUS < 0.15 * (edge_length / 0.2) ** 2


@pytest.mark.parametrize(("edge_length", "dihedral"), [(0.5, 20), (0.25, 30), (0.1, 30), (0.07, 30)])
def test_cylinder(edge_length, dihedral):
    mesh = shapes.cylinder(0.5, 1.0, edge_length)
    assert mesh.min_dihedrals.min() > dihedral
    assert mesh.surface.check().ok
    assert np.allclose([mesh.surface.bounds[0][1], mesh.surface.bounds[1][1]], [-0.5, 0.5])
    sides = 6 * max(2, round(0.5 / edge_length))
    assert mesh.volume / CYLINDER == pytest.approx(sides / (2 * np.pi) * np.sin(2 * np.pi / sides))


@pytest.mark.parametrize(
    ("surface", "volume", "angle"),
    [
        (shapes.sphere_surface(0.5, 0.1), SPHERE, 50),
        (shapes.torus_surface(0.5, 0.2, 0.06), TORUS, 25),
        (shapes.cylinder_surface(0.5, 1.0, 0.06), CYLINDER, 40),
        (shapes.box_surface((1, 2, 3), (2, 4, 6)), 6.0, 44),
    ],
)
def test_surfaces_have_no_faults_and_even_triangles(surface, volume, angle):
    assert surface.check().ok
    assert smallest_angle(surface) > angle
    assert surface.volume == pytest.approx(volume, rel=0.03)
    assert len(surface.used_vertices) == len(surface.vertices)


def test_sphere_surface_counts_and_edge_length():
    surface = shapes.sphere_surface(1.0, 0.2)
    n = 6  # ceil(arctan(2) / 0.2)
    assert len(surface.vertices) == 10 * n**2 + 2
    assert len(surface.triangles) == 20 * n**2
    assert np.allclose(np.linalg.norm(surface.vertices, axis=1), 1)
    assert 0.15 < mean_edge(surface) < 0.21


@pytest.mark.parametrize("make", [shapes.sphere, shapes.torus, shapes.cylinder, shapes.box, shapes.sphere_surface])
def test_the_same_bits_every_time(make):
    first, second = make(), make()
    assert np.array_equal(first.vertices, second.vertices)
    elements = "tets" if hasattr(first, "tets") else "triangles"
    assert np.array_equal(getattr(first, elements), getattr(second, elements))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: shapes.box((1, 0, 1)), r"box: size is \(1, 0, 1\)"),
        (lambda: shapes.box((1, 1)), "three positive"),
        (lambda: shapes.box((1, np.nan, 1)), "three positive"),
        (lambda: shapes.box(divisions=(1, 0, 1)), "divisions is"),
        (lambda: shapes.box(divisions=(1, 1.5, 1)), "whole numbers"),  # pyright: ignore[reportArgumentType]
        (lambda: shapes.box(divisions=(9999, 9999, 9999)), "divisions smaller"),
        (lambda: shapes.sphere(-1), "radius is -1"),
        (lambda: shapes.sphere(1, "a"), "edge_length is 'a'"),  # pyright: ignore[reportArgumentType]
        (lambda: shapes.sphere(1, 2), "shorter"),
        (lambda: shapes.sphere(1, 1e-5), "longer"),
        (lambda: shapes.sphere(1e200, 0.1), r"radius is 1e\+200"),
        (lambda: shapes.cylinder(1e300, 1e300), r"radius is 1e\+300"),
        (lambda: shapes.box((1e300, 1, 1), (1, 1, 1)), "of 1e90 at most"),
        (lambda: shapes.cylinder(1, np.inf), "height is inf"),
        (lambda: shapes.cylinder(1, 0.1, 0.2), "height = 0.1"),
        (lambda: shapes.cylinder(1, 1, 1e-4), "longer"),
        (lambda: shapes.torus(0.2, 0.3), "closes the ring"),
        (lambda: shapes.torus(1, 0.1, 0.2), "tube_radius"),
        (lambda: shapes.sphere_surface(1, 1e-5), "longer"),
        (lambda: shapes.torus_surface(1, 0.1, 1e-5), "longer"),
    ],
)
def test_impossible_sizes_are_errors(make, words):
    with pytest.raises(MeshError, match=words):
        make()


def test_a_spherical_shell_has_two_surfaces_on_its_radii():
    shell = shapes.spherical_shell(0.1, 0.15, 0.03)
    radii = np.linalg.norm(shell.vertices[shell.surface.used_vertices], axis=1)
    assert set(radii.round(9)) == {0.1, 0.15}
    assert shell.surface.components.count == 2
    assert shell.volume == pytest.approx(4 / 3 * np.pi * (0.15**3 - 0.1**3), rel=0.03)
    with pytest.raises(MeshError, match=r"inner_radius = 0.2 m is not below outer_radius = 0.15 m"):
        shapes.spherical_shell(0.2, 0.15, 0.01)


@pytest.mark.parametrize(("sides", "edge", "cells"), [((0.3, 0.2), 0.1, (3, 2)), ((1.0, 0.35), None, (29, 10))])
def test_a_sheet_has_cells_of_its_edge_and_no_direction(sides, edge, cells):
    sheet = shapes.sheet(*sides, edge)
    assert len(sheet.triangles) == 2 * cells[0] * cells[1]
    assert np.allclose(sheet.area_vectors.sum(axis=0), [0.0, sides[0] * sides[1], 0.0])
    assert np.all(sheet.area_vectors[:, 1] > 0.0)
    assert np.allclose(sheet.bounds, [(-0.5 * sides[0], 0.0, -0.5 * sides[1]), (0.5 * sides[0], 0.0, 0.5 * sides[1])])
    ends = sheet.vertices[sheet.edges]
    diagonals = (ends[:, 1] - ends[:, 0])[:, [0, 2]]
    diagonals = diagonals[np.abs(diagonals).min(axis=1) > 1e-9]
    rising = np.count_nonzero(diagonals.prod(axis=1) > 0.0)
    assert abs(rising - (len(diagonals) - rising)) <= 1
    with pytest.raises(MeshError, match=r"sheet: edge_length = 0.5 m is longer than shorter side = 0.2 m"):
        shapes.sheet(0.3, 0.2, 0.5)
