"""Effects of commands on a live scene (parameters, solver, bodies, reset), checked on the state of the simulation."""

import dataclasses

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.engine.describe import describe, measures
from supple.app.viewer.engine.scene.changes import change
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.protocol.commands import (
    Pin,
    ReleaseGrab,
    Reset,
    SetParameter,
    SetSolver,
    Unpin,
)
from supple.app.viewer.protocol.live_source import LiveSource
from supple.errors import CommandError, SolverError, SuppleError

from .conftest import corner_grab, free_source, run, small_source, squash


class TestParameters:
    def test_values_change_the_system_and_the_description(self, live):
        for name, value in {"youngs": 3e5, "poisson": 0.3, "damping": 0.02, "density": 500.0, "friction": 0.7}.items():
            change(SetParameter(name, value, "cube"), live)
            assert describe(live).body("cube").values[name] == value
            assert describe(live).body("block").values[name] != value
        assert live.system.masses[live.system.bodies[0].vertices].sum() == pytest.approx(500 * 0.4**3)
        for name, value in {"substeps": 3, "momentum_restore": False, "contact": False, "dt": 0.01}.items():
            change(SetParameter(name, value), live)
            assert describe(live).values[name] == value
        assert live.setup.solver == sp.XPBD(substeps=3, momentum_restore=False, contact=None)
        run(live, 1)
        assert live.state.time == pytest.approx(0.01)

    def test_gravity_keeps_its_axis_and_may_be_negative(self, live):
        change(SetParameter("gravity", -2.0), live)
        assert live.system.gravity == pytest.approx([0, 2.0, 0])
        assert describe(live).values["gravity"] == pytest.approx(-2.0)
        assert describe(live).up.tolist() == [0.0, 1.0, 0.0]
        change(SetParameter("gravity", 0.0), live)
        change(SetParameter("gravity", 9.81), live)
        assert live.system.gravity == pytest.approx([0, -9.81, 0])

    def test_friction_of_all_bodies_also_sets_obstacles(self, live):
        change(SetParameter("friction", 0.4), live)
        assert [obstacle.friction for obstacle in live.system.obstacles] == [0.4]
        assert [part.body.friction for part in live.system.bodies] == [0.4, 0.4]

    def test_an_unknown_parameter_is_refused_and_changes_nothing(self, live):
        revision = live.revision
        with pytest.raises(CommandError, match="no body here has edge_compliance"):
            change(SetParameter("edge_compliance", 1e-3), live)
        with pytest.raises(CommandError, match="'ghost'"):
            change(SetParameter("youngs", 1e5, "ghost"), live)
        assert live.revision == revision

    def test_a_parameter_sets_all_regions(self):
        mesh = sp.shapes.box((1, 1, 1), (1, 1, 2))
        soft, hard = (sp.StableNeoHookean(youngs=y, poisson=0.3) for y in (1e4, 1e6))
        body = sp.Body("bar", mesh, sp.Regions(materials=[soft, hard], index=[0] * 6 + [1] * 6))
        live = LiveScene(LiveSource("regions", sp.Scene([body]), sp.XPBD(substeps=2), 0.01))
        assert "youngs" not in describe(live).body("bar").values
        change(SetParameter("damping", 0.03), live)
        assert set(np.asarray(live.system.bodies[0].body.material.damping)) == {0.03}

    def test_without_momentum_restore_a_body_starts_to_spin(self):
        momenta = {}
        for restore in (True, False):
            live = LiveScene(free_source())
            change(SetParameter("momentum_restore", restore), live)
            squash(live, 0.4)
            run(live, 120)
            momenta[restore] = float(np.linalg.norm(measures(live).angular_momentum))
        assert momenta[True] < 2e-9
        assert momenta[False] > 1e3 * momenta[True]


class TestSolvers:
    def test_a_change_of_solver_keeps_positions_and_velocities(self):
        live = LiveScene(free_source())
        squash(live, 0.8)
        run(live, 3)
        x, v = live.state.positions, live.state.velocities
        change(SetSolver("implicit"), live)
        assert describe(live).solver == "implicit"
        assert live.state.positions is x
        assert live.state.velocities is v
        run(live, 2)
        change(SetSolver("xpbd"), live)
        assert live.setup.solver == sp.XPBD(substeps=8)
        run(live, 2)
        assert live.frame == 7

    def test_memory_of_the_solver_is_kept_while_the_state_does_not_change(self):
        live = LiveScene(free_source())
        run(live, 2)
        memory = object()
        live.state = dataclasses.replace(live.state, memory=memory)
        for command in (
            corner_grab((0, 1, 0)),
            ReleaseGrab(7),
            SetParameter("youngs", 2e5),
            SetParameter("substeps", 5),
            SetParameter("dt", 0.01),
            Pin("cube", 1),
            Unpin(),
        ):
            change(command, live)
            assert live.state.memory is memory, command
        squash(live, 0.8)
        assert live.state.memory is None

    def test_an_impossible_change_of_solver_is_refused_and_changes_nothing(self):
        springs = sp.EdgesAndVolume(edge_compliance=1e-4)
        body = sp.Body("ball", sp.shapes.box((0.4, 0.4, 0.4), (2, 2, 2)), springs)
        live = LiveScene(LiveSource("springs", sp.Scene([body]), sp.XPBD(substeps=4), 0.01))
        run(live, 2)
        system, revision = live.system, live.revision
        with pytest.raises(SolverError, match="'ball'"):
            change(SetSolver("implicit"), live)
        assert live.system is system
        assert live.revision == revision
        run(live, 2)

    def test_inverted_tets_without_energy_prevent_a_change_of_solver(self):
        mesh = sp.shapes.box((0.4, 0.4, 0.4), (1, 1, 1))
        body = sp.Body("cube", mesh, sp.NeoHookean(youngs=1e5, poisson=0.3))
        source = LiveSource("inverted", sp.Scene([body]), sp.Implicit(), 0.01)
        live = LiveScene(source)
        live.state = dataclasses.replace(live.state, positions=live.state.positions * [1, -1, 1])
        live.solvers["xpbd"] = sp.XPBD()
        with pytest.raises(SuppleError):
            change(SetSolver("xpbd"), live)
        assert describe(live).solver == "implicit"


def test_reset_keeps_parameters(live):
    start = live.state.positions.copy()
    change(SetParameter("youngs", 5e4, "cube"), live)
    change(corner_grab((0, 2, 0)), live)
    change(Pin("cube", 3), live)
    run(live, 10)
    change(Reset(), live)
    assert live.frame == 0
    assert live.state.time == 0.0
    assert np.array_equal(live.state.positions, start)
    assert describe(live).body("cube").values["youngs"] == 5e4
    assert not live.setup.grabs
    run(live, 2)


def test_reset_restores_deformed_initial_positions():
    source = small_source()
    flat = source.scene.body("cube").place(source.scene.body("cube").mesh.vertices) * [1.2, 0.7, 1.2]
    live = LiveScene(dataclasses.replace(source, initial_positions={"cube": flat}))
    assert np.array_equal(live.body_positions("cube"), flat)
    run(live, 5)
    change(Reset(), live)
    assert np.array_equal(live.body_positions("cube"), flat)


def test_zero_substeps_are_the_automatic_number(live):
    change(SetParameter("substeps", 0), live)
    assert live.setup.solver.substeps == "auto"
    assert describe(live).values["substeps"] == 0
    run(live, 1)
    assert live.report.details.substeps >= 10
    change(SetParameter("substeps", 7), live)
    assert live.setup.solver.substeps == 7
