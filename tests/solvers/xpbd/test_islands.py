"""What is far away does not change where things come to lie: rows are solved island by island, in one order."""

import numpy as np
import pytest

import supple as sp
from supple.solvers.xpbd.frame.substep import SubstepRunner
from supple.solvers.xpbd.record import SWEEPS
from supple.solvers.xpbd.stages import MOST_RIGID_SWEEPS

RUBBER = sp.StableNeoHookean(youngs=2e5, poisson=0.3)
# Contact is chaotic: where one box starts 1e-9 m off, places differ by 8e-9 m after this time, after a second by 1 mm.
FRAMES, TINY = 24, 1e-9


def heap(*others, off=0.0):
    bodies = []
    for k in range(9):
        size, place = 0.05 + 0.006 * (7 * k % 5), (0.09 * (k % 3) + off * (k == 0), 0.05 + 0.09 * (k // 3), 0.004 * k)
        bodies.append(sp.Body(f"{k}", sp.shapes.box((size, size, size), (1, 1, 1)), RUBBER, position=place))
    return sp.Scene([*bodies, *others], [sp.HalfSpace(friction=0.5, name="floor")])


def ends(scene):
    solver = sp.XPBD(contact=sp.XPBDContact(thickness=1e-3))
    *_, frame = sp.simulate(scene, solver, dt=1 / 60, steps=FRAMES)
    return np.concatenate([frame.positions[f"{k}"] for k in range(9)])


@pytest.fixture(scope="module")
def alone():
    return ends(heap())


def far_bodies():
    box = sp.shapes.box((0.05, 0.05, 0.05), (1, 1, 1))
    slow = sp.RigidBody(
        "rigid", sp.shapes.box_surface((0.05, 0.05, 0.05), (1, 1, 1)), density=500, position=(50, 0.1, 0)
    )
    hit = sp.Body(
        "hit", box, sp.StableNeoHookean(youngs=1e4, poisson=0.3), position=(-30, 0.03, 0), rotation=(0.3, 0, 0)
    )
    return {"rigid": (slow,), "soft": (hit,), "pair": (slow, slow.changed(name="upper", position=(50, 0.16, 0)))}


@pytest.mark.parametrize("kind", ["rigid", "soft", "pair"])
def test_bodies_far_away_change_a_heap_by_no_more_than_round_off(alone, kind):
    moved = np.abs(ends(heap(*far_bodies()[kind])) - alone).max()
    if kind == "pair":
        # How often rows of rigid bodies that touch are solved again is one number for the scene: a far pair shifts the
        # heap by .08 mm within these frames.
        assert moved < 2e-4
        return
    assert moved < TINY
    assert moved < 0.1 * np.abs(ends(heap(off=TINY)) - alone).max()


def test_soft_rows_of_bodies_with_bones_are_solved_as_other_soft_rows(monkeypatch):
    """A stack of three. Rows on rigid bodies, which nothing else corrects, are more exact: 63 % reach the limit."""
    sweeps, bodies, welds = [], [], []

    run = SubstepRunner.run

    def counting(substeps, k):
        known = run(substeps, k)
        sweeps.append(int(substeps.ws.counts[SWEEPS]))
        return known

    monkeypatch.setattr(SubstepRunner, "run", counting)
    for k in range(3):
        y = 0.051 + 0.1021 * k
        core = sp.shapes.box_surface((0.04, 0.04, 0.04), (1, 1, 1))
        bodies.append(sp.Body(f"flesh{k}", sp.shapes.box((0.1,) * 3, (4, 4, 4)), RUBBER, position=(0, y, 0)))
        bodies.append(sp.RigidBody(f"bone{k}", core, density=2e3, position=(0, y, 0)))
        welds.append(sp.Weld(f"flesh{k}", f"bone{k}", sp.InBox((-0.03, y - 0.03, -0.03), (0.03, y + 0.03, 0.03))))
    pair = sp.ContactPair("bone*", "*", collide=False)
    scene = sp.Scene(bodies, obstacles=[sp.HalfSpace(friction=0.5, name="floor")], welds=welds, contact_pairs=[pair])
    list(sp.simulate(scene, sp.XPBD(substeps=30, sleep_after=None), 1 / 60, 5))
    assert np.mean(np.array(sweeps) == MOST_RIGID_SWEEPS) < 0.45
