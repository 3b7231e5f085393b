"""When a pull of the mouse acts, and on what way."""

import dataclasses
import time

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.engine.describe import measures
from supple.app.viewer.engine.scene.changes import change
from supple.app.viewer.engine.scene.grab_spring import SoftGrab
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.protocol import commands
from supple.model.state import Status

from .conftest import corner_grab, free_source


class TestPulls:
    """A pull acts as soon as it can: in the current step of XPBD, otherwise in a step that begins at once."""

    def held(self, loop):
        loop.execute(corner_grab((-0.2, 0.3, -0.2)))
        loop.live.step()
        return loop.live.setup.grabs[7]

    def test_a_move_within_a_step_of_xpbd_acts_in_it(self, loop):
        self.held(loop)
        corner, moves = loop.live.body_positions("cube")[0].copy(), iter([None, None, (1.0, 0.3, -0.2), None])
        take = loop.inbox.take_leading

        def arriving(kind):
            target = next(moves, None)
            if target is not None:
                loop.inbox.put(5, commands.MoveGrab(7, target))
            return take(kind)

        loop.inbox.take_leading = arriving
        loop.step()
        assert loop.applied == 5
        assert loop.live.body_positions("cube")[0, 0] > corner[0] + 0.005
        assert loop.live.report.details.work["soft_targets"] > 0.0
        assert loop.live.report.details.energy_gained == 0.0  # the work of the pull is known

    def test_the_first_picture_after_a_move_shows_the_moved_mesh(self, loop):
        self.held(loop)
        loop.execute(commands.Play())
        loop.publish(time.perf_counter())
        loop._published = loop.pacing.due = 0.0
        loop.inbox.put(5, commands.MoveGrab(7, (1.0, 0.3, -0.2)))
        loop.run_once(0.0)
        before, after = loop.outbox.snapshots
        assert (before.applied, after.applied, after.frame) == (0, 5, before.frame + 1)
        assert after.positions[0, 0] > before.positions[0, 0] + 0.005

    def test_commands_of_other_kinds_and_what_follows_wait_for_the_end_of_a_step(self, loop):
        spring = self.held(loop)
        release, move = commands.ReleaseGrab(7), commands.MoveGrab(7, (2.0, 0.3, -0.2))
        loop.inbox.put_all([(1, commands.MoveGrab(7, (1.0, 0.3, -0.2))), (2, release), (3, move)])
        loop.step()
        assert loop.applied == 1
        assert spring.target[0] == 1.0
        assert loop.inbox.take(0.0) == [(2, release), (3, move)]

    def test_the_implicit_solver_keeps_its_loads_within_a_step(self, loop):
        loop.live.adopt(dataclasses.replace(loop.live.setup, solver=sp.Implicit()))
        self.held(loop)
        loop.inbox.put(1, commands.MoveGrab(7, (1.0, 0.3, -0.2)))
        loop.step()
        assert loop.applied == 0
        assert len(loop.inbox.take(0.0)) == 1

    def test_a_step_begins_early_where_a_body_was_pulled_but_only_one(self, loop):
        loop.execute(commands.Play())
        self.held(loop)
        loop.pacing.due = time.perf_counter() + 100.0
        loop.execute(commands.SetParameter("gravity", 1.0))
        assert loop._next_step() == loop.pacing.due - loop._interval()  # the grab
        loop.step()
        assert loop._next_step() == loop.pacing.due
        loop.execute(commands.MoveGrab(7, (0.0, 0.4, 0.0)))
        assert loop._next_step() == loop.pacing.due - loop._interval()
        loop.execute(commands.SetSpeed(0.1))
        assert loop._next_step() == loop.pacing.due


class TestWay:
    """The target goes to the pointer over a step: in a jump, the patch would pass into the surface beside it."""

    def pulled(self, x):
        live = LiveScene(free_source())
        corner = live.body_positions("cube")[0].copy()
        change(corner_grab(tuple(corner)), live)
        live.step()
        live.move_grab(commands.MoveGrab(7, tuple(corner + np.array([x, 0.0, 0.0]))))
        spring = live.setup.grabs[7]
        assert isinstance(spring, SoftGrab)
        return live, corner, spring

    def test_it_is_straight_and_even(self):
        live, corner, spring = self.pulled(0.02)
        dt, start = live.setup.dt, live.state.time
        assert [spring._place(start + share * dt)[0] for share in (0.0, 0.25, 1.0, 2.0)] == pytest.approx(
            corner[0] + np.array([0.0, 0.005, 0.02, 0.02])
        )

    def test_a_move_within_a_step_bends_it_where_it_is(self):
        live, corner, spring = self.pulled(0.01)
        dt, start = live.setup.dt, live.state.time
        spring._displacements(start + 0.5 * dt)  # a substep that ends there
        live.move_grab(commands.MoveGrab(7, tuple(corner + np.array([0.01, 0.008, 0.0]))))
        assert spring._place(start + 0.5 * dt) - corner == pytest.approx([0.005, 0.0, 0.0])
        assert spring._place(start + 0.75 * dt) - corner == pytest.approx([0.0075, 0.004, 0.0])
        assert spring._place(start + dt) - corner == pytest.approx([0.01, 0.008, 0.0])

    def test_a_jump_takes_several_steps_and_ends_at_the_pointer(self):
        live, corner, spring = self.pulled(0.3)
        places = [corner[0]]
        for _ in range(20):
            speed = np.linalg.norm(np.average(live.state.velocities, axis=0, weights=live.system.masses))
            live.step()
            places.append(float(spring._place(live.state.time)[0]))
            assert 0.0 <= places[-1] - places[-2] <= speed * live.setup.dt + spring.farthest + 1e-12
        assert places[1] - corner[0] == pytest.approx(spring.farthest, rel=1e-3)
        assert places[-1] == pytest.approx(corner[0] + 0.3)

    def test_it_goes_as_much_farther_as_the_body_moves(self):
        live, corner, spring = self.pulled(0.0)
        live.state = dataclasses.replace(live.state, velocities=live.state.velocities + np.array([0.0, 3.0, 0.0]))
        live.move_grab(commands.MoveGrab(7, tuple(corner + np.array([0.3, 0.0, 0.0]))))
        place = spring._place(live.state.time + live.setup.dt)
        assert place - corner == pytest.approx([spring.farthest + 0.05, 0.0, 0.0], abs=1e-3)

    def test_a_patch_does_not_outrun_its_body(self):
        """After a jump into the body, J of the tets in between was 0.25 in the first step."""
        live, _, _ = self.pulled(0.3)
        for _ in range(8):
            assert live.step().status is Status.CONVERGED
            assert measures(live).min_det_F > 0.6
