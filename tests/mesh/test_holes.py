"""Holes of surfaces are closed without the extra: their triangles, and what is refused."""

import importlib.util

import numpy as np
import pytest

from supple.errors import MeshingError
from supple.mesh.meshing.holes import close_holes
from supple.mesh.meshing.repair import repair_surface
from supple.mesh.meshing.tetrahedralize import tetrahedralize
from supple.mesh.primitives.surfaces import sphere_surface
from supple.mesh.shapes import box_surface
from supple.mesh.surface import SurfaceMesh

BALL = sphere_surface(radius=0.5, edge_length=0.05)


@pytest.fixture(autouse=True)
def without_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util,
        "find_spec",
        lambda name, *rest: None if name == "pymeshfix" else find(name, *rest),
    )


def without_cap(surface: SurfaceMesh, *, above: float) -> SurfaceMesh:
    """The surface without the triangles whose middle is higher than that."""
    middle = surface.vertices[surface.triangles].mean(axis=1)
    return SurfaceMesh(surface.vertices, surface.triangles[middle[:, 1] < above]).compact()


def test_a_hole_of_forty_edges_is_closed_and_filled() -> None:
    holed = without_cap(BALL, above=0.42)
    edges = len(holed.check().open_edges)
    assert edges >= 40
    closed, report = repair_surface(holed)
    assert closed.check().ok
    assert report.steps == (f"closed 1 hole of {edges} edges",)
    assert len(closed.triangles) == len(holed.triangles) + edges - 2
    # A ball without its cap above h: pi (2/3 r^3 + r^2 h - h^3/3); the rim lies within an edge of h.
    cut = [np.pi * (2 / 3 * 0.125 + 0.25 * h - h**3 / 3) for h in (0.37, 0.45)]
    assert cut[0] < closed.volume < cut[1]
    mesh = tetrahedralize(holed, tets=2000, repair=True)
    assert len(mesh.tets) == pytest.approx(2000, rel=0.1)


def test_a_rim_with_straight_sides_gets_triangles_with_an_area() -> None:
    box = box_surface((1.0, 1.0, 1.0), (6, 6, 6))
    closed, _ = repair_surface(without_cap(box, above=0.49))
    assert closed.check().ok
    assert closed.volume == pytest.approx(box.volume, rel=1e-9)


def test_several_holes_are_closed_each() -> None:
    middle = BALL.vertices[BALL.triangles].mean(axis=1)
    holed = SurfaceMesh(BALL.vertices, BALL.triangles[np.abs(middle[:, 0]) < 0.46])
    closed, count = close_holes(holed.compact(), holed.compact().check().open_edges)
    assert count == 2
    assert closed.check().ok


def test_what_remains_open_names_the_command_that_installs_the_extra() -> None:
    middle = BALL.vertices[BALL.triangles].mean(axis=1)
    top = middle[:, 1].argsort()[-4:]
    corner = BALL.triangles[top[0], 0]
    around = np.flatnonzero((BALL.triangles == corner).any(axis=1))
    # Two triangles around one vertex that share no edge: the rim meets itself there.
    first = BALL.triangles[around[0]]
    apart = [row for row in around[1:] if len(np.intersect1d(BALL.triangles[row], first)) == 1]
    holed = SurfaceMesh(BALL.vertices, np.delete(BALL.triangles, [around[0], apart[0]], axis=0))
    assert close_holes(holed, holed.check().open_edges)[1] == 0
    with pytest.raises(MeshingError, match=r'open boundary edges.*pip install "supple\[dirty\]"'):
        repair_surface(holed)
