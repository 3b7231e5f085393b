"""Implicit time integration against mechanics: free fall, momenta, energies, orders of convergence."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tests.scenes import at_start, converged

import supple as sp
from supple.model.system import build_system
from supple.runtime import parallel_kernel
from supple.solvers.implicit import solver
from supple.solvers.implicit.solver import Implicit
from supple.solvers.implicit.stepping.integrators import integrator_of
from supple.solvers.implicit.stepping.substep import StepSettings

DYNAMIC = ("backward_euler", "bdf2", "newmark")


def cube(density=1000.0, youngs=2e4, poisson=0.3, divisions=(2, 2, 2), size=0.2, damping=0.0, **body):
    material = sp.StableNeoHookean(youngs=youngs, poisson=poisson, density=density, damping=damping)
    return sp.Body("cube", sp.shapes.box((size, size, size), divisions), material, **body)


def run(scene, solver, dt, steps, **start):
    return converged(sp.simulate(scene, solver, dt, steps, **start))


def squeezed(body):
    mesh = body.mesh
    x = (mesh.vertices - mesh.vertices.mean(axis=0)) * np.array([1.15, 0.9, 1.0])
    return {"cube": x}


def test_free_fall_solves_the_discrete_equation():
    body = cube(position=(0, 10, 0))
    h, g = 1 / 60, 9.81
    for frame in run(sp.Scene([body]), Implicit(), h, 30):
        n = frame.index
        fallen = frame.positions["cube"] - body.place(body.mesh.vertices)
        assert np.abs(fallen[:, 1] + g * h * h * n * (n + 1) / 2).max() < 1e-13
        assert np.abs(fallen[:, [0, 2]]).max() < 1e-13


@pytest.mark.parametrize("integrator", ["bdf2", "newmark"])
def test_second_order_free_fall(integrator):
    body = cube(velocity=(1, 2, 0))
    last = run(sp.Scene([body]), Implicit(integrator=integrator), 0.01, 50)[-1]
    fallen = (last.positions["cube"] - body.place(body.mesh.vertices)).mean(axis=0)
    exact = np.array([0.5, 2 * 0.5 - 0.5 * 9.81 * 0.25, 0.0])
    # The trapezoidal rule is exact for a parabola; BDF2 is after its first step, of backward Euler.
    assert np.abs(fallen - exact).max() < (1e-12 if integrator == "newmark" else 1e-3)


@pytest.mark.parametrize("integrator", DYNAMIC)
def test_linear_momentum_is_conserved(integrator):
    body = cube(velocity=(1.0, -2.0, 0.5), angular_velocity=(0, 3, 1))
    scene = sp.Scene([body], gravity=(0, 0, 0))
    frames = run(scene, Implicit(integrator=integrator), 1 / 60, 20, initial_positions=squeezed(body))
    momenta = np.array([frame.report.linear_momentum for frame in frames])
    assert np.abs(momenta - momenta[0]).max() < 1e-10 * np.linalg.norm(momenta[0])


@pytest.mark.parametrize(("integrator", "order"), [("backward_euler", 1), ("bdf2", 2)])
def test_angular_momentum_error_falls_at_the_expected_order(integrator, order):
    body = cube(angular_velocity=(0, 4, 0), youngs=5e4)
    scene = sp.Scene([body], gravity=(0, 0, 0))
    errors = []
    for steps in (16, 32, 64):
        frames = run(scene, Implicit(integrator=integrator, tolerance=1e-7), 0.16 / steps, steps)
        L0 = at_start(scene).angular_momentum
        errors.append(np.linalg.norm(frames[-1].report.angular_momentum - L0))
    rate = np.log2(errors[0] / errors[2]) / 2
    assert rate > order - 0.25
    assert errors[-1] < 0.05 * np.linalg.norm(L0)


@pytest.mark.parametrize("damping", [0.0, 0.02])
def test_newmark_keeps_angular_momentum(damping):
    body = cube(angular_velocity=(0, 4, 1), youngs=5e4, damping=damping)
    scene = sp.Scene([body], gravity=(0, 0, 0))
    L0 = at_start(scene).angular_momentum
    for frame in run(scene, Implicit(integrator="newmark"), 1 / 60, 30):
        assert np.linalg.norm(frame.report.angular_momentum - L0) < 1e-12 * np.linalg.norm(L0)


def energy(frame):
    r = frame.report
    return r.kinetic_energy + r.elastic_energy + r.potential_energy


def test_trapezoidal_conserves_the_energy_and_backward_euler_only_loses_it():
    body = cube(angular_velocity=(0, 2, 1), youngs=2e4)
    scene = sp.Scene([body], gravity=(0, 0, 0))
    period = 2 * 0.2 / np.sqrt(2e4 / 1000.0)  # of a wave through the cube and back
    steps = 200
    start = {"initial_positions": {"cube": squeezed(body)["cube"]}}
    frames = run(scene, Implicit(integrator="newmark"), 10 * period / steps, steps, **start)
    kept = np.array([energy(frame) for frame in frames])
    assert np.abs(kept / kept[0] - 1).max() < 0.01
    lost = np.array([energy(f) for f in run(scene, Implicit(), 10 * period / 100, 100, **start)])
    assert np.all(np.diff(lost) < 1e-9 * lost[0])
    assert lost[-1] < 0.8 * lost[0]


@cache
def turned_and_fallen(method, steps):
    scene = sp.Scene([cube(angular_velocity=(0, 2, 0), youngs=1e4)])
    return run(scene, Implicit(integrator=method, tolerance=1e-7), 0.08 / steps, steps)[-1].positions["cube"]


@pytest.mark.parametrize(("integrator", "order"), [("backward_euler", 1), ("bdf2", 2), ("newmark", 2)])
def test_orders_of_convergence(integrator, order):
    exact = turned_and_fallen("newmark", 160)
    errors = [np.abs(turned_and_fallen(integrator, steps) - exact).max() for steps in (10, 20, 40)]
    assert np.log2(errors[0] / errors[2]) / 2 > order - 0.25


def test_damping_reduces_vibration_and_not_spin():
    body = cube(angular_velocity=(0, 5, 0), damping=0.02, youngs=2e5)
    undamped = cube(angular_velocity=(0, 5, 0), youngs=2e5)
    scenes = [sp.Scene([b], gravity=(0, 0, 0)) for b in (body, undamped)]
    damped, free = (run(s, Implicit(integrator="newmark"), 1 / 240, 40)[-1].report for s in scenes)
    # The stretch that the spin causes begins suddenly: without damping it oscillates.
    assert damped.angular_momentum[1] == pytest.approx(free.angular_momentum[1], rel=2e-3)
    start = squeezed(body)
    rung = [run(s, Implicit(integrator="newmark"), 1 / 240, 40, initial_positions=start)[-1].report for s in scenes]
    assert rung[0].elastic_energy < 0.05 * rung[1].elastic_energy


def test_damped_newmark_and_bdf2_agree_with_a_fine_reference():
    body = cube(damping=0.01, youngs=1e4)
    scene = sp.Scene([body], gravity=(0, 0, 0))

    def end(method, steps):
        solver = Implicit(integrator=method, tolerance=1e-7)
        return run(scene, solver, 0.05 / steps, steps, initial_positions=squeezed(body))[-1].positions["cube"]

    exact = end("newmark", 80)
    for method in ("bdf2", "newmark"):
        coarse, fine = (np.abs(end(method, steps) - exact).max() for steps in (10, 20))
        assert coarse / fine > 3.2


def test_half_the_default_tolerance_gives_the_same_result():
    body = cube(youngs=2e4, divisions=(3, 3, 3))
    scene = sp.Scene([body], pins=[sp.Pin("cube", sp.InBox((-1, 0.0999, -1), (1, 0.2, 1)))])
    usual, tight = (run(scene, Implicit(tolerance=t), 1 / 60, 30)[-1].positions["cube"] for t in (1e-3, 5e-4))
    assert np.abs(usual - tight).max() < 1e-4 * 0.2 * np.sqrt(3)


def test_a_restart_without_memory_begins_bdf2_with_backward_euler():
    body = cube(angular_velocity=(0, 2, 0))
    scene = sp.Scene([body])
    frames = run(scene, Implicit(integrator="bdf2"), 0.01, 3)
    again = run(scene, Implicit(integrator="bdf2"), 0.01, 1, start=frames[1])[-1]
    assert np.array_equal(again.positions["cube"], frames[2].positions["cube"])
    bare = replace(frames[1].state, memory=None)
    euler = run(scene, Implicit(), 0.01, 1, start=bare)[-1]
    restarted = run(scene, Implicit(integrator="bdf2"), 0.01, 1, start=bare)[-1]
    assert np.array_equal(restarted.positions["cube"], euler.positions["cube"])


def test_same_bits_on_one_and_two_threads(monkeypatch):
    import numba

    if numba.config.NUMBA_NUM_THREADS < 2:
        pytest.skip("this machine has one core")
    body = cube(divisions=(5, 5, 5), damping=0.001, youngs=5e3)
    scene = sp.Scene([body], pins=[sp.Pin("cube", [0, 1, 2, 3])])
    monkeypatch.setattr(solver, "_SHARED_FROM", 0)
    monkeypatch.setattr(parallel_kernel, "_has_rows", lambda arguments, least: True)
    before = numba.get_num_threads()
    found = []
    try:
        for threads in (1, 2):
            numba.set_num_threads(threads)
            found.append(run(scene, Implicit(), 1 / 60, 5)[-1].state)
    finally:
        numba.set_num_threads(before)
    assert found[0].positions.tobytes() == found[1].positions.tobytes()
    assert found[0].velocities.tobytes() == found[1].velocities.tobytes()


def test_a_spinning_box_turns_over_as_exactly_with_the_default_tolerance_as_with_a_tight_one():
    """About the middle axis, what Newton's method leaves grows exponentially: with 1e-3 1/s in steps of 1/240 s to .024
    rad/s, which is more than in steps of 1/120 s."""
    ends = []
    for tolerance in (None, 1e-9):
        box = sp.RigidBody(
            "box", sp.shapes.box((0.1, 0.23, 0.31), (1, 1, 1)), density=1000.0, angular_velocity=(0.02, 6.0, 0.03)
        )
        scene = sp.Scene([box], gravity=(0, 0, 0))
        *_, last = sp.simulate(scene, Implicit(integrator="bdf2", tolerance=tolerance), 1 / 240, 590)
        pose = last.poses["box"]
        ends.append(pose.rotation.T @ pose.angular_velocity)
    assert ends[0][1] < -3.0  # it has turned over
    assert np.abs(ends[1] - ends[0]).max() < 1e-3


@pytest.mark.parametrize(("integrator", "fine"), [("backward_euler", 1 / 60), ("bdf2", 1 / 15)])
def test_the_default_tolerance_of_velocities_falls_with_the_square_of_short_steps(integrator, fine):
    method = integrator_of(integrator)
    settings = StepSettings(method, None, 1e-4, 120, 0.1, 0.1)
    system = build_system(sp.Scene([cube()]))
    workspace = Implicit(integrator=integrator, contact=None).prepare(system)
    speeds = [settings.shortest(workspace, h, ()) / h / workspace.diagonal for h in (2 * fine, fine, fine / 2)]
    assert speeds == pytest.approx([1e-3, 1e-3, 2.5e-4])
    shortest = [settings.shortest(workspace, h, ()) / workspace.diagonal for h in (1e-4, 1e-7)]
    assert shortest == pytest.approx([1e-9, 1e-10])  # round-off, and never looser than 1e-3 1/s
    # Without a history, BDF2 is backward Euler.
    euler = replace(settings, integrator=integrator_of("backward_euler"))
    assert settings.shortest(workspace, 0.01, None) == euler.shortest(workspace, 0.01, None)
