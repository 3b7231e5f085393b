"""Effects of grab, pin and squash on a live scene, checked on the state of the simulation."""

import dataclasses

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.engine.describe import describe, measures
from supple.app.viewer.engine.scene.changes import change
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.commands import (
    Grab,
    MoveGrab,
    Pin,
    ReleaseGrab,
    Reset,
    SetParameter,
    Unpin,
)
from supple.errors import CommandError

from .conftest import corner_grab, free_source, run, small_source


class TestGrabs:
    def test_the_stretch_of_a_hanging_body_follows_hookes_law(self):
        live = LiveScene(small_source(obstacles=[]))
        change(corner_grab((-0.2, 1.5, -0.2)), live)
        spring = live.setup.grabs[7]
        for _ in range(250):
            live.step()
            live.state = dataclasses.replace(live.state, velocities=0.9 * live.state.velocities)
        weight = live.system.masses[live.part("cube").vertices].sum() * 9.81
        stretch = spring.target - spring.point(live.body_positions("cube"))
        assert spring.stiffness * stretch == pytest.approx([0.0, weight, 0.0], abs=0.02 * weight)

    def test_a_released_body_keeps_its_momentum(self):
        live = LiveScene(free_source())
        change(corner_grab((-0.2, -0.2, -0.2)), live)
        for k in range(40):
            change(MoveGrab(7, (-0.2 + 0.05 * k, -0.2, -0.2)), live)
            live.step()
        momentum = live.system.masses @ live.state.velocities
        speed = momentum[0] / live.system.masses.sum()
        assert speed > 1.0  # the target moves at 3 m/s
        change(ReleaseGrab(7), live)
        assert live.system.masses @ live.state.velocities == pytest.approx(momentum, rel=1e-12)
        run(live, 30)
        assert live.system.masses @ live.state.velocities == pytest.approx(momentum, rel=1e-9)

    def test_a_grab_causes_no_torque_about_its_point(self):
        live = LiveScene(free_source())
        change(Grab(1, "cube", tuple(live.system.tets[0].tolist()), (0.25,) * 4, (0.0, 0.0, 0.0)), live)
        spring = live.setup.grabs[1]
        point = spring.point(live.body_positions("cube"))
        change(MoveGrab(1, tuple((point + np.array([0, 0.02, 0])).tolist())), live)
        assert len(spring.patch) >= 4
        spring.begin_step(live.system, live.state, live.setup.dt, live.state.positions[spring.patch])
        forces = spring.load.motion(live.setup.dt)
        assert np.ptp(forces, axis=0) == pytest.approx([0, 0, 0], abs=1e-12)
        assert forces[0] == pytest.approx([0, 0.02, 0])

    @pytest.mark.parametrize(
        "stiffness", [limits.WEAKEST_GRAB, pytest.param(limits.STRONGEST_GRAB, marks=pytest.mark.slow)]
    )
    def test_the_stiffest_and_farthest_grab_leaves_a_finite_state(self, live, stiffness):
        change(corner_grab((9e3, 9e3, 9e3), stiffness=stiffness), live)
        for k in range(60):
            change(MoveGrab(7, (9e3 * (-1) ** k, 9e3, 0.0)), live)
            live.step()
            assert live.report.status.can_go_on
        assert np.isfinite(live.state.positions).all()

    @pytest.mark.parametrize("body", ["cube", "rod"])
    def test_only_what_depends_on_grabs_is_computed_again(self, body, monkeypatch):
        """The same bits as with everything computed again, in spite of another grab, forces and soft targets."""
        rod = sp.RigidBody("rod", sp.shapes.box((0.5, 0.1, 0.1), (1, 1, 1)).surface, density=500.0, position=(0, 2, 0))
        scene = small_source().scene
        loads = {
            "forces": [sp.Force("cube", [1, 2], (0.0, 1.0, 0.0))],
            "soft_targets": [sp.SoftTarget("block", [3], 100.0)],
            "loads": [sp.BodyForce((0.0, 0.0, 1.0), "block")],
        }
        source = small_source(bodies=[*scene.bodies, rod], **loads)
        quick, whole = LiveScene(source), LiveScene(source)
        first, second = corner_grab((0.0, 1.0, 0.0)), Grab(8, body, (1,), (1.0,), (0.5, 1.5, 0.2))
        with monkeypatch.context() as only:
            only.setattr(sp.XPBD, "prepare", lambda *_: pytest.fail("everything is computed again"))
            for command in (first, second, ReleaseGrab(first.grab)):
                change(command, quick)
                quick.step()
        for command in (first, second, ReleaseGrab(first.grab)):
            change(command, whole)
            whole.adopt(whole.setup)
            whole.step()
        for live in (quick, whole):
            run(live, 3)
        assert np.array_equal(quick.state.positions, whole.state.positions)
        assert measures(quick).energy == measures(whole).energy
        assert quick.report.details.work == whole.report.details.work

    def test_the_barycentric_point_reaches_the_target(self):
        live = LiveScene(free_source())
        a, b, c = describe(live).body("cube").boundary[5].tolist()
        change(Grab(1, "cube", (a, b, c), (0.2, 0.3, 0.5), (1.0, 0.0, 0.0)), live)
        for _ in range(150):
            live.step()
            live.state = dataclasses.replace(live.state, velocities=0.8 * live.state.velocities)
        point = np.array([0.2, 0.3, 0.5]) @ live.body_positions("cube")[[a, b, c]]
        assert point == pytest.approx([1.0, 0.0, 0.0], abs=1e-3)

    def test_unknown_vertices_and_too_many_grabs_are_refused(self, live):
        with pytest.raises(CommandError, match="has no vertex 1000"):
            change(Grab(1, "cube", (1000,), (1.0,), (0, 0, 0)), live)
        with pytest.raises(CommandError, match="body 'ghost' does not exist"):
            change(Grab(1, "ghost", (0,), (1.0,), (0, 0, 0)), live)
        for number in range(limits.MOST_GRABS):
            change(Grab(number, "cube", (number,), (1.0,), (0, 1, 0)), live)
        with pytest.raises(CommandError, match="release one"):
            change(Grab(99, "cube", (0,), (1.0,), (0, 1, 0)), live)
        change(Grab(3, "cube", (0,), (1.0,), (0, 1, 0)), live)
        assert len(live.setup.grabs) == limits.MOST_GRABS


class TestPins:
    def test_a_pinned_vertex_does_not_move_at_other_changes(self, live):
        run(live, 10)
        place = live.body_positions("cube")[5].copy()
        change(Pin("cube", 5), live)
        for k in range(10):
            change(SetParameter("youngs", 1e5 + k, "cube"), live)
            run(live, 2)
        assert live.body_positions("cube")[5] == pytest.approx(place, abs=1e-12)
        assert live.system.pinned_vertices.tolist().count(5) == 1
        change(Unpin("cube", 5), live)
        run(live, 10)
        assert live.body_positions("cube")[5, 1] < place[1] - 0.01

    def test_a_vertex_of_a_pin_of_the_scene_can_be_unpinned_until_a_reset(self, live):
        before = live.system.pinned_vertices.tolist()
        start = live.system.bodies[1].vertices.start
        vertex = before[0] - start
        anchors = live.system.pins[0].anchors[1:].copy()
        run(live, 5)
        change(Unpin("block", vertex), live)
        assert live.system.pinned_vertices.tolist() == before[1:]
        assert np.array_equal(live.system.pins[0].anchors, anchors)
        change(Reset(), live)
        assert live.system.pinned_vertices.tolist() == before

    def test_unpin_without_vertex_removes_only_pins_of_the_page(self, live):
        before = live.system.pinned_vertices.tolist()
        change(Pin("cube", 1), live)
        change(Pin("cube", 2), live)
        change(Pin("cube", 2), live)
        assert len(live.system.pinned_vertices) == len(before) + 2
        change(Unpin(), live)
        assert live.system.pinned_vertices.tolist() == before
