"""Rigid bodies on the live page: they move, are described and measured; what cannot be done is one line."""

import numpy as np
import pytest

import supple as sp
from supple.viewer.engine.measurement.contact_points import contact_points
from supple.viewer.engine.measurement.describe import describe, measures
from supple.viewer.engine.scene.changes import change, without_body
from supple.viewer.engine.scene.live_scene import LiveScene
from supple.viewer.protocol import commands
from supple.viewer.protocol.live_source import LiveSource


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
    assert (body.material, body.mass) == ("rigid", pytest.approx(2.0))
    assert set(body.values) == {"friction"}
    assert body.skin is not None
    assert len(body.skin[0]) == 8
    assert described.low[1] == pytest.approx(0.0, abs=1e-3)
    found = contact_points(live.system, live.state.positions, live.state.time)
    assert len(found) == 4
    assert np.abs(found[:, 1]).max() < 1e-3
    assert measures(live).kinetic_energy < 1e-6


def test_friction_changes_a_pin_holds_it_and_a_grab_is_refused(live):
    change(commands.SetParameter("friction", 0.7, "stone"), live)
    assert live.setup.scene.body("stone").friction == 0.7
    with pytest.raises(sp.SuppleError, match="body 'stone' has no youngs"):
        change(commands.SetParameter("youngs", 1e5, "stone"), live)
    with pytest.raises(sp.SceneError, match="soft targets pull soft bodies"):
        change(commands.Grab(1, "stone", (0,), (1.0,), (0.0, 1.0, 0.0)), live)
    change(commands.Pin("stone", 1), live)
    before = live.body_positions("stone").copy()
    live.step()
    np.testing.assert_array_equal(live.body_positions("stone"), before)


def test_joints_and_welds_go_with_their_bodies():
    cube, box = sp.shapes.box_surface((0.1, 0.1, 0.1), (1, 1, 1)), sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
    soft = sp.Body("soft", box, sp.StableNeoHookean(youngs=1e5, poisson=0.3), position=(0, 0, 0.1))
    bodies = [sp.RigidBody("a", cube, mass=1.0), sp.RigidBody("b", cube, mass=1.0, position=(0.2, 0, 0)), soft]
    joints = [sp.BallJoint("a", point=(0, 0.1, 0)), sp.HingeJoint("b", "a", point=(0.1, 0, 0))]
    scene = sp.Scene(bodies, joints=joints, welds=[sp.Weld("soft", "a", max_distance=1e-6)])
    assert [joint.name for joint in without_body(scene, "b").joints] == ["BallJoint 1"]
    assert len(without_body(scene, "b").welds) == 1
    alone = without_body(scene, "a")
    assert (alone.joints, alone.welds) == ((), ())
