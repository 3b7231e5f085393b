"""Repair: what it changes, that it reports each change, and that it drops nothing silently."""

import importlib.util
import logging

import numpy as np
import pytest

from supple.errors import MeshingError
from supple.mesh.meshing import facing
from supple.mesh.meshing.repair import repair_surface
from supple.mesh.meshing.tetrahedralize import tetrahedralize, tetrahedralize_reported
from supple.mesh.primitives.surfaces import sphere_surface
from supple.mesh.surface import SurfaceMesh

BALL = sphere_surface(radius=0.5, edge_length=0.25)
FAR = BALL.transformed(translation=(2, 0, 0))

needs_meshfix = pytest.mark.skipif(importlib.util.find_spec("pymeshfix") is None, reason="needs pymeshfix")


def both(first: SurfaceMesh, second: SurfaceMesh) -> SurfaceMesh:
    return SurfaceMesh(
        np.concatenate([first.vertices, second.vertices]),
        np.concatenate([first.triangles, second.triangles + len(first.vertices)]),
    )


def test_a_clean_surface_is_unchanged(caplog: pytest.LogCaptureFixture) -> None:
    repaired, report = repair_surface(BALL)
    assert repaired is BALL
    assert report.steps == ()
    assert caplog.text == ""


def test_duplicates_and_collapsed_triangles_are_dropped() -> None:
    triangles = np.vstack([BALL.triangles, BALL.triangles[:2, [1, 2, 0]], [[4, 4, 7], [3, 3, 3]]])
    repaired, report = repair_surface(SurfaceMesh(np.vstack([BALL.vertices, [[5, 5, 5]]]), triangles))
    np.testing.assert_array_equal(repaired.vertices, BALL.vertices)
    assert len(repaired.triangles) == len(BALL.triangles)
    assert report.after.ok
    assert report.steps[0] == "dropped 2 triangles that had a vertex twice"
    assert report.steps[1] == "dropped 2 triangles that repeated others"
    assert report.steps[2] == "dropped 1 vertices that no triangle uses"


@pytest.mark.parametrize("seed", range(3))
def test_mixed_orientation_is_made_to_agree(seed: int, caplog: pytest.LogCaptureFixture) -> None:
    surface = both(BALL, FAR)
    turned = np.random.default_rng(seed).random(len(surface.triangles)) < 0.4
    triangles = np.where(turned[:, None], surface.triangles[:, ::-1], surface.triangles)
    repaired, report = repair_surface(SurfaceMesh(surface.vertices, triangles))
    assert repaired.volume == pytest.approx(2 * BALL.volume, rel=1e-12)
    assert report.after.ok
    assert "to agree with their neighbours" in caplog.text
    assert report.volume_change > 0


def test_an_inward_surface_is_turned() -> None:
    repaired, report = repair_surface(BALL.flipped())
    assert repaired.volume == pytest.approx(BALL.volume)
    assert report.steps == ("reoriented 1 components that faced the wrong way",)


def test_a_one_sided_surface_cannot_be_oriented() -> None:
    """A Moebius strip: some neighbours disagree however its triangles are turned."""
    n = 12
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    middle = np.stack([np.cos(angle), np.sin(angle), np.zeros(n)], axis=1)
    across = 0.2 * np.stack(
        [np.cos(angle / 2) * np.cos(angle), np.cos(angle / 2) * np.sin(angle), np.sin(angle / 2)], axis=1
    )
    vertices = np.concatenate([middle + across, middle - across])
    quads = [(k, k + 1, n + k + 1, n + k) for k in range(n - 1)] + [(n - 1, n, 0, 2 * n - 1)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], dtype=np.int32)
    assert facing._disagreeing(triangles, len(vertices)) is None


@needs_meshfix
def test_holes_are_filled_and_other_components_kept() -> None:
    """MeshFix alone keeps only the largest component."""
    holed = SurfaceMesh(BALL.vertices, BALL.triangles[4:])
    repaired, report = repair_surface(both(holed, FAR))
    assert report.before.component_count == report.after.component_count == 2
    assert report.after.ok
    assert repaired.volume == pytest.approx(2 * BALL.volume, rel=0.02)
    assert any("MeshFix repaired component 0 of 2" in step for step in report.steps)
    assert "2 -> 2 components" in str(report)


@needs_meshfix
def test_a_lost_component_is_an_error_unless_allowed() -> None:
    """A single triangle has no inside: MeshFix keeps nothing of it."""
    single = SurfaceMesh([[3, 0, 0], [3.1, 0, 0], [3, 0.1, 0]], [[0, 1, 2]])
    surface = both(BALL, single)
    with pytest.raises(MeshingError, match=r"would drop all of component 1 of 2 \(1 triangles;.*allow_lost_components"):
        repair_surface(surface)
    repaired, report = repair_surface(surface, allow_lost_components=True)
    assert len(repaired.triangles) == len(BALL.triangles)
    assert any(step.startswith("dropped component 1 of 2") for step in report.steps)
    assert report.after.component_count == 1


@needs_meshfix
def test_components_that_cut_each_other_cannot_be_repaired() -> None:
    with pytest.raises(MeshingError, match=r"could not fix the surface: .*intersecting.*stuffing"):
        repair_surface(both(BALL, BALL.transformed(translation=(0.4, 0.01, 0.02))))


def test_without_meshfix_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(MeshingError, match=r'open boundary edge.*pip install "supple\[dirty\]"'):
        repair_surface(SurfaceMesh(BALL.vertices, BALL.triangles[4:]))


def test_collapsed_triangles_alone_are_an_error() -> None:
    with pytest.raises(MeshingError, match="none of its triangles"):
        repair_surface(SurfaceMesh(np.eye(3), [[0, 0, 1], [1, 1, 2]]))


@needs_meshfix
def test_repair_comes_before_meshing(caplog: pytest.LogCaptureFixture) -> None:
    mesh, report = tetrahedralize_reported(SurfaceMesh(BALL.vertices, BALL.triangles[4:]), repair=True)
    assert report.mesher == "tetgen"
    assert report.repair is not None
    assert mesh.volume == pytest.approx(BALL.volume, rel=0.03)
    assert "repaired the surface" in caplog.text


def _with_seam(gap: float) -> SurfaceMesh:
    """The ball, its upper part a component of its own, `gap` [m] above the lower part."""
    up = BALL.vertices[BALL.triangles].mean(axis=1)[:, 2] > 0
    upper = SurfaceMesh(BALL.vertices, BALL.triangles[up]).compact().transformed(translation=(0, 0, gap))
    return both(SurfaceMesh(BALL.vertices, BALL.triangles[~up]).compact(), upper)


SINGLE_TRIANGLE = SurfaceMesh([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], [[0, 1, 2]])
BEYOND_REPAIR = {
    "two balls that overlap": (both(BALL, BALL.transformed(translation=(0.4, 0.01, 0.0))), 0.777),
    "an open seam": (_with_seam(1e-4), BALL.volume),
    "a single triangle inside": (both(BALL, SINGLE_TRIANGLE), BALL.volume),
}


@needs_meshfix
@pytest.mark.parametrize("case", BEYOND_REPAIR)
def test_what_meshes_without_repair_meshes_with_it(case: str, caplog: pytest.LogCaptureFixture) -> None:
    """MeshFix cannot repair these surfaces; a union and stuffing need no repair."""
    surface, volume = BEYOND_REPAIR[case]
    with caplog.at_level(logging.INFO):
        mesh, report = tetrahedralize_reported(surface, repair=True)
    assert mesh.volume == pytest.approx(volume, rel=0.03)
    assert report.mesher == ("mmg" if case == "two balls that overlap" else "stuffing")
    assert report.repair is None
    said = "their union is filled" if report.mesher == "mmg" else "meshing the surface without repair"
    assert said in caplog.text


@needs_meshfix
@pytest.mark.parametrize("demand", [{"mesher": "tetgen"}, {"keep_surface": True}], ids=str)
def test_a_failed_repair_is_an_error_where_the_options_need_tetgen(demand: dict) -> None:
    with pytest.raises(MeshingError, match=r"repair could not fix the surface: .*intersecting"):
        tetrahedralize(BEYOND_REPAIR["two balls that overlap"][0], repair=True, **demand)


SOUP = SurfaceMesh(BALL.vertices[BALL.triangles].reshape(-1, 3), np.arange(BALL.triangles.size).reshape(-1, 3))


@pytest.mark.parametrize("surface", [SOUP, both(BALL, BALL), _with_seam(0.0)], ids=["soup", "two hulls", "seam"])
def test_vertices_at_the_same_place_are_merged(surface: SurfaceMesh) -> None:
    repaired, report = repair_surface(surface)
    assert len(repaired.vertices) == len(BALL.vertices)
    assert repaired.volume == pytest.approx(BALL.volume, rel=1e-12)
    merged = len(surface.vertices) - len(BALL.vertices)
    assert report.steps[0] == f"merged {merged} vertices with others at the same place"
