"""Pairs of triangles with common points: as each pair is tested exactly, and without exact tests where all is apart."""

import numpy as np
import pytest

import supple as sp
from supple.numerics.geometry import triangle_crossings
from supple.numerics.geometry.exact_crossings import triangles_meet
from supple.numerics.geometry.triangle_crossings import crossing_triangles


def every_pair(x, triangles, owner):
    """The pairs of different owners that meet, each tested exactly."""
    sides, found = np.empty((2, 3), dtype=np.int64), []
    for i, first in enumerate(triangles.tolist()):
        for j in range(i + 1, len(triangles)):
            if owner[i] != owner[j]:
                kind = triangles_meet(x, tuple(first), tuple(triangles[j].tolist()), sides)
                found += [(i, j, kind)] if kind else []
    return found


def two(mesh, shift):
    """Two surfaces, the second one shifted."""
    surface, n = mesh.surface, len(mesh.surface.vertices)
    x = np.concatenate([surface.vertices, surface.vertices + shift])
    triangles = np.concatenate([surface.triangles, surface.triangles + n]).astype(np.int32)
    return x, triangles, np.repeat(np.arange(2, dtype=np.int32), len(surface.triangles))


BALL, BOX = sp.shapes.sphere(radius=0.5, edge_length=0.25), sp.shapes.box(size=(1, 1, 1), divisions=(2, 2, 2))
OTHERS = ~np.eye(2, dtype=np.bool_)


@pytest.mark.parametrize(
    ("mesh", "shift"), [(BALL, (0.8, 0.1, 0)), (BOX, (1, 0, 0)), (BOX, (1, 0.25, 0)), (BOX, (0.5, 0.5, 0.5))]
)
def test_the_same_pairs_as_by_exact_tests_of_all(mesh, shift):
    shapes = two(mesh, shift)
    pairs, kinds = crossing_triangles(*shapes, OTHERS)
    found = every_pair(*shapes)
    assert found
    assert [(*pair, kind) for pair, kind in zip(pairs.tolist(), kinds.tolist(), strict=True)] == found
    assert len(crossing_triangles(*shapes, OTHERS, 3)[0]) == 3


@pytest.mark.parametrize("gap", [1e-2, 1e-12])
def test_surfaces_that_are_apart_need_no_exact_test(monkeypatch, gap):
    monkeypatch.setattr(triangle_crossings, "kinds_of_pairs", None)
    for mesh, shift in ((BALL, 1.0 + gap), (BOX, 1.0 + gap)):
        pairs, _ = crossing_triangles(*two(mesh, (shift, 0, 0)), np.ones((2, 2), dtype=np.bool_))
        assert len(pairs) == 0
