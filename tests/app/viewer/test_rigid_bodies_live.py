"""Rigid bodies on the live page: they move, are described and measured; what cannot be done is one line."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.engine.describe import contact_points, describe, measures
from supple.app.viewer.engine.scene.changes import change
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.simulation_loop import SimulationLoop
from supple.app.viewer.messages import frame_of, measured
from supple.app.viewer.protocol import commands
from supple.app.viewer.protocol.command_queue import CommandQueue
from supple.app.viewer.protocol.live_source import LiveSource
from supple.results.view.joints import joint_segments, lines_of_joints
from supple.results.view.picking import nearest_surface_point


@pytest.fixture
def live():
    stone = sp.RigidBody("stone", sp.shapes.box_surface((0.1, 0.1, 0.1), (1, 1, 1)), mass=2.0, position=(0, 0.052, 0))
    scene = sp.Scene([stone], obstacles=[sp.HalfSpace(name="floor")])
    return LiveScene(LiveSource("stone", scene, sp.Implicit(), 1 / 60))


def test_it_falls_and_is_measured(live):
    for _ in range(6):
        assert live.step().status.can_go_on
    described = describe(live)
    (body,) = described.bodies
    assert body.rigid
    assert set(body.values) == {"friction"}
    assert body.skin is not None
    assert len(body.skin.corners) == 8
    assert described.low[1] == pytest.approx(0.0, abs=1e-3)
    found = contact_points(live)
    assert len(found) == 4
    assert np.abs(found[:, 1]).max() < 1e-3
    assert measures(live).kinetic_energy < 1e-6


def test_friction_changes_and_a_pin_holds_it(live):
    change(commands.SetParameter("friction", 0.7, "stone"), live)
    assert live.setup.scene.body("stone").friction == 0.7
    with pytest.raises(sp.SuppleError, match="body 'stone' has no youngs"):
        change(commands.SetParameter("youngs", 1e5, "stone"), live)
    change(commands.Pin("stone", 1), live)
    before = live.body_positions("stone").copy()
    live.step()
    np.testing.assert_array_equal(live.body_positions("stone"), before)


def swinging():
    """A bar on a hinge, limited on one side of the horizontal, and on the page."""
    bar = sp.RigidBody("bar", sp.shapes.box_surface((0.4, 0.05, 0.05), (1, 1, 1)), mass=1.0, position=(0.2, 0, 0))
    hinge = sp.HingeJoint("bar", point=(0, 0, 0), limits=(-0.5, 0.5), name="hinge")
    return LiveScene(LiveSource("bar", sp.Scene([bar], joints=[hinge]), sp.Implicit(contact=None), 1 / 60))


def moment_of(live):
    """What the page draws."""
    snapshot = SimulationLoop(live, CommandQueue(), None).snapshot(0.0)
    return frame_of(replace(snapshot, description=describe(live))), snapshot


def test_a_drag_pulls_at_the_point_under_the_mouse_and_a_throw_keeps_the_velocity(live):
    live.adopt(replace(live.setup, scene=replace(live.setup.scene, gravity=(0, 0, 0), obstacles=())))
    point = nearest_surface_point(moment_of(live)[0], (0.05, 0.08, 0.0))  # on an edge, beside the center of mass
    place = point.weights @ live.system.split(live.state.positions)["stone"][point.vertices]
    np.testing.assert_allclose(place, (0.05, 0.08, 0.0), atol=1e-9)
    target = np.add(place, (0.0, 0.3, 0.0))
    near = tuple(np.add(place, (0.0, 0.002, 0.0)))  # a force that turns it only little within a step
    change(commands.Grab(1, "stone", tuple(point.vertices), tuple(point.weights), near), live)
    first = live.step()
    momentum = measures(live).linear_momentum[1]
    assert first.status.can_go_on
    assert momentum > 0.0
    # The force acts at the point: with the arm 0.05 m about z.
    center = live.state.positions.mean(axis=0)
    np.testing.assert_allclose(measures(live).angular_momentum[2], (place - center)[0] * momentum, rtol=0.05)
    change(commands.MoveGrab(1, tuple(target)), live)
    for _ in range(240):
        assert live.step().status.can_go_on
    (spring,) = moment_of(live)[1].grabs
    np.testing.assert_allclose(spring.point, target, atol=0.01)
    change(commands.MoveGrab(1, (0.0, 1.0, 2.0)), live)
    live.step()
    change(commands.ReleaseGrab(1), live)
    thrown = measures(live).linear_momentum
    live.step()
    np.testing.assert_allclose(measures(live).linear_momentum, thrown, rtol=1e-9)


def test_a_dragged_bar_turns_about_its_hinge_and_stops_at_the_limit():
    live = swinging()
    drawn = lines_of_joints(moment_of(live)[0].model)
    before = joint_segments(moment_of(live)[0], drawn)
    point = nearest_surface_point(moment_of(live)[0], (0.4, 0.02, 0.0))
    change(commands.Grab(1, "bar", tuple(point.vertices), tuple(point.weights), (0.2, 0.6, 0.0), 20.0), live)
    for _ in range(40):
        assert live.step().status.can_go_on
    reading = measures(live).joints["hinge"]
    assert reading.coordinate == pytest.approx(0.5, abs=1e-5)
    frame, snapshot = moment_of(live)
    assert any("hinge: at 0.5, force" in line for line in measured(replace(snapshot, description=describe(live))))
    (joint,) = frame.model.joints
    assert joint.conditions.coordinate.limits == (-0.5, 0.5)
    lines = joint_segments(frame, drawn)
    assert lines.shape == before.shape
    np.testing.assert_allclose(lines[:3].mean(axis=1), np.zeros((3, 3)), atol=1e-6)  # the cross
    hand, rim = lines[3, 1], lines[-1, 1]  # where the bar is, and the end of the arc
    np.testing.assert_allclose(hand / np.linalg.norm(hand), rim / np.linalg.norm(rim), atol=1e-4)
    np.testing.assert_array_equal(lines[4:], before[4:])  # axis and arc stay in the world
    assert np.abs(lines[3] - before[3]).max() > 0.01


def test_joints_of_every_kind_are_drawn_where_their_limits_are():
    bar = sp.shapes.box_surface((0.4, 0.05, 0.05), (1, 1, 1))
    bodies = [sp.RigidBody(name, bar, mass=1.0, position=(0.2, 0, k)) for k, name in enumerate("abcd")]
    joints = [
        sp.BallJoint("a", point=(0, 0, 0), axis=(1, 0, 0), max_swing=0.5),
        sp.SliderJoint("b", point=(0, 0, 1), axis=(0, 1, 0), limits=(-0.1, 0.3)),
        sp.FixedJoint("c", "b", point=(0, 0, 2)),
        sp.HingeJoint("d", "c", point=(0, 0, 3), limits=(0.0, np.inf)),
    ]
    live = LiveScene(LiveSource("all", sp.Scene(bodies, joints=joints), sp.Implicit(contact=None), 1 / 60))
    frame = moment_of(live)[0]
    lines = joint_segments(frame, lines_of_joints(frame.model))
    cone = lines[4:39]  # after a cross and a hand: the rim, and lines to it
    rims = cone[:31].reshape(-1, 3)
    np.testing.assert_allclose(rims[:, 0] / np.linalg.norm(rims, axis=1), np.cos(0.5), atol=1e-6)
    axis, low, high = lines[42:45]
    np.testing.assert_allclose(axis[:, [0, 2]], [[0, 1], [0, 1]], atol=1e-6)
    np.testing.assert_allclose([low.mean(axis=0), high.mean(axis=0)], [[0, -0.1, 1], [0, 0.3, 1]], atol=1e-6)
    assert len(lines) == 45 + 3 + 4  # a cross for the fixed joint, a cross and an axis for the hinge


def test_a_click_pins_the_whole_body_and_another_one_releases_it(live):
    frame, _ = moment_of(live)
    point = nearest_surface_point(frame, (0.03, 1.0, 0.01))
    assert (point.body.name, point.nearest_vertex, point.place[1]) == ("stone", 0, pytest.approx(0.102))
    change(commands.Pin("stone", point.nearest_vertex), live)
    assert len(live.system.pinned_vertices) == 4
    change(commands.Unpin("stone", point.nearest_vertex), live)
    assert len(live.system.pinned_vertices) == 0
    # Also one of the scene.
    held = LiveScene(LiveSource("held", replace(live.setup.scene, pins=[sp.Pin("stone")]), sp.Implicit(), 1 / 60))
    change(commands.Unpin("stone", 0), held)
    assert len(held.system.pinned_vertices) == 0
