"""A wanted number of tets: how many meshes are made until it is reached, or cannot be."""

import logging
from types import SimpleNamespace
from typing import Any

import pytest

from supple.mesh.meshing.sizes import mesh_with_count


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


def test_where_the_surface_rules_it_is_found_with_two_meshes(caplog):
    """A run of fTetWild on a damaged surface takes half a minute."""
    with caplog.at_level(logging.WARNING):
        made, bounds = tried(lambda bound: 34_000 + 0.1 / bound, 10_000)
    assert len(bounds) == 2
    assert made == pytest.approx(34_000, rel=0.01)
    assert "reduce them first with decimate=1666" in caplog.text


def test_an_uneven_law_is_followed_further():
    """As of TetGen: 1.2 times the bound may give the same number, and 1.5 times the bound much fewer."""
    made, _ = tried(lambda bound: 12_000 if bound < 3e-4 else 3.0 / bound, 10_000)
    assert made == pytest.approx(10_000, rel=0.1)
