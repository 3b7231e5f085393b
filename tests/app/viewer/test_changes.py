"""Effects of commands on a live scene (parameters, solver, bodies, reset), checked on the state of the simulation."""

import dataclasses

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.engine.describe import describe, measures
from supple.app.viewer.engine.scene.changes import change, without_body
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.scene.new_bodies import unused_name
from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.commands import (
    AddBody,
    CopyBody,
    Pin,
    ReleaseGrab,
    RemoveBody,
    Reset,
    SetParameter,
    SetSolver,
    Squash,
    Unpin,
)
from supple.app.viewer.protocol.live_source import LiveSource
from supple.errors import CommandError, SolverError, SuppleError

from .conftest import corner_grab, free_source, run, small_source


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
        spins = {}
        for restore in (True, False):
            live = LiveScene(free_source())
            change(SetParameter("momentum_restore", restore), live)
            change(Squash(0.4), live)
            run(live, 120)
            spins[restore] = float(np.linalg.norm(measures(live).spin[0]))
        assert spins[True] < 1e-9
        assert spins[False] > 1e3 * spins[True]


class TestSolvers:
    def test_a_change_of_solver_keeps_positions_and_velocities(self):
        live = LiveScene(free_source())
        change(Squash(0.8), live)
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
        change(Squash(0.8), live)
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


class TestBodies:
    def test_what_has_flowed_is_kept_when_other_bodies_come_and_go(self):
        slow = sp.Viscoelastic(material=sp.MooneyRivlin(c10=1e4, bulk=2e5), prony=[(0.5, 0.1)])
        mesh = sp.shapes.box((0.2, 0.2, 0.2), (1, 1, 1))
        places = ((0, 0, 0), (1, 0, 0), (2, 0, 0))
        bodies = [sp.Body(name, mesh, slow, position=place) for name, place in zip("abc", places, strict=True)]
        pins = [sp.Pin(name, [0, 1, 2, 3]) for name in "abc"]
        scene = sp.Scene(bodies, pins=pins)
        live = LiveScene(LiveSource("slow", scene, sp.Implicit(contact=None), 0.02))
        run(live, 2)
        count, flowed = len(mesh.tets), live.state.internal.copy()
        assert (flowed[:, 10] > 0).all()
        change(RemoveBody("b"), live)
        np.testing.assert_array_equal(live.state.internal, np.delete(flowed, np.s_[count : 2 * count], axis=0))
        change(AddBody("box", size=0.3, resolution=3), live)
        np.testing.assert_array_equal(live.state.internal[: 2 * count], flowed[np.r_[:count, 2 * count : 3 * count]])
        change(SetParameter("density", 700.0, "a"), live)
        np.testing.assert_array_equal(live.state.internal[: 2 * count], flowed[np.r_[:count, 2 * count : 3 * count]])
        run(live, 1)
        change(Reset(), live)
        assert (live.state.internal[:, 10] == 0).all()

    @pytest.mark.parametrize("shape", limits.SHAPES)
    def test_a_new_shape_is_placed_above_the_others_with_its_size(self, live, shape):
        top = live.state.positions[:, 1].max()
        others = {part.name: live.body_positions(part.name).copy() for part in live.system.bodies}
        change(AddBody(shape, size=0.3, resolution=4), live)
        part = live.system.bodies[-1]
        x = live.body_positions(part.name)
        assert part.name == f"{shape.replace('_', ' ')} 1"
        assert np.ptp(x, axis=0).max() == pytest.approx(0.3, rel=0.15)
        assert x[:, 1].min() > top
        for name, before in others.items():
            assert np.array_equal(live.body_positions(name), before)
        assert describe(live).bodies[-1].added
        run(live, 2)

    def test_copy_and_removal_do_not_change_other_bodies(self, live):
        run(live, 5)
        change(Pin("block", 40), live)
        change(corner_grab((0, 2, 0)), live)
        block = live.body_positions("block").copy()
        change(CopyBody("cube", position=(0.0, 3.0, 0.0)), live)
        assert [part.name for part in live.system.bodies] == ["cube", "block", "cube 1"]
        assert live.body_positions("cube 1").mean(axis=0) == pytest.approx([0, 3, 0])
        assert np.ptp(live.body_positions("cube 1"), axis=0) == pytest.approx([0.4] * 3)
        change(RemoveBody("cube"), live)
        assert [part.name for part in live.system.bodies] == ["block", "cube 1"]
        assert np.array_equal(live.body_positions("block"), block)
        assert not live.setup.grabs
        run(live, 5)
        assert live.body_positions("block")[40] == pytest.approx(block[40], abs=1e-12)
        change(RemoveBody("block"), live)
        assert len(live.system.pinned_vertices) == 0
        with pytest.raises(CommandError, match="only one"):
            change(RemoveBody("cube 1"), live)

    def test_what_refers_to_a_body_is_removed_with_it(self):
        rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4)
        mesh = sp.shapes.box((0.4, 0.4, 0.4), (2, 2, 2))
        bodies = [sp.Body(name, mesh, rubber, position=(0, 0.41 * k, 0)) for k, name in enumerate("abc")]
        joined = {"max_distance": 0.02, "youngs": 1e5, "poisson": 0.4, "min_separate_distance": 1e-3}
        scene = sp.Scene(
            bodies,
            stitches=[sp.SoftVertexTriangleStitch("b", "a", **joined), sp.SoftVertexTriangleStitch("c", "b", **joined)],
            contact_pairs=[sp.ContactPair(["a", "b"], "c", friction=0.2), sp.ContactPair("a", "b", friction=0.3)],
            forces=[sp.Force("a", [0], (0, 1, 0)), sp.Force("b", [0], (0, 1, 0))],
        )
        live = LiveScene(LiveSource("stack", scene, sp.XPBD(substeps=4), 0.01))
        assert describe(live).stitches.nodes.shape == (18, 4)
        change(RemoveBody("a"), live)
        left = live.setup.scene
        assert describe(live).stitches.nodes.shape == (9, 4)
        assert [force.body for force in left.forces] == ["b"]
        assert len(left.stitches) == 1
        assert [tuple(pair.first) for pair in left.contact_pairs] == [("b",)]
        run(live, 2)

    def test_broken_stitches_stay_broken_when_bodies_come_and_go(self):
        rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4)
        mesh = sp.shapes.box((0.4, 0.4, 0.4), (1, 1, 1))
        names = {"far": (9, 0, 0), "near": (9, 0.41, 0), "low": (0, 0, 0), "high": (0, 0.41, 0)}
        bodies = [sp.Body(name, mesh, rubber, position=place) for name, place in names.items()]
        held = [sp.Pin(name, np.arange(8)) for name in ("far", "low")]
        seams = [
            sp.VertexVertexStitch(*pair, max_distance=0.02, stiffness=1e4, strength=strength)
            for pair, strength in ((("near", "far"), None), (("high", "low"), [1e6, 1.0, 1.0, 1e6]))
        ]
        scene = sp.Scene(bodies, pins=held, stitches=seams, gravity=(0, 9.81, 0))
        live = LiveScene(LiveSource("stack", scene, sp.XPBD(substeps=20), 1 / 60))
        run(live, 4)
        assert live.state.broken_stitches.tolist() == [5, 6]
        assert len(live.system.stitching) == 6
        change(AddBody("box"), live)
        run(live, 1)
        assert live.state.broken_stitches.tolist() == [5, 6]
        change(RemoveBody("near"), live)
        run(live, 1)
        assert live.state.broken_stitches.tolist() == [1, 2]
        assert len(live.system.stitching) == 2
        change(Reset(), live)
        assert len(live.state.broken_stitches) == 0
        assert len(live.system.stitching) == 4

    def test_only_what_refers_to_a_body_is_removed_with_it(self):
        """The name of a pin, force or stitch that equals the name of the body is not a reference to it."""
        rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4)
        mesh = sp.shapes.box((0.4, 0.4, 0.4), (2, 2, 2))
        names = ("left", "b", "closest", "b 2")
        bodies = [sp.Body(name, mesh, rubber, position=(0, 0.41 * k, 0)) for k, name in enumerate(names)]
        joined = {"max_distance": 0.02, "stiffness": 1e3, "rest_length": 0.01}
        scene = sp.Scene(
            bodies,
            obstacles=[sp.HalfSpace(point=(0, -1, 0), name="floor")],
            pins=[sp.Pin("b", [0], name="left"), sp.Pin("left", [0], name="b")],
            forces=[sp.Force("b", [1], (0, 1, 0), name="left"), sp.Force("left", [1], (0, 1, 0))],
            soft_targets=[sp.SoftTarget("b", [2], 10.0, name="left"), sp.SoftTarget("left", [2], 10.0)],
            stitches=[
                sp.VertexVertexStitch("b", "closest", name="left", **joined),
                sp.VertexVertexStitch("left", "b", **joined),
            ],
            contact_pairs=[
                sp.ContactPair(["left", "b"], "floor", friction=0.2),
                sp.ContactPair("lef?", "closest", friction=0.3),
                sp.ContactPair("b*", "closest", friction=0.4),
            ],
        )
        smaller = without_body(scene, "left")
        assert [pin.label for pin in smaller.pins] == [scene.pins[0].label]
        assert smaller.forces == scene.forces[:1]
        assert smaller.soft_targets == scene.soft_targets[:1]
        assert [tuple(pair.first) for pair in smaller.contact_pairs] == [("b",), ("b*",)]
        assert smaller.stitches == scene.stitches[:1]
        # "closest" is also the pairing of the stitches.
        assert without_body(scene, "closest").stitches == scene.stitches[1:]

    def test_numbers_of_bodies_and_tets_are_limited(self, live, monkeypatch):
        monkeypatch.setattr(limits, "MOST_BODIES", 3)
        change(CopyBody("cube"), live)
        with pytest.raises(CommandError, match="remove one"):
            change(CopyBody("cube"), live)
        monkeypatch.setattr(limits, "MOST_BODIES", 10)
        monkeypatch.setattr(limits, "MOST_TETS", 500)
        with pytest.raises(CommandError, match="resolution"):
            change(AddBody("box", resolution=8), live)

    def test_a_used_name_is_refused(self, live):
        with pytest.raises(SuppleError, match="cube"):
            change(AddBody("box", resolution=3, name="cube"), live)
        assert len(live.system.bodies) == 2


def test_reset_keeps_added_bodies_and_parameters(live):
    start = live.state.positions.copy()
    change(SetParameter("youngs", 5e4, "cube"), live)
    change(corner_grab((0, 2, 0)), live)
    change(Pin("cube", 3), live)
    change(AddBody("sphere", resolution=4, position=(0, 4, 0)), live)
    added = live.body_positions("sphere 1").copy()
    run(live, 10)
    change(Reset(), live)
    assert live.frame == 0
    assert live.state.time == 0.0
    assert np.array_equal(live.state.positions[: len(start)], start)
    assert np.array_equal(live.body_positions("sphere 1"), added)
    assert describe(live).body("cube").values["youngs"] == 5e4
    assert not live.setup.grabs
    run(live, 2)


def test_reset_restores_deformed_initial_positions():
    source = small_source()
    flat = source.scene.body("cube").place(source.scene.body("cube").mesh.vertices) * [1.2, 0.7, 1.2]
    live = LiveScene(dataclasses.replace(source, initial_positions={"cube": flat}))
    assert np.array_equal(live.body_positions("cube"), flat)
    run(live, 5)
    change(RemoveBody("block"), live)
    change(Reset(), live)
    assert np.array_equal(live.body_positions("cube"), flat)


def test_a_parameter_does_not_change_the_generation(live):
    generation = live.generation
    change(SetParameter("youngs", 5e4, "cube"), live)
    change(SetParameter("friction", 0.5), live)
    change(Pin("cube", 3), live)
    change(corner_grab((0, 2, 0)), live)
    assert live.generation == generation
    change(CopyBody("cube"), live)
    assert live.generation == generation + 1


def test_after_a_reset_added_bodies_do_not_overlap_others(live):
    run(live, 30)  # the cube has left its place at the start
    change(AddBody("box", resolution=3, size=0.3, position=(0.0, 0.6, 0.0)), live)
    change(Reset(), live)
    cube, new = live.body_positions("cube"), live.body_positions("box 1")
    assert new[:, 1].min() > cube[:, 1].max()


def test_free_names_differ_from_those_of_bodies_and_obstacles(live):
    scene = live.setup.scene
    named = dataclasses.replace(scene, obstacles=[sp.obstacles.Sphere(name="cube 1", center=(0, -9, 0))])
    assert (unused_name(scene, "cube"), unused_name(named, "cube")) == ("cube 1", "cube 2")


def test_zero_substeps_are_the_automatic_number(live):
    change(SetParameter("substeps", 0), live)
    assert live.setup.solver.substeps == "auto"
    assert describe(live).values["substeps"] == 0
    run(live, 1)
    assert live.report.details.substeps >= 10
    change(SetParameter("substeps", 7), live)
    assert live.setup.solver.substeps == 7
