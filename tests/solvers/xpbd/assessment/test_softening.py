"""The estimate of how much softer a body is, against static sags that are computed without substeps."""

import numpy as np
import pytest

import supple as sp
from supple.model.state import State
from supple.model.system import build_system, initial_state
from supple.solvers.xpbd.assessment.softening import Softening
from supple.solvers.xpbd.details import XPBDDetails
from supple.solvers.xpbd.solver import XPBD

DT = 1.0 / 60.0


def beam(divisions, poisson, youngs=1e5, gravity=1.0):
    mesh = sp.shapes.box((0.4, 0.1, 0.1), divisions)
    held = np.flatnonzero(mesh.vertices[:, 0] < -0.199)
    body = sp.Body("beam", mesh, sp.StableNeoHookean(youngs=youngs, poisson=poisson, density=1000))
    return sp.Scene([body], pins=[sp.Pin("beam", held)], gravity=(0, -gravity, 0))


def at_rest(scene):
    """The system, the undeformed state and the static one."""
    system, start = build_system(scene), initial_state(scene)
    solver = sp.Implicit(integrator="static", contact=None)
    return system, start, solver.step(system, start, DT, solver.prepare(system))[0]


def details(report):
    assert isinstance(report.details, XPBDDetails)
    return report.details


def hanging(system, static, solver, frames=300):
    """States and reports from the static one until the body rests."""
    workspace, state, last = solver.prepare(system), static, np.inf
    for _ in range(frames):
        new, report = solver.step(system, state, DT, workspace)
        state = State(new.time, new.positions, 0.8 * new.velocities, new.memory)
        now = state.positions[:, 1].mean()
        yield state, report
        if abs(now - last) < 1e-8:
            break
        last = now


@pytest.mark.parametrize("poisson", [0.3, 0.45, 0.49])
def test_beams_at_automatic_substeps_hang_as_low_as_the_accuracy_says(poisson):
    scene = beam((8, 2, 2), poisson)
    system, start, static = at_rest(scene)
    *_, (state, report) = hanging(system, static, XPBD(contact=None))
    tip = start.positions[:, 0] > 0.199
    fall = [(item.positions - start.positions)[tip, 1].mean() for item in (state, static)]
    found = fall[0] / fall[1] - 1.0
    assert report.status == "converged"
    assert -0.002 < found < 1 / 0.98 - 1  # two percent of the stiffness
    # The estimate is not far too pessimistic either.
    if poisson > 0.4:
        assert found > 0.4 * details(report).softening["beam"]


def test_the_error_falls_with_the_square_of_the_substep_and_is_reported():
    system = build_system(beam((4, 2, 2), 0.4, youngs=1e6))
    estimate = Softening(system)
    one, two = (estimate.by_body(h, None)["beam"] for h in (1e-3, 5e-4))
    assert one / (1 - one) == pytest.approx(4.0 * two / (1 - two), rel=1e-12)
    count, name = estimate.substeps(DT, 0.02, None)
    assert name == "beam"
    assert estimate.shares(DT / count, None)[0] <= 0.02 < estimate.shares(DT / (count - 1), None)[0]


def test_a_frame_that_is_too_soft_says_how_much_and_what_helps():
    frame = next(sp.simulate(beam((4, 2, 2), 0.4, youngs=1e6), XPBD(substeps=10), DT, 1))
    assert frame.report.status == "softened"
    assert 0.02 < frame.report.softening["beam"] < 1.0
    text, remedy = frame.report.message.split("; take substeps=")
    assert text.startswith("body 'beam' about ")
    enough = next(sp.simulate(beam((4, 2, 2), 0.4, youngs=1e6), XPBD(substeps=int(remedy)), DT, 1))
    assert enough.report.status == "converged"


@pytest.mark.parametrize(
    ("divisions", "poisson"),
    [((8, 2, 2), 0.45), ((16, 4, 4), 0.3), pytest.param((32, 5, 5), 0.3, marks=pytest.mark.slow)],
)
def test_what_is_measured_bounds_the_error_of_the_work_of_the_weight(divisions, poisson):
    scene = beam(divisions, poisson)
    system, start, static = at_rest(scene)
    fine = 40 if divisions[0] == 32 else 20
    for substeps in (fine, 2 * fine):
        *_, (state, report) = hanging(system, static, XPBD(substeps=substeps, contact=None))
        fall = [float(system.masses @ (item.positions - start.positions)[:, 1]) for item in (state, static)]
        share = details(report).softening["beam"]
        assert -1e-3 < fall[0] / fall[1] - 1.0 < 1.02 * share / (1.0 - share)
    # Where tensile and shear stresses cancel between tets, the estimate is too high by far.
    estimate = Softening(system).by_body(DT / substeps, None)["beam"]
    assert poisson > 0.4 or share < 0.75 * estimate


def test_a_slender_beam_that_slowly_gives_way_is_not_called_converged():
    scene = beam((32, 5, 5), 0.3)
    system, start, static = at_rest(scene)
    frames = list(hanging(system, static, XPBD(substeps=20, contact=None), frames=60))
    fall = [(item.positions - start.positions)[:, 1].min() for item in (frames[-1][0], static)]
    assert fall[0] / fall[1] > 1.03
    assert all(report.status != "converged" for _, report in frames)


@pytest.mark.parametrize(("divisions", "poisson", "ratio"), [((8, 2, 2), 0.0, 1.0), ((16, 4, 4), 0.3, 0.75)])
def test_measured_bodies_take_fewer_substeps_and_stay_within_the_accuracy(divisions, poisson, ratio):
    system, start, static = at_rest(beam(divisions, poisson))
    frames = list(hanging(system, static, XPBD(accuracy=0.005, contact=None)))
    fall = [float(system.masses @ (item.positions - start.positions)[:, 1]) for item in (frames[-1][0], static)]
    assert abs(fall[0] / fall[1] - 1.0) < 0.005
    assert all(report.status == "converged" and not details(report).repeats for _, report in frames)
    assert frames[-1][1].iterations <= ratio * frames[0][1].iterations


def test_the_sag_of_a_stretched_beam_is_within_the_accuracy_although_stretching_hides_it():
    mesh = sp.shapes.box((0.4, 0.1, 0.1), (8, 2, 2))
    body = sp.Body("beam", mesh, sp.StableNeoHookean(youngs=1e5, poisson=0.45, density=1000))
    pull = sp.Keyframes(times=[0, 1], displacements=[[0, 0, 0], [0.12, 0, 0]])
    left, right = (np.flatnonzero(sign * mesh.vertices[:, 0] > 0.199) for sign in (-1, 1))
    pins = [sp.Pin("beam", left, name="left"), sp.Pin("beam", right, name="right", motion=pull)]
    scenes = [sp.Scene([body], pins=pins, gravity=(0, -gravity, 0)) for gravity in (0.0, 5.0)]
    solver = sp.Implicit(integrator="static", contact=None)
    level, static = (list(sp.simulate(scene, solver, 1.0, 2))[-1].state for scene in scenes)
    still = State(2.0, static.positions, np.zeros_like(static.positions))
    *_, (state, report) = hanging(build_system(scenes[1]), still, XPBD(contact=None), frames=150)
    lowest = np.abs(static.positions - level.positions)[:, 1].argmax()
    fall = [(item.positions - level.positions)[lowest, 1] for item in (state, static)]
    assert report.status == "converged"
    assert abs(fall[0] / fall[1] - 1.0) < 0.02


def test_what_sleeps_keeps_its_measurement_and_other_bodies_have_none():
    system = build_system(beam((4, 2, 2), 0.4))
    estimate, x = Softening(system), system.rest_positions
    first = estimate.after(None, np.array([[1e-3, 1.0, 2e-3]]), 1e-3, np.zeros(1, dtype=bool), x)
    slept = estimate.after(first, np.zeros((1, 3)), 5e-4, np.ones(1, dtype=bool), x)
    # Errors fall with the square of the substep.
    np.testing.assert_allclose(slept.sums, [[2.5e-4, 1.0, 5e-4]], rtol=1e-12)
    awake = estimate.after(slept, np.array([[1e-3, 1.0, 2e-3]]), 5e-4, np.zeros(1, dtype=bool), x)
    np.testing.assert_allclose(awake.sums, [[1.2e-3, 1.8, 2.4e-3]], rtol=1e-12)
    assert estimate.own(awake) is awake
    assert Softening(build_system(beam((4, 2, 2), 0.4, youngs=1e6))).own(awake) is None


def test_stiffness_that_no_compliance_defines_is_not_estimated():
    hard = sp.EdgesAndVolume(edge_compliance=0.0)
    system = build_system(sp.Scene([sp.Body("hard", sp.shapes.box((1, 1, 1), (2, 2, 2)), hard)]))
    assert Softening(system).rates.tolist() == [0.0]
