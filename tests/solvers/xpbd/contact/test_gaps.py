"""What surfaces keep is small against what is there: nothing hovers, and what begins near or rests is not lifted."""

from itertools import pairwise

import numpy as np
import pytest
from tests.scenes import FLOOR, contact_gap

import supple as sp
from supple.solvers.xpbd.contact.search.gaps import OF_DIAGONAL, SHARE

RUBBER = sp.StableNeoHookean(youngs=1e6, poisson=0.3, density=1000)
CUBE = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2))
BOARD = sp.shapes.box_surface((0.5, 0.01, 0.5), (1, 1, 1))


def boards(gap, below=1e-4):
    heights = 0.005 + below + (0.01 + gap) * np.arange(3)
    return [sp.RigidBody(f"{k}", BOARD, density=600, position=(0, y, 0), friction=0.5) for k, y in enumerate(heights)]


def cubes(gap, count=3, below=1e-5):
    heights = 0.05 + below + (0.1 + gap) * np.arange(count)
    return [sp.Body(f"{k}", CUBE, RUBBER, position=(0, y, 0), friction=0.5) for k, y in enumerate(heights)]


def energy(report):
    return report.kinetic_energy + report.elastic_energy + report.potential_energy


def distances(frame):
    """Between neighbours of a stack, at their faces [m]."""
    y = [points[:, 1] for points in frame.positions.values()]
    return [above.min() - below.max() for below, above in pairwise(y)]


@pytest.mark.parametrize("gap", [0.0, 1e-9, 1e-5])
def test_cubes_that_begin_near_each_other_without_gravity_stay(gap):
    first = sp.Scene(cubes(gap), gravity=(0, 0, 0))
    for frame in sp.simulate(first, sp.XPBD(), 1 / 60, 10):
        assert frame.report.status == "converged"
        assert energy(frame.report) < 1e-9
    for body in first.bodies:
        assert np.abs(frame.positions[body.name].mean(axis=0) - body.position).max() < 1e-6


@pytest.mark.parametrize("gap", [0.0, 1e-9, 1e-3])
@pytest.mark.parametrize("make", [boards, cubes])
def test_what_begins_near_is_not_lifted(make, gap):
    scene = sp.Scene(make(gap, below=gap), [FLOOR])
    begin = None
    for frame in sp.simulate(scene, sp.XPBD(), 1 / 60, 8):
        assert frame.report.status == "converged"
        begin = energy(frame.report) if begin is None else begin
        assert energy(frame.report) < begin + 2e-3 * begin
        for body in scene.bodies:
            # Rigid boards that touch exactly part by up to .06 mm, less than a hundredth of their thickness.
            lifted = 1e-4 if make is boards and gap == 0.0 else 2e-5
            assert frame.positions[body.name].mean(axis=0)[1] < body.position[1] + lifted


def test_boards_that_fall_on_each_other_rest_on_each_other():
    *_, frame = sp.simulate(sp.Scene(boards(0.04), [FLOOR]), sp.XPBD(), 1 / 60, 60)
    assert frame.report.kinetic_energy < 1e-6
    # A twentieth of their thickness, not of their edges.
    assert max(distances(frame)) <= 1.01 * SHARE * 0.01
    assert min(distances(frame)) > 0.0


def test_cubes_that_fall_on_each_other_rest_on_each_other():
    *_, frame = sp.simulate(sp.Scene(cubes(0.01, 2), [FLOOR]), sp.XPBD(), 1 / 60, 60)
    assert 0.0 < distances(frame)[0] <= 1.01 * contact_gap(cubes(0.0)[0])


@pytest.mark.parametrize("size", [1e-3, 10.0])
def test_gaps_scale_with_things(size):
    box = sp.shapes.box_surface((size, size, size), (1, 1, 1))
    bodies = [sp.RigidBody(f"{k}", box, density=1000, position=(0, size * (0.55 + 1.1 * k), 0)) for k in range(2)]
    *_, frame = sp.simulate(sp.Scene(bodies, [FLOOR]), sp.XPBD(), 1 / 60, 90 if size > 1.0 else 20)
    assert 0.0 < distances(frame)[0] <= 1.01 * OF_DIAGONAL * np.sqrt(3.0) * size


def test_a_thin_fin_has_a_smaller_gap_than_the_block_that_it_stands_on():
    surface = sp.shapes.box_surface((0.2, 0.001, 0.2), (20, 1, 20))
    *_, frame = sp.simulate(
        sp.Scene(
            [sp.Body("cube", CUBE, RUBBER, position=(0, 0.06, 0))], [sp.obstacles.TriangleObstacle(surface, name="fin")]
        ),
        sp.XPBD(),
        1 / 60,
        30,
    )
    assert frame.positions["cube"][:, 1].min() - 0.0005 == pytest.approx(SHARE * 0.001, rel=0.05)


def test_planks_that_touch_across_each_other_do_not_fall_through():
    """No vertex is near a face: their edges cross at a distance of zero, up to round-off."""
    shapes = sp.shapes.box_surface((0.4, 0.02, 0.05), (1, 1, 1)), sp.shapes.box_surface((0.05, 0.02, 0.4), (1, 1, 1))
    planks = [
        sp.RigidBody(f"{k}", shape, density=600, position=(0, 0.01 + 0.02 * k, 0), friction=0.5)
        for k, shape in enumerate(shapes)
    ]
    for frame in sp.simulate(sp.Scene(planks, [FLOOR]), sp.XPBD(), 1 / 60, 30):
        assert frame.report.status == "converged"
    assert -1e-5 < distances(frame)[0] < 1e-4
