"""SurfaceMesh.check: each fault is found, counted and located."""

import numpy as np
import pytest

from supple.mesh import shapes
from supple.mesh.surface import SurfaceMesh
from supple.mesh.surface_checks import MAX_INTERSECTIONS
from supple.numerics.geometry.winding_number import winding_number

BALL = shapes.sphere_surface(1.0, 0.4)


def joined(*surfaces):
    """Several surfaces as one."""
    shifts = np.cumsum([0] + [len(s.vertices) for s in surfaces])
    return SurfaceMesh(
        np.vstack([s.vertices for s in surfaces]),
        np.vstack([s.triangles + shift for s, shift in zip(surfaces, shifts[:-1], strict=True)]),
    )


@pytest.mark.parametrize(
    "surface",
    [BALL, shapes.box_surface(), shapes.torus_surface(), shapes.cylinder_surface(), shapes.sphere().surface],
)
def test_surfaces_without_faults_have_no_problems(surface):
    report = surface.check()
    assert report.ok
    assert report.problems == []
    assert report.watertight
    assert report.consistently_oriented
    assert report.outward
    assert not report.self_intersecting
    assert report.component_count == 1
    assert "nothing wrong" in str(report)


def test_a_hole_is_reported_by_its_edges():
    report = SurfaceMesh(BALL.vertices, BALL.triangles[1:]).check()
    assert not report.watertight
    assert not report.ok
    assert sorted(map(tuple, report.open_edges.tolist())) == sorted(
        tuple(sorted((int(a), int(b)))) for a, b in zip(BALL.triangles[0], np.roll(BALL.triangles[0], -1), strict=True)
    )
    (line,) = report.problems
    assert line.startswith("3 open boundary edges: the first is between vertices")


def test_a_fin_is_a_non_manifold_edge():
    a, b = BALL.triangles[0][:2]
    vertices = np.vstack([BALL.vertices, 2 * BALL.vertices[a]])
    report = SurfaceMesh(vertices, np.vstack([BALL.triangles, [[a, b, len(BALL.vertices)]]])).check()
    assert report.non_manifold_edges.tolist() == [sorted([int(a), int(b)])]
    assert len(report.open_edges) == 2
    assert any("1 non-manifold edge" in line for line in report.problems)


def test_one_turned_triangle_is_inconsistent():
    triangles = BALL.triangles.copy()
    triangles[7] = triangles[7][::-1]
    report = SurfaceMesh(BALL.vertices, triangles).check()
    assert report.watertight
    assert not report.consistently_oriented
    assert not report.outward
    assert len(report.inconsistent_edges) == 3
    assert set(report.inconsistent_edges.ravel()) == set(triangles[7])


def test_an_inside_out_surface_faces_the_wrong_way():
    report = BALL.flipped().check()
    assert report.consistently_oriented
    assert not report.outward
    assert report.wrong_facing_components.tolist() == [0]


def test_cavities_face_inward_and_bodies_in_them_outward():
    cavity, core = BALL.transformed(0.5).flipped(), BALL.transformed(0.2)
    assert joined(BALL, cavity, core).check().ok
    report = joined(BALL, cavity.flipped(), core).check()
    assert report.wrong_facing_components.tolist() == [1]
    assert "component 1" in report.problems[0]
    assert joined(BALL, BALL.transformed(translation=(5, 0, 0))).check().ok


def test_duplicate_degenerate_and_unused_are_reported():
    a, b, c = (int(i) for i in BALL.triangles[3])
    vertices = np.vstack([BALL.vertices, [[9, 9, 9]]])
    report = SurfaceMesh(vertices, np.vstack([BALL.triangles, [[b, c, a], [a, b, b]]])).check()
    assert report.duplicate_triangles.tolist() == [[3, len(BALL.triangles)]]
    assert report.degenerate_triangles.tolist() == [len(BALL.triangles) + 1]
    assert report.unused_vertices.tolist() == [len(BALL.vertices)]
    assert len(report.open_edges) == 0  # a side from a vertex to itself is not an edge
    text = str(report)
    assert "1 duplicate triangle pair" in text
    assert f"vertex {len(BALL.vertices)} at (9, 9, 9)" in text


def test_a_needle_is_degenerate():
    report = SurfaceMesh([[0, 0, 0], [1, 0, 0], [2, 0, 1e-17]], [[0, 1, 2]]).check()
    assert report.degenerate_triangles.tolist() == [0]


def test_intersections_of_overlapping_balls_are_located():
    surface = joined(BALL, BALL.transformed(translation=(1.0, 0.2, 0.1)))
    report = surface.check()
    assert report.self_intersecting
    assert report.watertight
    assert report.component_count == 2
    assert 1 <= len(report.intersecting_triangles) <= MAX_INTERSECTIONS
    for first, second in report.intersecting_triangles:
        assert first < len(BALL.triangles) <= second
        corners = surface.vertices[surface.triangles[[first, second]]]
        # Boxes around the two triangles overlap.
        assert (corners[0].max(axis=0) >= corners[1].min(axis=0)).all()
        assert (corners[1].max(axis=0) >= corners[0].min(axis=0)).all()
    assert any("intersecting triangle pairs" in line for line in report.problems)


def test_the_number_of_listed_intersections_is_bounded():
    points = np.random.default_rng(3).random((300, 3))
    report = SurfaceMesh(points, np.arange(300).reshape(-1, 3)).check()
    assert len(report.intersecting_triangles) == MAX_INTERSECTIONS
    assert any(line.startswith(f"{MAX_INTERSECTIONS} or more intersecting") for line in report.problems)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_touching_and_coplanar_triangles_intersect_at_any_scale(scale):
    flat = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    touching = np.array([*flat, [0.2, 0.2, 0], [2, 0.2, 1], [2, 0.4, 1]]) * scale
    coplanar = np.array([*flat, [0.2, 0.2, 0], [0.4, 0.2, 0], [0.2, 0.4, 0]]) * scale
    apart = np.array([*flat, [0.2, 0.2, 0.1], [0.4, 0.2, 0.1], [0.2, 0.4, 0.1]]) * scale
    triangles = [[0, 1, 2], [3, 4, 5]]
    assert SurfaceMesh(touching, triangles).check().intersecting_triangles.tolist() == [[0, 1]]
    assert SurfaceMesh(coplanar, triangles).check().intersecting_triangles.tolist() == [[0, 1]]
    assert not SurfaceMesh(apart, triangles).check().self_intersecting


def test_folded_neighbours_are_found():
    vertices = [[0, 0, 0], [1, 0, 0], [0.3, 1, 0], [0.4, 0.5, 0], [0.5, -1, 0]]
    assert SurfaceMesh(vertices, [[0, 1, 2], [1, 0, 3]]).check().folded_triangles.tolist() == [[0, 1]]
    assert not SurfaceMesh(vertices, [[0, 1, 2], [1, 0, 4]]).check().self_intersecting


def test_the_surface_of_a_tet_mesh_may_have_unused_vertices():
    mesh = shapes.sphere(1.0, 0.5)
    assert len(mesh.surface.used_vertices) < len(mesh.vertices)
    assert len(mesh.surface.check().unused_vertices) == 0
    assert len(SurfaceMesh(mesh.vertices, mesh.surface.triangles).check().unused_vertices) > 0


def test_winding_number_inside_and_outside():
    x, inward = BALL.vertices, np.ascontiguousarray(BALL.triangles[:, ::-1])
    assert winding_number(x, BALL.triangles, (0.1, 0.2, 0.3)) == pytest.approx(1)
    assert winding_number(x, BALL.triangles, (1.1, 0.2, 0.3)) == pytest.approx(0, abs=1e-12)
    assert winding_number(x, inward, (0.0, 0.0, 0.0)) == pytest.approx(-1)
