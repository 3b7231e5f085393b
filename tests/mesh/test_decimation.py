"""Surfaces with fewer triangles: their number, shape and faults."""

import logging

import numpy as np
import pytest

import supple as sp
from supple.errors import MeshingError
from supple.mesh.meshing.decimation import decimate_surface
from supple.mesh.meshing.tetrahedralize import tetrahedralize, tetrahedralize_reported
from supple.mesh.primitives.surfaces import sphere_surface
from supple.mesh.shapes import box
from supple.mesh.surface import SurfaceMesh
from supple.scene.rotation import rotation_matrix

BALL = sphere_surface(radius=0.5, edge_length=0.07)


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_a_ball_stays_a_closed_ball_of_any_size(size: float) -> None:
    reduced = decimate_surface(BALL.transformed(size), 400)
    assert len(reduced.triangles) == 400
    assert reduced.check().ok
    assert reduced.volume == pytest.approx(np.pi / 6.0 * size**3, rel=0.03)
    distances = np.linalg.norm(reduced.vertices, axis=1) / size
    assert np.abs(distances - 0.5).max() < 0.01


@pytest.mark.parametrize("rotation", [(0.0, 0.0, 0.0), (1.0, 2.0, 0.3)])
def test_edges_and_corners_of_a_box_stay(rotation: tuple[float, float, float]) -> None:
    turned = box((1.0, 2.0, 3.0), (6, 12, 18)).surface.compact().transformed(1.0, rotation_matrix(rotation))
    reduced = decimate_surface(turned, 100)
    assert len(reduced.triangles) == 100
    assert reduced.check().ok
    assert reduced.volume == pytest.approx(6.0, rel=1e-3)


def test_tets_of_a_surface_that_is_too_fine(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO):
        mesh = tetrahedralize(BALL, tets=200)
    assert len(mesh.tets) == pytest.approx(200, rel=0.25)
    assert f"decimated the surface: {len(BALL.triangles)} -> 1000 triangles, volume" in caplog.text


def test_triangles_that_shall_stay_give_more_tets_with_a_warning(caplog: pytest.LogCaptureFixture) -> None:
    mesh, report = tetrahedralize_reported(BALL, tets=800, keep_surface=True)
    assert not report.reduced
    assert f"{len(mesh.tets):,} tets instead of 800: the details of the surface need so many" in caplog.text
    assert len(mesh.surface.triangles) == len(BALL.triangles)


def test_a_surface_that_is_coarse_enough_is_returned() -> None:
    assert decimate_surface(BALL, len(BALL.triangles)) is BALL


@pytest.mark.parametrize("count", [3, 0, -5, 10.5, True])
def test_numbers_that_no_surface_has_are_refused(count: object) -> None:
    with pytest.raises(MeshingError, match="4 triangles or more"):
        decimate_surface(BALL, count)  # pyright: ignore[reportArgumentType]


def test_new_faults_are_refused() -> None:
    # The two sides of a thin shell cross where each has few triangles of its own.
    inside, outside = BALL.flipped(), BALL.transformed(1.02)
    shell = SurfaceMesh(
        np.vstack([outside.vertices, inside.vertices]),
        np.vstack([outside.triangles, inside.triangles + len(outside.vertices)]),
    )
    assert shell.check().ok
    with pytest.raises(MeshingError, match=r"to 300 triangles: .* intersecting .*; give a larger number"):
        decimate_surface(shell, 300)


def test_another_volume_is_refused() -> None:
    with pytest.raises(MeshingError, match=r"to 12 triangles: the volume changes from 0.519\d* to .* m\^3"):
        decimate_surface(BALL, 12)


def test_a_knot_is_reduced_without_folds():
    """The first order of collapses folds it at this number of triangles."""
    t, turn = np.linspace(0.0, 2.0 * np.pi, 241)[:-1, None], np.linspace(0.0, 2.0 * np.pi, 17)[:-1]
    center = np.hstack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)])
    ahead = np.roll(center, -1, axis=0) - np.roll(center, 1, axis=0)
    side = np.cross(ahead, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1)[:, None]
    across = np.cross(ahead, side)
    across /= np.linalg.norm(across, axis=1)[:, None]
    ring = np.cos(turn)[None, :, None] * side[:, None] + np.sin(turn)[None, :, None] * across[:, None]
    i, j = (item.ravel() for item in np.meshgrid(np.arange(240), np.arange(16), indexing="ij"))
    a, b, c, d = ((i + p) % 240 * 16 + (j + q) % 16 for p, q in ((0, 0), (1, 0), (1, 1), (0, 1)))
    triangles = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)])
    knot = sp.SurfaceMesh((center[:, None] + 0.588 * ring).reshape(-1, 3) / 30.0, triangles)
    assert knot.check().ok
    assert decimate_surface(knot, 332).check().ok
