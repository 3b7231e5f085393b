"""Equal cubes on each other, without friction: contact moves nothing sideways.

The meshes are symmetric. The tets of `sp.shapes.box` are not: under its load such a cube leans, its faces tilt, and
what lies on them slides, whatever the contact.
"""

import numpy as np
import pytest
from tests.torture.meshes import mirrored_box

import supple as sp

SIDE, GAP, DHAT = 0.1, 1e-5, 1e-4
# A cell of five tets: a half turn about each axis maps it to itself.
FIVE = np.array([[0, 3, 5, 6], [1, 0, 3, 5], [2, 0, 6, 3], [4, 0, 5, 6], [7, 3, 6, 5]])


def symmetric_cube(cells):
    if cells % 2 == 0:
        return mirrored_box((SIDE,) * 3, cells)
    points = SIDE * (np.stack(np.meshgrid(*[np.arange(cells + 1)] * 3, indexing="ij"), -1).reshape(-1, 3) / cells - 0.5)
    width = cells + 1
    tets = []
    for cell in np.ndindex(cells, cells, cells):
        # Corner 4 a + 2 b + c is at (a, b, c); every second cell is a mirror image.
        flip = sum(cell) % 2
        corners = [
            (cell[0] + (a ^ flip)) * width**2 + (cell[1] + b) * width + cell[2] + c for a, b, c in np.ndindex(2, 2, 2)
        ]
        tets.append(np.array(corners)[FIVE])
    return sp.TetMesh(points, np.concatenate(tets))


def drift(cells, seconds, stitched=False):
    """The largest distance of the upper cube's center from the axis [m]."""
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1000.0, damping=0.01)
    mesh = symmetric_cube(cells)
    bodies = [
        sp.Body("low", mesh, rubber, position=(0, 0.5 * SIDE + GAP, 0)),
        sp.Body("high", mesh, rubber, position=(0, 1.5 * SIDE + 2 * GAP, 0)),
    ]
    stitches = []
    if stitched:
        bodies += [
            sp.Body("left", mesh, rubber, position=(1.0, 0.5 * SIDE + GAP, 0)),
            sp.Body("right", mesh, rubber, position=(1.0 + 1.01 * SIDE, 0.5 * SIDE + GAP, 0)),
        ]
        stitches = [
            sp.SoftVertexTriangleStitch(
                "left", "right", max_distance=0.02 * SIDE, youngs=1e5, poisson=0.3, min_separate_distance=1e-3
            )
        ]
    scene = sp.Scene(bodies, obstacles=[sp.HalfSpace()], stitches=stitches)
    worst = 0.0
    for frame in sp.simulate(scene, sp.Implicit(contact=sp.IPCContact(dhat=DHAT)), 1 / 60, round(60 * seconds)):
        assert frame.report.status == "converged"
        away = frame.positions["high"].mean(axis=0) - frame.positions["low"].mean(axis=0)
        worst = max(worst, float(np.abs(away[[0, 2]]).max()))
    return worst


@pytest.mark.parametrize("stitched", [False, True])
def test_cubes_of_two_cells_rest_for_half_a_second(stitched):
    assert drift(2, 0.5, stitched) < 2e-6 * SIDE


@pytest.mark.slow
@pytest.mark.parametrize("cells", [1, 2, 3, 4, 8])
def test_cubes_rest_for_five_seconds(cells):
    assert drift(cells, 5.0) < 1e-3 * SIDE
