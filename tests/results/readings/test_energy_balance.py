"""The balance of energy: works against closed forms, numerical losses that vanish, residuals that stay small."""

import numpy as np
import pytest

import supple as sp

CUBE = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
BAR = sp.shapes.box((0.3, 0.1, 0.1), (3, 1, 1))
RUBBER = sp.StableNeoHookean(youngs=2e4, poisson=0.4, damping=0.02)
SOLVERS = [sp.Implicit(integrator="newmark", tolerance=1e-6), sp.XPBD(substeps=40)]
NAMES = ["implicit", "xpbd"]
LEFT, RIGHT = sp.InBox((-0.16, -1, -1), (-0.149, 1, 1)), sp.InBox((0.149, -1, -1), (0.16, 1, 1))


def totals(scene, solver, steps=20, **options):
    """The sums of all works and of the residual's absolute value, the first report and the last [J]."""
    dt = 1.0 / 60.0
    frames = list(sp.simulate(scene, solver, dt, steps, **options))
    work = {name: sum(frame.report.work[name] for frame in frames) for name in frames[0].report.work}
    return work, sum(abs(frame.report.energy_residual) for frame in frames), frames


def moving_parts():
    """A bar with every kind of load, in the hand of a pin that moves it."""
    return sp.Scene(
        [sp.Body("bar", BAR, RUBBER)],
        pins=[sp.Pin("bar", LEFT, motion=lambda t: (0.0, 0.02 * (1.0 - np.cos(12.0 * t)), 0.0))],
        loads=[
            sp.Pressure("bar", 500.0),
            sp.Traction("bar", (20, 0, 0), RIGHT),
            sp.BodyForce((0, 1.0, 0)),
            sp.Spring(("bar", (0.1, 0, 0)), (None, (0.1, 0.3, 0)), stiffness=10.0),
            sp.Muscle("bar", 1e3, (1, 0, 0), sp.Curve([0, 0.2], [0, 1])),
        ],
        forces=[sp.Force("bar", [5], (0, 0.1, 0))],
        soft_targets=[sp.SoftTarget("bar", [7], stiffness=5.0)],
        cables=[sp.Cable([("bar", (x, 0.04, 0)) for x in (0.14, 0, -0.14)], tension=0.5, friction=0.1)],
    )  # fmt: skip


@pytest.mark.parametrize("solver", SOLVERS, ids=NAMES)
def test_the_works_of_all_kinds_close_the_balance(solver):
    work, residual, frames = totals(moving_parts(), solver)
    kinds = {"pins", "forces", "pressures", "tractions", "body_forces", "springs", "muscles", "soft_targets", "cables"}
    assert set(work) == kinds | {"contact", "friction", "damping", "numerical"}
    assert all(abs(work[name]) > 1e-5 for name in kinds)
    assert work["damping"] < 0.0
    assert work["contact"] == work["friction"] == 0.0
    sizes = sum(map(abs, work.values()))
    assert residual < 1e-4 * sizes
    assert abs(work["numerical"]) < 0.02 * sizes
    start = frames[0].report.energy - sum(frames[0].report.work.values()) - frames[0].report.energy_residual
    change = frames[-1].report.energy - start
    assert sum(work.values()) == pytest.approx(change, abs=residual + 1e-12)


def test_the_numerical_loss_of_xpbd_falls_with_the_length_of_its_substeps():
    loss = [abs(totals(moving_parts(), sp.XPBD(substeps=n), 6)[0]["numerical"]) for n in (20, 80)]
    assert loss[1] < 0.35 * loss[0]


@pytest.mark.parametrize("solver", [sp.Implicit(), sp.XPBD(substeps=10)], ids=NAMES)
def test_the_work_of_a_constant_force_is_force_times_way(solver):
    """A free cube of 1 kg; of each change of velocity dv, both solvers lose m |dv|^2 / 2."""
    scene = sp.Scene([sp.Body("cube", CUBE, RUBBER)], loads=[sp.BodyForce((2.0, 0, 0))], gravity=(0, 0, 0))
    work, residual, frames = totals(scene, solver, 10)
    way = (frames[-1].positions["cube"] - CUBE.vertices).mean(axis=0)[0]
    assert work["body_forces"] == pytest.approx(2.0 * way, rel=1e-9)
    assert frames[-1].report.kinetic_energy == pytest.approx(work["body_forces"] + work["numerical"], rel=1e-9)
    h = 1.0 / 60.0 / (1 if isinstance(solver, sp.Implicit) else 10)
    assert work["numerical"] == pytest.approx(-0.5 * 2.0**2 * h * (10.0 / 60.0), rel=1e-6)
    assert residual < 1e-9 * work["body_forces"]


@pytest.mark.parametrize(
    ("values", "rate"), [({"damping": 3.0}, 720), ({"friction": 5.0}, 240), ({"max_velocity": 1.0}, 240)]
)
@pytest.mark.parametrize("solver", ["implicit", "xpbd"])
def test_damping_and_friction_of_joints_take_energy(solver, values, rate):
    """In `Implicit`, works are those of the forces at the ends of steps: their error is of first order."""
    bar = sp.RigidBody("bar", sp.shapes.box_surface((1, 0.05, 0.05), (1, 1, 1)), density=1000, position=(0.5, 0, 0))
    scene = sp.Scene([bar], joints=[sp.HingeJoint("bar", point=(0, 0, 0), **values)])
    exact = sp.Implicit(integrator="bdf2", contact=None)
    solver, rate = (exact, rate) if solver == "implicit" else (sp.XPBD(substeps=40, contact=None), 60)
    frames = list(sp.simulate(scene, solver, 1 / rate, rate // 5))
    taken = sum(frame.report.work["joints"] for frame in frames)
    assert taken < -0.2
    assert taken == pytest.approx(frames[-1].report.energy, rel=5e-3)


@pytest.mark.parametrize("solver", [sp.Implicit(), sp.XPBD(substeps=20)], ids=NAMES)
def test_friction_takes_what_a_sliding_cube_loses(solver):
    """It starts at rest on its floor, so that normal forces do nearly no work."""
    body = sp.Body(
        "cube", CUBE, sp.StableNeoHookean(youngs=1e5, poisson=0.3), position=(0, 0.0502, 0), velocity=(1, 0, 0)
    )
    work, residual, frames = totals(sp.Scene([body], [sp.HalfSpace(friction=0.5)]), solver, 18)
    kinetic = 0.5 * 1.0 * 1.0
    assert frames[-1].report.kinetic_energy < 1e-2 * kinetic
    assert work["friction"] == pytest.approx(-kinetic, rel=0.1)
    assert abs(work["contact"]) < 0.1 * kinetic
    assert residual < 1e-3 * kinetic


def lifted(time):
    """By 0.2 m within half a second."""
    return 0.0, 0.1 * (1.0 - np.cos(2.0 * np.pi * min(time, 0.5))), 0.0


@pytest.mark.parametrize("solver", SOLVERS, ids=NAMES)
def test_a_pin_that_lifts_a_cube_gives_it_its_height(solver):
    body = sp.Body("cube", CUBE, sp.StableNeoHookean(youngs=1e6, poisson=0.3, damping=0.01))
    held = np.flatnonzero(CUBE.vertices[:, 1] > 0.0)
    work, _, frames = totals(sp.Scene([body], pins=[sp.Pin("cube", held, motion=lifted)]), solver, 45)
    # What XPBD's damping takes as the pin drags the rest along, its substeps give back: both are among the works.
    assert sum(work.values()) == pytest.approx(9.81 * 0.2, rel=0.02)
    assert work["pins"] == pytest.approx(9.81 * 0.2, rel=0.05)
    assert frames[-1].report.kinetic_energy < 1e-3


def test_an_obstacle_that_pushes_does_the_work_of_contact():
    """A wall of constant speed brings a cube to its speed: m v^2 of contact, half of it kinetic at the end."""
    push = sp.Keyframes([0, 1.0], [[0, 0, 0], [1.0, 0, 0]])
    wall = sp.HalfSpace(point=(-0.051, 0, 0), normal=(1, 0, 0), motion=push)
    body = sp.Body("cube", CUBE, sp.StableNeoHookean(youngs=2e4, poisson=0.3, damping=0.05))
    for solver in (sp.Implicit(), sp.XPBD(substeps=20)):
        work, residual, frames = totals(sp.Scene([body], [wall], gravity=(0, 0, 0)), solver, 30)
        end = frames[-1].report
        assert work["contact"] > 0.4
        assert end.energy == pytest.approx(sum(work.values()), abs=residual + 1e-9)
        assert residual < 1e-3


def test_cavities_and_flow():
    """A cavity's work is that of its reading, and what viscous flow dissipates is that of its internal variables."""
    shell = sp.shapes.spherical_shell(inner_radius=0.1, outer_radius=0.15, edge_length=0.08)
    cream = sp.Viscoelastic(material=sp.NeoHookean(youngs=1e5, poisson=0.4), prony=[(0.5, 0.1)])
    scene = sp.Scene([sp.Body("ball", shell, cream)], cavities=[sp.Cavity("ball", pressure=2e4)], gravity=(0, 0, 0))
    work, residual, frames = totals(scene, sp.Implicit(tolerance=1e-6), 5)
    assert work["cavities"] == pytest.approx(sum(f.report.cavities["ball"].work for f in frames), rel=1e-12)
    tets = sum((frames[-1].dissipated_energy["ball"] * shell.volumes).tolist())
    assert work["flow"] == pytest.approx(-tets, rel=1e-9)
    assert work["flow"] < 0.0
    assert residual < 1e-5 * work["cavities"]


def test_what_turns_without_change_of_shape_is_not_worked_on_by_its_muscle():
    """A free bar of 1e7 Pa whose muscle is in balance with it, turned by 0.5 rad in each step."""
    jelly, fibre = sp.StableNeoHookean(youngs=1e7, poisson=0.3), sp.Muscle("bar", 1e6, (1, 0, 0))
    still = sp.Scene([sp.Body("bar", BAR, jelly)], loads=[fibre], gravity=(0, 0, 0))
    *_, rest = sp.simulate(still, sp.Implicit(), 1.0, 4)
    bar = sp.Body("bar", BAR, jelly, angular_velocity=(0, 0, 30.0))
    turning = sp.Scene([bar], loads=[fibre], gravity=(0, 0, 0))
    work, _, frames = totals(turning, sp.Implicit(), 3, initial_positions=rest.positions)
    assert abs(work["muscles"]) < 0.02 * frames[0].report.elastic_energy
    assert work["numerical"] < 0.0


def test_growth_without_stress_does_the_work_of_its_motion():
    jelly, grows = sp.StableNeoHookean(youngs=1e6, poisson=0.3), sp.Growth("cube", sp.Curve([0, 1], [1, 2]))
    scene = sp.Scene([sp.Body("cube", CUBE, jelly)], loads=[grows], gravity=(0, 0, 0))
    work, _, frames = totals(scene, sp.Implicit(), 4)
    kinetic = frames[-1].report.kinetic_energy
    assert kinetic > 0.0
    assert 0.9 * kinetic < work["growth"] < 2.1 * kinetic


def test_growth_in_xpbd_goes_from_substep_to_substep():
    """A frame's growth at once strains a cube of 1 m that cannot follow: ten times as much energy as its motion has."""
    jelly, grows = sp.StableNeoHookean(youngs=1e6, poisson=0.3), sp.Growth("cube", sp.Curve([0, 1], [1, 2]))
    body = sp.Body("cube", sp.shapes.box((1, 1, 1), (2, 2, 2)), jelly)
    work, _, frames = totals(sp.Scene([body], loads=[grows], gravity=(0, 0, 0)), sp.XPBD(substeps=20), 4)
    assert frames[-1].report.elastic_energy < 0.1 * frames[-1].report.kinetic_energy
    assert -work["numerical"] < 0.5 * work["growth"]


def test_a_muscle_that_growth_stretches_leaves_nothing_to_the_numerical_work():
    """Both change in every step, so slowly that the bar is in balance."""
    jelly, rise = sp.StableNeoHookean(youngs=1e6, poisson=0.3), sp.Curve([0, 10], [0, 1])
    loads = [sp.Muscle("bar", 3e4, (1, 0, 0), rise), sp.Growth("bar", sp.Curve([0, 10], [1, 1.2]))]
    scene = sp.Scene([sp.Body("bar", BAR, jelly)], loads=loads, gravity=(0, 0, 0))
    *_, last = frames = list(sp.simulate(scene, sp.Implicit(tolerance=1e-6), 1.0, 8))
    work = {name: sum(frame.report.work[name] for frame in frames) for name in last.report.work}
    assert work["muscles"] < -0.1 * work["growth"] < 0.0
    assert last.report.elastic_energy == pytest.approx(work["muscles"] + work["growth"], rel=0.02)
