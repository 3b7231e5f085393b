"""Tets of the size that was asked for, in surfaces as CAD programs and scanners give them."""

import logging

import numpy as np
import pytest
from tests.mesh.cad_parts import CLEAN, cup, housing, joined, noisy_scan, overlapping, turned_tetrahedron

from supple.errors import MeshingError
from supple.mesh.meshing.option_names import named_for
from supple.mesh.meshing.sizes import asking
from supple.mesh.meshing.tetrahedralize import tetrahedralize, tetrahedralize_reported
from supple.mesh.shapes import box_surface, sphere_surface


def heights(mesh):
    """The smallest height of each tet over the mean edge."""
    inverse = mesh.rest_shape_inverse
    all_four = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)
    edges = mesh.vertices[mesh.edges]
    return 1.0 / np.linalg.norm(all_four, axis=2).max(axis=1) / np.linalg.norm(edges[:, 0] - edges[:, 1], axis=1).mean()


@pytest.mark.parametrize("name", CLEAN)
def test_clean_parts_get_the_number_the_volume_and_the_shape(name, caplog):
    surface = CLEAN[name]()
    assert surface.check().ok
    mesh, report = tetrahedralize_reported(surface, tets=1500)
    assert report.mesher == "mmg"
    assert len(mesh.tets) == pytest.approx(1500, rel=0.25)
    assert mesh.volume == pytest.approx(surface.volume, rel=5e-3)
    edge = np.linalg.norm(np.diff(mesh.vertices[mesh.edges], axis=1), axis=2).mean()
    assert report.distance < 0.3 * edge
    assert mesh.components.count == 1
    assert np.percentile(heights(mesh), 1) > 0.03
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


def test_sharp_edges_and_corners_stay():
    box = box_surface((0.06, 0.03, 0.02), (1, 1, 1))
    mesh, report = tetrahedralize_reported(box, edge=0.006)
    assert report.distance < 1e-9
    assert mesh.volume == pytest.approx(box.volume, rel=1e-12)
    assert np.median(mesh.min_dihedrals) > 35
    lengths = np.linalg.norm(np.diff(mesh.vertices[mesh.edges], axis=1), axis=2)
    assert lengths.mean() == pytest.approx(0.006, rel=0.25)


def test_a_tetrahedron_with_two_turned_triangles_is_turned_first(caplog):
    caplog.set_level("INFO")
    mesh, report = tetrahedralize_reported(turned_tetrahedron(), tets=500)
    assert report.mesher == "mmg"
    assert mesh.volume == pytest.approx(0.05**3 / 6, rel=1e-6)
    assert "reoriented 2 triangles to agree" in caplog.text


def test_shells_that_overlap_are_united(caplog):
    """With sharp edges, and with the volume of the union."""
    caplog.set_level("INFO")
    mesh, report = tetrahedralize_reported(overlapping(), tets=1500)
    assert report.mesher == "mmg"
    assert len(mesh.tets) == pytest.approx(1500, rel=0.15)
    assert 1.98e-5 < mesh.volume < 2.0e-5
    assert "2 components of the surface overlap: their union is filled" in caplog.text


def test_surfaces_with_holes_keep_their_volume_in_a_lattice(caplog):
    mesh, report = tetrahedralize_reported(noisy_scan(), tets=1500)
    assert report.mesher == "stuffing"
    assert len(mesh.tets) == pytest.approx(1500, rel=0.25)
    assert 1.25e-4 < mesh.volume < 1.4e-4
    assert mesh.min_dihedrals.min() > 8
    assert "which rounds sharp edges" in caplog.text


def test_sides_of_a_gap_that_is_narrower_than_tets_do_not_pass_each_other(caplog):
    """A ball in a hollow one, 5 mm from it at edges of .2 m: both are joined, with a warning, and start apart."""
    ball = sphere_surface(0.5, 0.1)
    sizes = [(1.0, False), (0.8, True), (0.79, False)]
    shells = [ball.transformed(size).flipped() if inner else ball.transformed(size) for size, inner in sizes]
    mesh = tetrahedralize(joined(*shells), tets=1500)
    assert not mesh.surface.compact().check().self_intersecting
    assert "gaps of the surface are narrower than tets" in caplog.text
    assert mesh.volume == pytest.approx(sum(shell.volume for shell in shells), rel=0.02)


def test_walls_that_need_more_tets_get_them_with_a_warning(caplog):
    surface = cup(0.8)
    mesh = tetrahedralize(surface, tets=800)
    assert "walls are 0.00082 m thick on average" in caplog.text
    assert 800 < len(mesh.tets) < 8000
    assert mesh.volume == pytest.approx(surface.volume, rel=5e-3)


def test_ten_times_the_tets_are_a_question():
    surface = housing(0.0005)
    with pytest.raises(MeshingError, match=r"walls are 0.0005 m .* about 170,743, 85 times .* \(tets=180000\)"):
        tetrahedralize(surface, tets=2000)
    asked = []
    with (
        named_for("shell"),
        asking(asked.append, "--yes"),
        pytest.raises(MeshingError, match=r"--tets 180000, --yes"),
    ):
        tetrahedralize(surface, tets=2000)
    assert "85 times the 2,000 that were asked for" in asked[0]


def test_a_wall_around_a_cavity_is_filled_and_the_cavity_is_not():
    surface = housing(0.02)
    mesh = tetrahedralize(surface, tets=2000)
    assert len(mesh.tets) == pytest.approx(2000, rel=0.25)
    assert mesh.volume == pytest.approx(surface.volume, rel=1e-9)


def test_the_sides_of_a_thin_wall_do_not_pass_each_other():
    surface = cup()
    mesh = tetrahedralize(surface, tets=2000)
    assert not mesh.surface.check().self_intersecting
    assert mesh.volume == pytest.approx(surface.volume, rel=0.02)
