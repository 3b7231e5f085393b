"""Contact forces of both solvers: balance with the weight, Newton's third law, friction, pressure."""

import numpy as np
import pytest

import supple as sp

RUBBER = sp.StableNeoHookean(youngs=5e4, poisson=0.3, density=1000.0, damping=0.02)
G = 9.81
IMPLICIT = sp.Implicit(force_tolerance=1e-9, tolerance=1e-9)
SOLVERS = {"implicit": (IMPLICIT, 0.1, 25, 1e-6), "xpbd": (sp.XPBD(substeps=30), 1 / 60, 60, 1e-2)}


def stack_of_two():
    bodies = [
        sp.Body("low", sp.shapes.box((0.2, 0.1, 0.2), (2, 1, 2)), RUBBER, position=(0, 0.053, 0), friction=0.5),
        sp.Body("high", sp.shapes.box((0.12, 0.1, 0.12), (2, 1, 2)), RUBBER, position=(0.01, 0.157, 0), friction=0.5),
    ]
    return sp.Scene(bodies, [sp.HalfSpace(name="floor", friction=0.5)])


def settled(scene, name):
    solver, dt, steps, tolerance = SOLVERS[name]
    *_, frame = sp.simulate(scene, solver, dt=dt, steps=steps)
    return frame, tolerance


@pytest.fixture(scope="module", params=SOLVERS)
def stack(request):
    return settled(stack_of_two(), request.param)


def weights(frame):
    return {part.name: G * frame.system.masses[part.vertices].sum() for part in frame.system.bodies}


def test_the_contact_forces_carry_the_weight(stack):
    frame, tolerance = stack
    weight = weights(frame)
    total = sum(weight.values())
    contacts = frame.contacts
    assert contacts.force_between("low", "floor") == pytest.approx([0, total, 0], abs=tolerance * total)
    assert contacts.force_between("high", "low") == pytest.approx([0, weight["high"], 0], abs=tolerance * total)
    details = frame.report.details
    for name, expected in (("high", weight["high"]), ("low", weight["low"]), ("floor", -total)):
        force = details.contact_forces[name] + details.friction_forces[name]
        assert force == pytest.approx([0, expected, 0], abs=tolerance * total)
    for name in ("low", "high"):
        assert frame.contact_force[name].sum(axis=0) == pytest.approx([0, weight[name], 0], abs=tolerance * total)


def test_newtons_third_law_holds_between_each_pair(stack):
    frame, _ = stack
    contacts = frame.contacts
    pairs = contacts.by_pair()
    assert set(pairs) >= {("high", "low"), ("low", "high"), ("low", "floor"), ("floor", "low")}
    for (on, by), force in pairs.items():
        np.testing.assert_array_equal(force, -pairs[by, on])
    # On the vertices too: the two sides of each contact between bodies have weights of the same sum.
    low, high = (contacts.names.index(name) for name in ("low", "high"))
    both = np.isin(contacts.first, (low, high)) & np.isin(contacts.second, (low, high))
    sums = np.bincount(contacts.rows, contacts.weights, len(contacts))
    assert both.sum() > 3
    np.testing.assert_allclose(sums[both], 0.0, atol=1e-14)
    np.testing.assert_allclose(sums[~both], 1.0, atol=1e-14)
    forces = contacts.forces + contacts.friction
    np.testing.assert_allclose(np.linalg.norm(contacts.normals, axis=1), 1.0, rtol=1e-12)
    across = np.cross(contacts.forces, contacts.normals)
    np.testing.assert_allclose(across, 0.0, atol=1e-12 * np.abs(forces).max())


def test_each_contact_lies_between_the_two_surfaces(stack):
    contacts = stack[0].contacts
    low, floor = (contacts.names.index(name) for name in ("low", "floor"))
    floored = (contacts.first == low) & (contacts.second == floor)
    np.testing.assert_allclose(contacts.points[floored, 1], 0.5 * contacts.distances[floored], atol=1e-6)
    np.testing.assert_allclose(contacts.normals[floored], np.tile([0, 1, 0], (floored.sum(), 1)), atol=1e-12)
    top = stack[0].positions["low"][:, 1].max()
    np.testing.assert_allclose(contacts.points[~floored, 1], top, atol=0.006)


def test_pressure_times_area_is_the_weight(stack):
    frame, tolerance = stack
    pressure, x = frame.contact_pressure["low"], frame.positions["low"]
    part = frame.system.bodies[0]
    triangles = part.body.mesh.surface.triangles
    a, b, c = x[triangles].transpose(1, 0, 2)
    downward = np.maximum(-np.cross(b - a, c - a)[:, 1] / 6.0, 0.0)
    area = sum(np.bincount(corner, downward, len(x)) for corner in triangles.T)
    bottom = x[:, 1] < 0.02
    total = sum(weights(frame).values())
    assert (pressure * area)[bottom].sum() == pytest.approx(total, rel=5 * tolerance)
    assert (pressure[~bottom & (x[:, 1] < 0.08)] == 0.0).all()


@pytest.mark.parametrize("name", SOLVERS)
def test_friction_holds_a_block_on_a_slope(name):
    angle, mesh = 0.3, sp.shapes.box((0.2, 0.1, 0.2), (2, 1, 2))
    up = np.array([-np.sin(angle), np.cos(angle), 0.0])
    body = sp.Body("block", mesh, RUBBER, position=0.053 * up, rotation=(0, 0, angle))
    scene = sp.Scene([body], [sp.HalfSpace(name="slope", normal=up, friction=0.6)])
    frame, tolerance = settled(scene, name)
    weight = weights(frame)["block"]
    details = frame.report.details
    np.testing.assert_allclose(frame.contacts.force_between("block", "slope"), [0, weight, 0], atol=tolerance * weight)
    normal, tangential = details.contact_forces["block"], details.friction_forces["block"]
    np.testing.assert_allclose(normal, weight * np.cos(angle) * up, atol=tolerance * weight)
    np.testing.assert_allclose(normal + tangential, [0, weight, 0], atol=tolerance * weight)
    np.testing.assert_allclose(frame.contacts.forces.sum(axis=0), normal, atol=1e-9 * weight)
    np.testing.assert_allclose(frame.contacts.friction.sum(axis=0), tangential, atol=1e-9 * weight)


def test_the_impulses_of_a_fall_are_the_change_of_momentum():
    mesh = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
    bodies = [
        sp.Body("ball", mesh, RUBBER, position=(0.02, 0.2, 0.01), velocity=(0, -2, 0)),
        sp.Body("plate", mesh, RUBBER, position=(0, 0.08, 0)),
    ]
    scene = sp.Scene(bodies, [sp.HalfSpace(name="floor")])
    dt, before = 0.01, np.array([0, -2.0 * 1.0, 0])
    impulse, hits = np.zeros(3), 0
    for frame in sp.simulate(scene, sp.XPBD(substeps=20), dt=dt, steps=12):
        force = frame.contacts.force_between("ball", "plate") + frame.contacts.force_between("ball", "floor")
        hits += force[1] > 0.0
        impulse += dt * (force - np.array([0, G, 0]))
        momentum = frame.velocities["ball"].T @ frame.system.masses[frame.system.bodies[0].vertices]
        np.testing.assert_allclose(momentum - before, impulse, atol=0.02 * 2.0)
    assert hits


def test_unknown_names_and_frames_without_a_step():
    scene = stack_of_two()
    (frame,) = sp.simulate(scene, sp.XPBD(substeps=2), dt=0.001, steps=1)
    with pytest.raises(sp.SceneError, match="body or obstacle 'lid' does not exist; there are 'low', 'high', 'floor'"):
        frame.contacts.force_between("lid", "low")
    falling = sp.Scene([sp.Body("cube", sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), RUBBER)])
    for solver in (sp.XPBD(substeps=2), sp.Implicit(), sp.Implicit(contact=None)):
        (frame,) = sp.simulate(falling, solver, dt=0.001, steps=1)
        assert not frame.contact_pressure["cube"].any()
        assert not frame.contact_force["cube"].any()
        assert not frame.contacts
