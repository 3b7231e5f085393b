"""A wanted number of tets: how many meshes are made until it is reached, or cannot be."""

import logging
from types import SimpleNamespace
from typing import Any

import pytest

from supple.errors import MeshingError
from supple.mesh.meshing.sizes import fill_with_count, mesh_with_count


def tried(law, count):
    """The number of tets of the mesh that is chosen, and the bounds that were tried, with `law(bound)` tets."""
    bounds = []

    def make(bound) -> Any:
        bounds.append(bound)
        return SimpleNamespace(tets=range(int(law(bound))), surface=SimpleNamespace(triangles=range(5000)))

    return len(mesh_with_count(make, count, volume=1.0).tets), bounds


@pytest.mark.parametrize(
    "law",
    [
        lambda bound: 1.0 / bound,
        lambda bound: 3.0 / bound,
        lambda bound: 2000.0 + 3.0 / bound,
        lambda bound: 30.0 * bound**-0.8,
        lambda bound: 500.0 * bound**-0.5,
    ],
)
def test_a_number_that_a_bound_gives_is_reached(law):
    made, bounds = tried(law, 10_000)
    assert made == pytest.approx(10_000, rel=0.1)
    assert len(bounds) <= 6


def test_where_the_surface_rules_it_is_found_with_two_meshes():
    """A run of fTetWild on a damaged surface takes half a minute."""
    made, bounds = tried(lambda bound: 34_000 + 0.1 / bound, 10_000)
    assert len(bounds) == 2
    assert made == pytest.approx(34_000, rel=0.01)


def of_triangles(count):
    return SimpleNamespace(triangles=range(count))


def filled_with(count, tets_of_triangle, triangles=15_000, fewest=0):
    """The numbers of tets and of triangles that are chosen, where each triangle needs so many tets."""

    def make(surface, bound) -> Any:
        return SimpleNamespace(tets=range(int(max(2.5 / bound, tets_of_triangle * len(surface.triangles)))))

    def reduce(surface, wanted) -> Any:
        if wanted < fewest:
            raise MeshingError("it crosses itself; give a larger number")
        return of_triangles(wanted)

    mesh, used = fill_with_count(of_triangles(triangles), count, make, reduce, 1.0)
    return len(mesh.tets), len(used.triangles)


@pytest.mark.parametrize("tets_of_triangle", [5.0, 6.0, 7.0, 20.0])
def test_a_surface_is_reduced_until_its_triangles_need_no_more_tets(tets_of_triangle, caplog):
    made, triangles = filled_with(5000, tets_of_triangle)
    assert made == pytest.approx(5000, rel=0.1)
    assert triangles <= 5000 / tets_of_triangle * 1.1
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


def test_a_surface_that_cannot_be_reduced_so_far_says_so(caplog):
    made, triangles = filled_with(5000, 6.0, fewest=3000)
    assert (made, triangles) == (19_992, 3332)
    assert "19992 tets instead of 5000" in caplog.text
    assert "decimate" not in caplog.text


def test_coarse_surfaces_stay(caplog):
    made, triangles = filled_with(5000, 6.0, triangles=384)
    assert made == pytest.approx(5000, rel=0.1)
    assert triangles == 384
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


def test_an_uneven_law_is_followed_further():
    """As of TetGen: 1.2 times the bound may give the same number, and 1.5 times the bound much fewer."""
    made, _ = tried(lambda bound: 12_000 if bound < 3e-4 else 3.0 / bound, 10_000)
    assert made == pytest.approx(10_000, rel=0.1)
