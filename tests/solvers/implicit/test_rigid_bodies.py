"""Rigid bodies in `Implicit`: laws of free motion, contact with everything else, pins that hold and move them."""

import numpy as np
import pytest
from tests.scenes import FLOOR, G, converged, momenta, rigid, soft

import supple as sp
from supple.contact.start.separation import separate
from supple.errors import SolverError


def run(scene, dt, steps, integrator="backward_euler", **more):
    return converged(sp.simulate(scene, sp.Implicit(integrator=integrator), dt, steps, **more))


def error_of(frames):
    return max(max(frame.report.details.orthogonality_errors.values()) for frame in frames)


def test_free_fall_of_backward_euler_is_exact():
    frames = run(sp.Scene([rigid(velocity=(1.0, 0.0, 0.0))]), 0.01, 20)
    n = 20
    pose = frames[-1].poses["rigid"]
    np.testing.assert_allclose(pose.translation, [0.2, -G * 1e-4 * n * (n + 1) / 2, 0.0], atol=1e-13)
    np.testing.assert_allclose(pose.velocity, [1.0, -G * 0.2, 0.0], atol=1e-11)
    assert error_of(frames) < 1e-12


@pytest.mark.parametrize(("under", "above", "masses"), [("soft", "rigid", (1e-3, 1e3)), ("rigid", "soft", (1e-3, 1e3))])
def test_heavy_on_light(under, above, masses):
    """A million times as heavy as what carries it, in kilograms."""
    made = {}
    for name, mass, height in ((under, masses[0], 0.0502), (above, masses[1], 0.1505)):
        values = {"density": 1e3 * mass, "position": (0, height, 0)}
        made[name] = soft(youngs=1e8 if mass < 1.0 else 1e7, **values) if name == "soft" else rigid(**values)
    frames = run(sp.Scene(list(made.values()), obstacles=[FLOOR]), 1 / 60, 30)
    forces = frames[-1].report.details.contact_forces
    total = sum(masses) * G
    assert -forces["floor"][1] == pytest.approx(total, rel=1e-3)
    assert forces[above][1] == pytest.approx(masses[1] * G, rel=1e-3)
    assert error_of(frames) < 1e-2
    bottom, top = (frames[-1].positions[name][:, 1] for name in (under, above))
    assert bottom.min() > 0.0
    assert top.min() > 0.099 - 0.01 * (above == "soft")


def test_a_pile_of_rigid_and_soft_bodies_rests_without_intersecting():
    bodies = [
        rigid("a", position=(0, 0.0505, 0), friction=0.5),
        soft("b", position=(0.02, 0.152, 0), friction=0.5),
        rigid("c", position=(0, 0.254, 0.02), rotation=(0, 0.4, 0), friction=0.5),
    ]
    scene = sp.Scene(bodies, obstacles=[FLOOR])
    frames = run(scene, 1 / 60, 30)
    forces = frames[-1].report.details.contact_forces
    assert -forces["floor"][1] == pytest.approx(3.0 * G, rel=0.02)
    assert sum(forces.values()) == pytest.approx(np.zeros(3), abs=1e-9)
    assert frames[-1].report.kinetic_energy < 1e-4
    # The next run starts from there, which raises where surfaces intersect.
    assert run(scene, 1 / 60, 1, start=frames[-1].state)[0].report.min_distance > 0.0


@pytest.mark.parametrize("other", ["rigid", "soft"])
def test_a_collision_keeps_momentum(other):
    """Off the center, with friction. Contact acts where bodies are at the end of a step: L is not kept exactly."""
    hit = {"position": (0.13, 0.03, 0.02), "velocity": (-1.0, 0.0, 0.0), "friction": 0.5}
    bodies = [rigid("a", friction=0.5), rigid("b", **hit) if other == "rigid" else soft("b", **hit)]
    frames = run(sp.Scene(bodies, gravity=(0, 0, 0)), 7.5e-4, 160, "bdf2")
    P, L = momenta(frames)
    pushes = [np.linalg.norm(f.report.details.contact_forces["a"]) for f in frames]
    assert max(pushes) > 10.0
    assert np.abs(P - P[0]).max() <= 1e-10 * np.linalg.norm(P[0])
    assert np.abs(L - L[0]).max() <= 5e-3 * np.linalg.norm(L[0])
    assert frames[-1].poses["a"].velocity[0] < -0.2


@pytest.mark.slow
@pytest.mark.parametrize(("wide", "high", "dt", "steps"), [(3, 3, 1 / 60, 60), (5, 8, 1 / 120, 42)])
def test_a_heap_of_boxes_never_intersects(tmp_path, wide, high, dt, steps):
    """27 boxes come to rest; 200 fall into each other."""
    rng, places = np.random.default_rng(0), np.ndindex(wide, wide, high)
    bodies = [
        rigid(
            f"{i}{j}{k}", position=(0.16 * i, 0.1 + 0.17 * k, 0.16 * j), rotation=0.3 * rng.normal(size=3), friction=0.4
        )
        for i, j, k in places
    ]
    path = tmp_path / "heap.vtkhdf"
    frames = run(sp.Scene(bodies, obstacles=[FLOOR]), dt, steps, sinks=[sp.Recorder(path, solver=sp.Implicit())])
    assert error_of(frames) < 1e-3
    assert wide > 3 or frames[-1].report.kinetic_energy < 1e-4
    report = sp.check_recording(path)
    assert report.ok, report.failures


def test_a_ring_hangs_on_a_bar():
    """Neither surface is replaced by its convex hull, in which the bar would be inside of the ring from the start."""
    ring = rigid("ring", sp.shapes.torus_surface(0.1, 0.03, 0.03), position=(0, -0.048, 0), rotation=(np.pi / 2, 0, 0))
    bar = rigid("bar", sp.shapes.box_surface((0.03, 0.03, 0.5), (1, 1, 1)))
    scene = sp.Scene([ring, bar], pins=[sp.Pin("bar")])
    frames = run(scene, 1 / 60, 40)
    weight = ring.properties.mass * G
    details = frames[-1].report.details
    assert details.contact_forces["ring"][1] == pytest.approx(weight, rel=0.02)
    np.testing.assert_array_equal(frames[-1].positions["bar"], frames[0].positions["bar"])
    held = details.reaction_forces["pin of body 'bar'"]
    np.testing.assert_allclose(held, [0.0, weight + bar.properties.mass * G, 0.0], atol=0.03 * weight)
    assert frames[-1].poses["ring"].translation[1] > -0.06


def test_a_body_that_a_pin_moves_and_turns_carries_others():
    path = sp.Keyframes([0.0, 1.0], displacements=[[0, 0, 0], [0, 0.2, 0]], angles=[0.0, np.pi], axis=(0, 1, 0))
    tray = rigid("tray", sp.shapes.box_surface((0.3, 0.02, 0.3), (2, 1, 2)), friction=0.8)
    cube = soft("cube", position=(0.0, 0.0605, 0.0), friction=0.8)
    scene = sp.Scene([tray, cube], pins=[sp.Pin("tray", motion=path)])
    frames = run(scene, 1 / 60, 60)
    x = frames[-1].positions["cube"]
    assert x[:, 1].min() > 0.2
    # Friction has turned the cube as well: its corners have changed sides.
    first = x[np.argmin(cube.mesh.vertices.sum(axis=1))]
    assert first[0] > 0.03
    assert first[2] > 0.03


def test_a_run_goes_on_from_positions_and_velocities_of_surfaces():
    """Up to round-off."""
    scene = sp.Scene(
        [rigid(position=(0, 0.07, 0), rotation=(0.2, 0, 0)), soft(position=(0.2, 0.06, 0))], obstacles=[FLOOR]
    )
    first, second = run(scene, 1 / 60, 2)
    given = run(scene, 1 / 60, 1, initial_positions=first.positions, initial_velocities=first.velocities)
    np.testing.assert_allclose(given[0].positions["rigid"], second.positions["rigid"], atol=1e-9)


def test_bodies_that_intersect_at_the_start_are_separated():
    apart = separate(sp.Scene([rigid("a"), rigid("b", position=(0.0, 0.09, 0.0))]))
    assert [move.body for move in apart.moves] == ["b"]
    assert run(apart.scene, 0.01, 1)[0].report.status == "converged"


def test_a_plate_pressed_on_a_soft_cube_in_equilibrium():
    """Forces of both pins balance; the cube carries about E A times its strain, more as its ends cannot widen."""
    cube = soft(position=(0, 0.05, 0))
    bottom = np.flatnonzero(cube.mesh.vertices[:, 1] == cube.mesh.vertices[:, 1].min())
    plate = rigid("plate", sp.shapes.box_surface((0.14, 0.02, 0.14), (1, 1, 1)), position=(0, 0.1105, 0))
    press = sp.Pin("plate", motion=lambda t: (0, -0.005 * t, 0), name="press")
    scene = sp.Scene([cube, plate], pins=[sp.Pin("soft", bottom), press], gravity=(0, 0, 0))
    (frame,) = run(scene, 1.0, 1, "static")
    details = frame.report.details
    up, down = details.reaction_forces["pin of body 'soft'"], details.reaction_forces["pin 'press' of body 'plate'"]
    np.testing.assert_allclose(up, -down, atol=1e-6 * up[1])
    np.testing.assert_allclose(details.contact_forces["plate"], up, atol=1e-6 * up[1])
    strain = (0.1 - np.ptp(frame.positions["soft"][:, 1])) / 0.1
    assert 1.0 < up[1] / (1e5 * 0.01 * strain) < 1.3


def test_newmark_refuses_rigid_bodies():
    with pytest.raises(SolverError, match=r"^body 'rigid': Implicit\(integrator='newmark'\) .* use 'bdf2'$"):
        run(sp.Scene([rigid()]), 0.01, 1, "newmark")
