"""Rigid bodies in `XPBD`: laws of free motion, contact with everything else, pins that hold and move them."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from tests import scenes
from tests.scenes import BOX, CUBE, FLOOR, SPIN, G, converged, flips_of, flips_of_eulers_equations, momenta, soft

import supple as sp

rigid = partial(scenes.rigid, friction=0.5)


def run(scene, steps, substeps=20, dt=1 / 60, *, statuses=("converged",), **more):
    frames = list(sp.simulate(scene, sp.XPBD(substeps=substeps, **({"sleep_after": None} | more)), dt, steps))
    assert {frame.report.status for frame in frames} <= set(statuses), [
        f.report.message for f in frames if f.report.message
    ]
    return frames


def rigidity(frames, name="rigid", shape=CUBE):
    """The largest error of a distance between two vertices of the surface [m]."""
    sides = np.linalg.norm(shape.vertices[:, None] - shape.vertices, axis=2)
    found = (np.linalg.norm(f.positions[name][:, None] - f.positions[name], axis=2) for f in frames)
    return max(np.abs(item - sides).max() for item in found)


def test_a_free_body_keeps_its_momenta_and_its_energy_over_10000_substeps():
    body = rigid(shape=BOX, velocity=(1, 2, 3), angular_velocity=(1, 4, 2))
    frames = run(sp.Scene([body], gravity=(0, 0, 0)), 125, substeps=80)
    P, L = momenta(frames)
    assert np.abs(P - P[0]).max() <= 1e-12 * np.linalg.norm(P[0])
    assert np.abs(L - L[0]).max() <= 1e-10 * np.linalg.norm(L[0])
    energies = np.array([frame.report.kinetic_energy for frame in frames])
    assert np.ptp(energies) < 1e-11 * energies[0]
    assert rigidity(frames, shape=BOX) < 1e-13


@pytest.mark.parametrize(("substeps", "late"), [(10, 1e-3), (80, 2e-4)])
def test_the_intermediate_axis_turns_over_when_eulers_equations_say(substeps, late):
    """The Dzhanibekov effect, twice."""
    body = rigid(shape=BOX, angular_velocity=SPIN)
    exact = flips_of_eulers_equations(np.diag(body.properties.inertia), 2.8)
    assert len(exact) == 2
    frames = run(sp.Scene([body], gravity=(0, 0, 0)), 168, substeps)
    np.testing.assert_allclose(flips_of(frames, 1 / 60), exact, rtol=late)


def wheel(count, radius, half=0.02):
    """A prism of `count` sides."""
    angle, i = 2.0 * np.pi * np.arange(count) / count, np.arange(count)
    ring = [np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, z)]) for z in (-half, half)]
    j, low, high = (i + 1) % count, np.full(count, 2 * count), np.full(count, 2 * count + 1)
    corners = [(i, j, count + j), (i, count + j, count + i), (low, j, i), (high, count + i, count + j)]
    triangles = np.concatenate([np.column_stack(item) for item in corners])
    return sp.SurfaceMesh(np.concatenate([*ring, [[0, 0, -half], [0, 0, half]]]), triangles)


def acceleration_of_a_wheel(sides, friction):
    """With a ball's inertia, down 15 degrees, over 5/7 g sin a; and the share that its spin has of rolling."""
    slope, radius = np.radians(15.0), 0.1
    normal, down = np.array([np.sin(slope), np.cos(slope), 0.0]), np.array([np.cos(slope), -np.sin(slope), 0.0])
    plane = sp.HalfSpace(point=(0, 0, 0), normal=normal, friction=friction)
    inertia = np.full(3, 0.4 * radius**2)
    body = sp.RigidBody("wheel", wheel(sides, radius), mass=1, inertia=inertia, position=(radius + 1e-5) * normal)
    poses = [f.poses["wheel"] for f in run(sp.Scene([body], obstacles=[plane]), 45)]
    rate, spin = (
        60.0 * np.polyfit(np.arange(40), values[5:], 1)[0]
        for values in (np.array([p.velocity @ down for p in poses]), np.array([-p.angular_velocity[2] for p in poses]))
    )
    return rate / (5 / 7 * G * np.sin(slope)), spin * radius / rate


def test_a_wheel_slides_on_a_smooth_slope_and_rolls_like_a_ball_on_a_rough_one():
    """Each side that hits the slope takes energy, in proportion to its length: rolling is approached from below."""
    sliding, _ = acceleration_of_a_wheel(60, 0.03)
    assert sliding == pytest.approx(1.4 * (1.0 - 0.03 / np.tan(np.radians(15.0))), rel=2e-3)
    coarse, fine = acceleration_of_a_wheel(60, 0.3), acceleration_of_a_wheel(240, 0.3)
    assert fine[1] == pytest.approx(1.0, rel=2e-3)
    assert 0.95 < fine[0] < 1.0
    assert 1.0 - fine[0] < 0.4 * (1.0 - coarse[0])


@pytest.mark.parametrize("other", [rigid("other", BOX), soft("other", friction=0.5)], ids=["rigid", "soft"])
def test_a_collision_keeps_both_momenta(other):
    """Off the center, with spin and friction."""
    first = rigid(velocity=(1, 0, 0), angular_velocity=(1, 5, 2))
    hit = replace(other, position=(0.2, 0.04, 0.03), rotation=(0.3, 0.4, 0.5), angular_velocity=(3, 1, -4))
    frames = run(sp.Scene([first, hit], gravity=(0, 0, 0)), 30)
    P, L = momenta(frames)
    assert max(frame.report.details.contacts for frame in frames) > 0
    assert np.abs(P - P[0]).max() <= 1e-11 * np.linalg.norm(P[0])
    assert np.abs(L - L[0]).max() <= 1e-10 * np.linalg.norm(L[0])
    assert frames[-1].report.kinetic_energy < 0.9 * frames[0].report.kinetic_energy
    assert rigidity(frames) < 1e-13


def test_a_heavy_body_on_a_light_one_gains_no_energy():
    """50:1, dropped by a centimetre; 10 substeps, which suffice for equal masses, gain 30 % of the energy."""
    low, high = (
        rigid("low", density=20.0, position=(0, 0.0501, 0)),
        rigid("high", density=1000.0, position=(0, 0.16, 0)),
    )
    frames = run(sp.Scene([low, replace(high, rotation=(0, 0.4, 0))], obstacles=[FLOOR]), 25, substeps="auto")
    assert max(frame.report.details.energy_gained for frame in frames) < 0.01
    forces = frames[-1].report.details.contact_forces
    assert forces["high"][1] == pytest.approx(G, rel=0.01)
    assert -forces["floor"][1] == pytest.approx(1.02 * G, rel=0.01)
    assert frames[-1].poses["high"].translation[1] > 0.15


@pytest.mark.parametrize(("size", "ratio"), [(0.1, 50.0), (0.1, 130.0), (0.01, 50.0)])
def test_a_heavy_body_that_falls_on_a_soft_mat_gains_no_energy(size, ratio):
    """The modulus is twenty times the pressure of the weight."""
    material = sp.StableNeoHookean(youngs=20.0 * ratio * 1000.0 * G * size, poisson=0.4, density=1000.0)
    mat = sp.Body("mat", sp.shapes.box((3 * size, size, 3 * size), (6, 2, 6)), material, position=(0, 0.6 * size, 0))
    cube = sp.shapes.box_surface((size,) * 3, (1, 1, 1))
    heavy = sp.RigidBody("heavy", cube, density=1000.0 * ratio, position=(0, 1.7 * size, 0), friction=0.5)
    frames = run(sp.Scene([mat, heavy], obstacles=[FLOOR]), 16, substeps="auto")
    from_nowhere = np.cumsum([0.0, *(frame.report.work["numerical"] for frame in frames)])
    fall = 0.2 * size * ratio * 1000.0 * size**3 * G
    assert np.max(from_nowhere - np.minimum.accumulate(from_nowhere)) < 0.01 * fall


def test_a_stack_of_small_boxes_lands_without_a_gain_of_energy():
    """Boxes of 3 mm that fall by 2 mm; the 7 substeps of larger boxes gain 75 % of the energy."""
    size = 3e-3
    cube = sp.shapes.box_surface((size,) * 3, (1, 1, 1))
    places = [(0.05 * size * (i % 2), size * (0.7 + 1.05 * i), 0.0) for i in range(10)]
    boxes = [sp.RigidBody(f"{i}", cube, density=500.0, position=x, friction=0.5) for i, x in enumerate(places)]
    frames = run(sp.Scene(boxes, obstacles=[FLOOR]), 20, substeps="auto")
    assert {frame.report.status for frame in frames} == {"converged"}
    assert max(frame.report.details.energy_gained for frame in frames) < 0.01
    assert 15 < frames[-1].report.details.substeps < 30


@pytest.mark.parametrize("below", ["rigid", "soft"])
def test_soft_and_rigid_bodies_lie_on_each_other(below):
    """Faces that are aligned; both weights arrive at the floor."""
    places = {"rigid": (0, 0.0501, 0), "soft": (0, 0.16, 0)}
    if below == "soft":
        places = {"rigid": (0, 0.16, 0), "soft": (0, 0.0501, 0)}
    bodies = [rigid(position=places["rigid"]), soft(position=places["soft"], friction=0.5)]
    frames = run(sp.Scene(bodies, obstacles=[FLOOR]), 50)
    forces = np.mean([frame.report.details.contact_forces["floor"] for frame in frames[-25:]], axis=0)
    assert forces[1] == pytest.approx(-2.0 * G, rel=0.02)
    heights = {name: frames[-1].positions[name][:, 1].min() for name in places}
    assert heights[below] < 1e-3 < 0.09 < max(heights.values())
    assert rigidity(frames) < 1e-13


def test_a_held_body_carries_its_weight_and_what_lies_on_it():
    scene = sp.Scene([rigid("low"), rigid("high", position=(0, 0.106, 0))], pins=[sp.Pin("low")])
    last = run(scene, 20)[-1]
    (reaction,) = last.reactions.values()
    np.testing.assert_allclose(reaction, [0, 2 * G, 0], atol=1e-3 * G)


def test_a_force_off_the_center_turns_a_body():
    corner = int(np.argmax(CUBE.vertices @ np.ones(3)))
    force = sp.Force("rigid", vertices=[corner], force=(0, 0, 1e-5))
    last = run(sp.Scene([rigid()], forces=[force], gravity=(0, 0, 0)), 30)[-1]
    pose, time = last.poses["rigid"], 0.5
    np.testing.assert_allclose(pose.velocity, [0, 0, 1e-5 * time], rtol=1e-9, atol=1e-15)
    spin = time * np.cross(CUBE.vertices[corner], [0, 0, 1e-5]) / (0.1**2 / 6.0)
    np.testing.assert_allclose(pose.angular_velocity, spin, rtol=1e-3, atol=1e-8)


def test_a_body_at_rest_sleeps_and_wakes():
    scene = sp.Scene([rigid("low", position=(0, 0.0501, 0)), rigid("high", position=(0, 1.4, 0))], obstacles=[FLOOR])
    frames = run(scene, 40, substeps="auto", sleep_after=0.2)
    asleep = [frame.report.details.asleep["low"] for frame in frames]
    assert any(asleep)
    assert not asleep[-1]
    slept = asleep.index(True)
    np.testing.assert_array_equal(frames[slept + 2].positions["low"], frames[slept + 1].positions["low"])


def test_fast_spin_asks_for_substeps():
    body = rigid(shape=BOX, angular_velocity=(0, 300.0, 1.0))
    frames = run(sp.Scene([body], gravity=(0, 0, 0)), 4, substeps="auto")
    details = frames[0].report.details
    assert details.substeps >= 300.0 / 60.0 / 0.1
    assert details.substeps_reason == "the spin of body 'rigid'"
    # Five radians in a substep: the energy is wrong, which is said, and the angular momentum is right.
    _, L = momenta(run(sp.Scene([body], gravity=(0, 0, 0)), 4, substeps=1, statuses=("converged", "energy_gained")))
    assert np.abs(L - L[0]).max() <= 1e-10 * np.linalg.norm(L[0])


def test_turning_bodies_do_not_dip_into_the_floor():
    # The turn that follows from a body's momenta ends a little elsewhere than contact left it.
    random = np.random.default_rng(19)
    bodies = [
        sp.RigidBody(
            f"cube {k}",
            sp.shapes.box_surface((0.1, 0.06, 0.08), (1, 1, 1)),
            density=1000,
            position=(0.3 * k, 0.15, 0),
            rotation=random.normal(size=3),
            velocity=(0, -random.uniform(2, 5), 0),
            angular_velocity=10 * random.normal(size=3),
        )
        for k in range(6)
    ]
    lowest = min(
        points[:, 1].min()
        for frame in sp.simulate(sp.Scene(bodies, [sp.HalfSpace(friction=0.5)]), sp.XPBD(), 1 / 60, 20)
        for points in frame.positions.values()
    )
    assert lowest >= 0.0


# Edge lengths [m], density [kg/m^3], position [m], rotation [rad], velocity downwards [m/s], spin [rad/s], friction.
PILE = [
    ((0.092, 0.097, 0.082), 1210, (0.026, 0.081, 0.005), (-1.265, -0.623, 0.041), 4.29, (-0.66, -3.74, -2.2), 0.69),
    ((0.084, 0.126, 0.124), 1124, (0.013, 0.283, -0.013), (-0.743, -0.922, -0.458), 3.25, (-3.03, -0.63, -0.48), 0.58),
    ((0.144, 0.147, 0.103), 3751, (0.008, 0.525, -0.02), (1.346, 0.781, 0.264), 4.45, (4.37, 5.88, 5.4), 0.67),
]


def test_boxes_that_fall_on_each_other_do_not_pass_through_each_other():
    """What parts them after a blow must not push one edge through another, nor a corner into the floor."""
    bodies = [
        sp.RigidBody(
            f"box {k}",
            sp.shapes.box_surface(size, (1, 1, 1)),
            density=density,
            position=position,
            rotation=rotation,
            velocity=(0, -speed, 0),
            angular_velocity=spin,
            friction=friction,
        )
        for k, (size, density, position, rotation, speed, spin, friction) in enumerate(PILE)
    ]
    frames = run(sp.Scene(bodies, [sp.HalfSpace(friction=0.5)]), 12, substeps="auto")
    assert max(frame.report.details.contacts for frame in frames) > 2
    assert min(points[:, 1].min() for frame in frames for points in frame.positions.values()) >= 0.0


@pytest.mark.parametrize(("ratio", "turn"), [(1.0, 0.0), (4.0, 0.5)])
def test_a_box_that_lies_off_the_center_of_another_rests(ratio, turn):
    """It slid off at 3 to 7 mm/s: forces that one body passes on to the floor were taken for those of a blow."""
    cube = sp.shapes.box_surface((0.1, 0.1, 0.1), (2, 2, 2))
    low = sp.RigidBody("low", cube, density=1000.0, position=(0, 0.05, 0), friction=0.5)
    high = sp.RigidBody(
        "high", cube, density=1000.0 * ratio, position=(0.02, 0.155, 0.002), rotation=(0, turn, 0), friction=0.5
    )
    scene = sp.Scene([low, high], [sp.HalfSpace(friction=0.5)])
    frames = converged(sp.simulate(scene, sp.XPBD(sleep_after=None), 1 / 60, 40))
    for name in ("low", "high"):
        moved = frames[-1].poses[name].translation - frames[25].poses[name].translation
        assert np.abs(moved).max() < 1e-6
        assert np.abs(frames[-1].poses[name].velocity).max() < 1e-5
