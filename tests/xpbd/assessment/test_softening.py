"""The estimate of how much softer a body is, against static sags that are computed without substeps."""

import numpy as np
import pytest

import supple as sp
from supple.state import State
from supple.system import build_system, initial_state
from supple.xpbd.assessment.softening import Softening
from supple.xpbd.solver import XPBD

DT = 1.0 / 60.0


def beam(divisions, poisson, youngs=1e5, gravity=1.0):
    mesh = sp.shapes.box((0.4, 0.1, 0.1), divisions)
    held = np.flatnonzero(mesh.vertices[:, 0] < -0.199)
    body = sp.Body("beam", mesh, sp.StableNeoHookean(youngs=youngs, poisson=poisson, density=1000))
    return sp.Scene([body], pins=[sp.Pin("beam", held)], gravity=(0, -gravity, 0))


def sag(system, start, solver, static):
    """How much lower the free end rests than the static solution, relative to its sag."""
    workspace, state, last = solver.prepare(system), static, np.inf
    tip = np.flatnonzero(start.positions[:, 0] > 0.199)
    low = (static.positions - start.positions)[tip, 1].mean()
    for _ in range(300):
        new, report = solver.step(system, state, DT, workspace)
        state = State(new.time, new.positions, 0.8 * new.velocities, new.memory)
        now = (state.positions - start.positions)[tip, 1].mean() / low - 1.0
        if abs(now - last) < 1e-6:
            break
        last = now
    return now, report


@pytest.mark.parametrize("poisson", [0.3, 0.45, 0.49])
def test_beams_at_automatic_substeps_hang_as_low_as_the_accuracy_says(poisson):
    scene = beam((8, 2, 2), poisson)
    system, start = build_system(scene), initial_state(scene)
    static_solver = sp.Implicit(integrator="static", contact=None)
    static, _ = static_solver.step(system, start, DT, static_solver.prepare(system))
    found, report = sag(system, start, XPBD(contact=None), static)
    assert report.status == "converged"
    assert -0.002 < found < 1 / 0.98 - 1  # two percent of the stiffness
    # The estimate is not far too pessimistic either.
    if poisson > 0.4:
        assert found > 0.4 * report.details.softening["beam"]


def test_the_error_falls_with_the_square_of_the_substep_and_is_reported():
    system = build_system(beam((4, 2, 2), 0.4, youngs=1e6))
    estimate = Softening(system)
    one, two = (estimate.by_body(h)["beam"] for h in (1e-3, 5e-4))
    assert one / (1 - one) == pytest.approx(4.0 * two / (1 - two), rel=1e-12)
    count, name = estimate.substeps(DT, 0.02)
    assert name == "beam"
    assert estimate.shares(DT / count)[0] <= 0.02 < estimate.shares(DT / (count - 1))[0]


def test_a_frame_that_is_too_soft_says_how_much_and_what_helps():
    frame = next(sp.simulate(beam((4, 2, 2), 0.4, youngs=1e6), XPBD(substeps=10), DT, 1))
    assert frame.report.status == "softened"
    assert 0.02 < frame.report.softening["beam"] < 1.0
    text, remedy = frame.report.message.split("; take substeps=")
    assert text.startswith("body 'beam' about ")
    enough = next(sp.simulate(beam((4, 2, 2), 0.4, youngs=1e6), XPBD(substeps=int(remedy)), DT, 1))
    assert enough.report.status == "converged"


def test_stiffness_that_no_compliance_defines_is_not_estimated():
    hard = sp.EdgesAndVolume(edge_compliance=0.0)
    system = build_system(sp.Scene([sp.Body("hard", sp.shapes.box((1, 1, 1), (2, 2, 2)), hard)]))
    assert Softening(system).rates.tolist() == [0.0]
