"""When a pull of the mouse acts, and on what way."""

import dataclasses
import time

import numpy as np
import pytest

import supple as sp
from supple.viewer.engine.scene.changes import change
from supple.viewer.engine.scene.grab_spring import SoftGrab
from supple.viewer.engine.scene.live_scene import LiveScene
from supple.viewer.protocol import commands

from .conftest import corner_grab, free_source


class TestPulls:
    """A pull acts as soon as it can: in the present step of XPBD, otherwise in a step that begins at once."""

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
        assert loop.live.body_positions("cube")[0, 0] > corner[0] + 0.1
        assert loop.live.report.details.work["soft_targets"] > 0.0
        assert loop.live.report.details.energy_gained == 0.0  # the work of the pull is known

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
        live, corner, spring = self.pulled(0.3)
        dt, start = live.setup.dt, live.state.time
        assert [spring._place(start + share * dt)[0] for share in (0.0, 0.25, 1.0, 2.0)] == pytest.approx(
            corner[0] + np.array([0.0, 0.075, 0.3, 0.3])
        )

    def test_a_move_within_a_step_bends_it_where_it_is(self):
        live, corner, spring = self.pulled(0.3)
        dt, start = live.setup.dt, live.state.time
        spring._displacements(start + 0.5 * dt)  # a substep that ends there
        live.move_grab(commands.MoveGrab(7, tuple(corner + np.array([0.3, 0.4, 0.0]))))
        assert spring._place(start + 0.5 * dt) - corner == pytest.approx([0.15, 0.0, 0.0])
        assert spring._place(start + 0.75 * dt) - corner == pytest.approx([0.225, 0.2, 0.0])
        assert spring._place(start + dt) - corner == pytest.approx([0.3, 0.4, 0.0])
