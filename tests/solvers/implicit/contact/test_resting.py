"""What rests on something presses on it with its weight, whatever that is made of."""

import numpy as np
import pytest
from tests.scenes import converged

import supple as sp

WEIGHT = 0.2**3 * 1000.0 * 9.81
SHEET = sp.SurfaceMesh([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 2, 1], [0, 3, 2]])
SUPPORTS = {
    "half-space": sp.HalfSpace(),
    "box": sp.obstacles.Box(center=(0, -0.5, 0), size=(2, 1, 2)),
    "sheet from above": sp.obstacles.TriangleObstacle(surface=SHEET),
    "sheet from below": sp.obstacles.TriangleObstacle(surface=sp.SurfaceMesh(SHEET.vertices, SHEET.triangles[:, ::-1])),
    "room": sp.obstacles.Box(center=(0, 0.5, 0), size=(1, 1, 1), inside=True),
    "bowl": sp.obstacles.Sphere(center=(0, 1, 0), radius=1, inside=True),
}


def block(**body):
    material = sp.StableNeoHookean(youngs=2e4, poisson=0.3, density=1000.0)
    return sp.Body("cube", sp.shapes.box((0.2, 0.2, 0.2), (2, 2, 2)), material, **body)


def settled(scene, dt=0.05, steps=30, **solver):
    frames = converged(sp.simulate(scene, sp.Implicit(**solver), dt, steps))
    assert all(frame.report.min_distance is None or frame.report.min_distance > 0.0 for frame in frames)
    return frames[-1]


@pytest.mark.parametrize("kind", SUPPORTS)
def test_a_resting_cube_presses_with_its_weight(kind):
    start = 0.13 if kind == "bowl" else 0.1005
    frame = settled(sp.Scene([block(position=(0, start, 0))], obstacles=[SUPPORTS[kind]]))
    forces = frame.report.details.contact_forces
    name = next(key for key in forces if key != "cube")
    assert forces["cube"][1] == pytest.approx(WEIGHT, rel=1e-3)
    assert np.abs(forces["cube"] + forces[name]).max() < 1e-6 * WEIGHT
    assert np.abs(forces["cube"][[0, 2]]).max() < 1e-3 * WEIGHT
    assert frame.report.min_distance is not None
    assert 0.0 < frame.report.min_distance < frame.report.details.dhat
    assert frame.report.details.contacts == len(frame.contacts)


def test_a_ball_presses_on_the_ball_below():
    """A cup that hangs over a ball: contact outside a sphere."""
    ball = sp.obstacles.Sphere(center=(0, -0.5, 0), radius=0.5)
    frame = settled(sp.Scene([block(position=(0, 0.103, 0))], obstacles=[ball]), steps=12)
    assert frame.report.details.contact_forces["cube"][1] == pytest.approx(WEIGHT, rel=0.02)


@pytest.mark.parametrize("integrator", ["bdf2", "newmark"])
def test_second_order_integrators_report_the_weight(integrator):
    """Newmark's method multiplies contact energies by two; the reported force must not be."""
    material = sp.StableNeoHookean(youngs=2e4, poisson=0.3, density=1000.0, damping=0.02)
    body = sp.Body("cube", sp.shapes.box((0.2, 0.2, 0.2), (2, 2, 2)), material, position=(0, 0.1002, 0))
    scene = sp.Scene([body], obstacles=[sp.HalfSpace()])
    frames = converged(sp.simulate(scene, sp.Implicit(integrator=integrator), 0.01, 120))
    mean = np.mean([frame.report.details.contact_forces["cube"][1] for frame in frames[40:]])
    assert mean == pytest.approx(WEIGHT, rel=0.03)


def test_statics_presses_until_the_forces_balance():
    """A held block pressed against the floor by a soft target: three forces whose sum is zero."""
    body = block(position=(0, 0.101, 0))
    mesh = body.mesh
    top = np.flatnonzero(mesh.vertices[:, 1] > 0.09)
    target = sp.SoftTarget("cube", top, stiffness=500.0, motion=lambda t: (0, -0.02 * t, 0))
    pin = sp.Pin("cube", top[:1])
    scene = sp.Scene([body], obstacles=[sp.HalfSpace()], soft_targets=[target], pins=[pin], gravity=(0, 0, 0))
    frames = converged(sp.simulate(scene, sp.Implicit(integrator="static"), 0.5, 2))
    last = frames[-1]
    away = body.place(mesh.vertices)[top] + np.array([0, -0.02, 0]) - last.positions["cube"][top]
    pulled = 500.0 * away.sum(axis=0)
    details = last.report.details
    held = sum(details.reaction_forces.values())
    pressed = details.contact_forces["cube"]
    assert pressed[1] > 1.0
    # The pinned vertex is pulled by its target, too, which the pin has to bear.
    assert np.abs(pulled + held + pressed).max() < 1e-4 * np.abs(pressed).max()
