"""Collisions as a whole: settings, same bits, and what is reported."""

import numpy as np
import pytest

import supple as sp
from supple.errors import SolverError
from supple.solvers.xpbd.contact.settings import XPBDContact
from supple.solvers.xpbd.solver import XPBD

SOFT = sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=1000)


def pile():
    mesh = sp.shapes.box((0.2, 0.1, 0.2), (2, 1, 2))
    bodies = [
        sp.Body(f"b{k}", mesh, SOFT, position=(0.02 * k, 0.07 + 0.13 * k, 0), rotation=(0, 0.3 * k, 0), friction=0.3)
        for k in range(3)
    ]
    return sp.Scene(bodies, [sp.HalfSpace(friction=0.5), sp.obstacles.Sphere(center=(0.05, -0.022, 0), radius=0.04)])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"thickness": 0.0}, "thickness is 0; it must be above zero"),
        ({"thickness": -1e-3}, "thickness"),
        ({"thickness": float("nan")}, "thickness"),
        ({"thickness": "thin"}, "'thin'"),
        ({"thickness": True}, "thickness"),
        ({"self_collision": 1}, "self_collision is 1"),
        ({"body_collision": None}, "body_collision"),
    ],
)
def test_wrong_settings_raise_an_error_that_names_them(wrong, message):
    with pytest.raises(SolverError, match=message):
        XPBDContact(**wrong)


def test_bodies_stop_at_the_given_thickness():
    """Two boxes without gravity, driven together: they stop at the gap, and the report contains it."""
    mesh = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
    for thickness in (2e-3, 8e-3):
        scene = sp.Scene(
            [sp.Body("a", mesh, SOFT), sp.Body("b", mesh, SOFT, position=(0.01, 0.12, 0.01), velocity=(0, -0.2, 0))],
            gravity=(0, 0, 0),
        )
        solver = XPBD(substeps=10, contact=XPBDContact(thickness=thickness))
        gaps = [f.report.details.smallest_gap for f in sp.simulate(scene, solver, 1 / 60, 20)]
        assert gaps[0] is None
        assert min(gap for gap in gaps if gap is not None) == pytest.approx(thickness, rel=0.02)


def test_contacts_far_from_the_origin_are_the_same():
    def drop(shift):
        # Without friction the upper one slides off: an unstable equilibrium does not tell errors from round-off.
        boxes = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2)), sp.shapes.box((0.3, 0.1, 0.3), (2, 2, 2))
        body = sp.Body("b", boxes[0], SOFT, position=np.array([0, 0.06, 0]) + shift, friction=0.5)
        under = sp.Body("u", boxes[1], SOFT, position=np.array([0, -0.05, 0]) + shift, friction=0.5)
        floor = sp.HalfSpace(point=np.array([0, -0.1, 0]) + shift)
        frames = list(sp.simulate(sp.Scene([body, under], [floor]), XPBD(substeps=10), 1 / 60, 15))
        return frames[-1].state.positions - shift

    assert np.abs(drop(np.array([1000.0, 0.0, -2000.0])) - drop(np.zeros(3))).max() < 5e-4


def test_no_gap_is_reported_where_nothing_can_touch():
    frame = next(iter(sp.simulate(sp.Scene(pile().bodies[:1]), XPBD(substeps=2, contact=None), 1 / 60, 1)))
    assert frame.report.details.smallest_gap is None
