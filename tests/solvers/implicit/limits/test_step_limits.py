"""What limits a step is named: the tet, the pair of surfaces, or the energy."""

import numpy as np
import pytest

import supple as sp
from supple.contact.mesh.obstacles import obstacle_positions
from supple.model.system import build_system, initial_state
from supple.solvers.implicit.contact.model import contact_model
from supple.solvers.implicit.inversion_guard import InversionGuard
from supple.solvers.implicit.step_limits import StepLimits
from supple.solvers.implicit.timings import Clock

MATERIAL = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1000.0)


@pytest.fixture
def limits() -> tuple[StepLimits, np.ndarray]:
    """Two cubes above each other, 0.1 apart, the lower one 0.2 above a floor."""
    cube = sp.shapes.box((1, 1, 1), (1, 1, 1))
    bodies = [
        sp.Body("lower", cube, MATERIAL, position=(0, 0.7, 0)),
        sp.Body("upper", cube, MATERIAL, position=(0, 1.8, 0)),
    ]
    scene = sp.Scene(bodies, [sp.HalfSpace(name="floor")])
    contact = contact_model(build_system(scene), sp.IPCContact(), np.full(12, 1e5))
    x = np.concatenate([initial_state(scene).positions, obstacle_positions(contact.obstacles, 0.0)])
    return StepLimits(InversionGuard.at(contact.system, x), contact, Clock()), x


def test_a_whole_step_has_no_reason(limits):
    step, tet, reason, _ = limits[0].largest_step(limits[1], np.zeros_like(limits[1]))
    assert (step, tet, reason) == (1.0, -1, "")


def test_the_tet_that_would_invert_is_named_by_its_body(limits):
    guard, x = limits
    direction = np.zeros_like(x)
    second = guard.guard.system.bodies[1]
    corner = second.vertices.start
    direction[corner] = 3.0 * (x[second.vertices].mean(axis=0) - x[corner])
    step, tet, reason, _ = guard.largest_step(x, direction)
    assert 0.0 < step < 1.0
    assert corner in guard.guard.system.tets[tet]
    assert reason == f"inversion of tet {tet - second.tets.start} of body 'upper'"


@pytest.mark.parametrize(
    ("way", "step", "reason"),
    [
        (-1.0, 0.18, "contact of body 'lower' and obstacle 'floor'"),
        (1.0, 0.1, "contact of body 'lower' and body 'upper'"),
    ],
)
def test_surfaces_that_would_touch_are_named(limits, way: float, step: float, reason: str):
    guard, x = limits
    direction = np.zeros_like(x)
    direction[guard.guard.system.bodies[0].vertices, 1] = way
    found = guard.largest_step(x, direction)
    near = guard.contact.collisions.finder.dhat if way > 0.0 else 0.0  # surfaces that are far apart come as near
    assert found.step == pytest.approx(step - near, rel=1e-3)
    assert (found.tet, found.reason) == (-1, reason)


def test_every_iteration_says_what_made_its_step_shorter():
    cube = sp.shapes.box((1, 1, 1), (2, 2, 2))
    body = sp.Body("cube", cube, MATERIAL, position=(0, 0.6, 0), velocity=(0, -40, 0), friction=0.5)
    scene = sp.Scene([body], [sp.HalfSpace(name="floor", friction=0.5)])
    rows = [row for frame in sp.simulate(scene, sp.Implicit(), 0.02, 3) for row in _rows(frame)]
    assert any(row.limit for row in rows)
    for row in rows:
        reasons = row.limit.split("; ") if row.limit else []
        assert ("energy" in reasons) == (row.cuts > 0)
        assert any(r.startswith(("contact of ", "inversion of ")) for r in reasons) == (row.filter < 1.0)


def _rows(frame):
    return frame.report.details.newton if frame.report else ()
