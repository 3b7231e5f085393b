"""What does not collide because it is stitched, against the definition written out."""

import itertools

import numpy as np
import pytest

from supple.mesh import shapes
from supple.scene.stitches.masks import stitched_crossings, stitched_edges, stitched_triangles

SURFACE = shapes.box((1, 1, 1), (2, 2, 2)).surface.compact()
TRIANGLES, EDGES, N = SURFACE.triangles, SURFACE.edges, len(SURFACE.vertices)
# A vertex with a triangle, with an edge, with a vertex; with something inside the body; and one inside it.
NODES = np.array(
    [[0, *TRIANGLES[7]], [3, *EDGES[20], -1], [5, 11, -1, -1], [2, -1, -1, -1], [-1, *TRIANGLES[2]], [0, *TRIANGLES[9]]]
)
CASES = pytest.mark.parametrize("chosen", [[0], [1], [2], [3], [4], [0, 1, 2, 3, 4, 5]])


def held(node):
    return {int(v) for v in node[1:] if v >= 0}


@CASES
def test_triangles(chosen):
    wanted = set()
    for node in NODES[chosen]:
        for t, corners in enumerate(TRIANGLES):
            if node[0] >= 0 and held(node) and held(node) <= set(corners.tolist()):
                wanted.add((int(node[0]), t))
            if node[0] in corners:
                wanted |= {(v, t) for v in held(node)}
    vertices, triangles = stitched_triangles(NODES[chosen], TRIANGLES, N)
    assert set(zip(vertices.tolist(), triangles.tolist(), strict=True)) == wanted


@CASES
def test_edges(chosen):
    wanted = set()
    for node in NODES[chosen]:
        theirs = [
            f
            for f, ends in enumerate(EDGES)
            if (set(ends.tolist()) <= held(node) if len(held(node)) > 1 else bool(set(ends.tolist()) & held(node)))
        ]
        own = [e for e, ends in enumerate(EDGES) if node[0] in ends]
        wanted |= set(itertools.product(own, theirs))
    one, other = stitched_edges(NODES[chosen], EDGES, N)
    assert set(zip(one.tolist(), other.tolist(), strict=True)) == wanted


@CASES
def test_crossings(chosen):
    wanted = set()
    for node in NODES[chosen]:
        theirs = [t for t, corners in enumerate(TRIANGLES) if held(node) and held(node) <= set(corners.tolist())]
        wanted |= set(itertools.product([t for t, corners in enumerate(TRIANGLES) if node[0] in corners], theirs))
    one, other = stitched_crossings(NODES[chosen], TRIANGLES, N).nonzero()
    assert set(zip(one.tolist(), other.tolist(), strict=True)) == wanted
