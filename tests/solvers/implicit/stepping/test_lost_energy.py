"""Steps that are too long for what they leave for good say so."""

import numpy as np

import supple as sp

CLAY = sp.J2Plastic(youngs=1e5, poisson=0.3, density=1000, yield_stress=2e3)
CUBE = sp.shapes.box((0.1, 0.1, 0.1), (4, 4, 4))
FLOOR = sp.HalfSpace(friction=0.5)


def fall(material, integrator, dt, steps, speed=3.0):
    cube = sp.Body("clay", CUBE, material, position=(0, 0.055, 0), velocity=(0, -speed, 0))
    solver = sp.Implicit(integrator=integrator)
    return [frame.report for frame in sp.simulate(sp.Scene([cube], [FLOOR]), solver, dt=dt, steps=steps)]


def test_a_clay_cube_that_falls_in_long_steps():
    reports = fall(CLAY, "backward_euler", 1 / 60, 12)
    assert reports[1].status == "time_step"
    assert "the shape that is left depends on dt" in reports[1].message
    assert reports[-1].status == "converged"  # at rest


def test_a_shorter_step_of_second_order_does():
    assert {report.status for report in fall(CLAY, "bdf2", 1 / 960, 30)} == {"converged"}


def test_what_only_bounces_or_recovers_says_nothing():
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1000)
    for material in (rubber, sp.Viscoelastic(material=rubber, prony=[(0.5, 0.1)])):
        assert {report.status for report in fall(material, "backward_euler", 1 / 60, 4)} == {"converged"}
    strong = sp.J2Plastic(youngs=1e5, poisson=0.3, density=1000, yield_stress=1e5)
    assert {report.status for report in fall(strong, "backward_euler", 1 / 60, 4)} == {"converged"}


def test_slow_pressing_in_long_steps_is_no_loss():
    y = CUBE.vertices[:, 1]
    pins = [
        sp.Pin("clay", np.flatnonzero(y == y.min())),
        sp.Pin("clay", np.flatnonzero(y == y.max()), sp.Keyframes([0, 1], displacements=[(0, 0, 0), (0, -0.03, 0)])),
    ]
    scene = sp.Scene([sp.Body("clay", CUBE, CLAY)], pins=pins, gravity=(0, 0, 0))
    frames = list(sp.simulate(scene, sp.Implicit(), dt=1 / 15, steps=15))
    assert {frame.report.status for frame in frames} == {"converged"}
    assert frames[-1].report.work["flow"] < 0.0
