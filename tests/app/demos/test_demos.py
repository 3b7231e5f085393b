"""Demos: each can be built for each of its solvers, the claims of the quick ones hold, and claims can fail."""

import logging
from dataclasses import replace

import numpy as np
import pytest

from supple.app.cli.app import main
from supple.app.cli.console import ExitCode
from supple.app.demos import cuff, gripper, knot, pneunet
from supple.app.demos.demo import Claim, Demo, Measurement, body_range, meetings, stitch_lengths
from supple.app.demos.registry import DEMOS, find_demo
from supple.errors import SceneError, SolverError
from supple.model.state import Status
from supple.model.system import build_system, initial_state
from supple.results.check.checker import check_recording
from supple.results.recording.recorder import Recorder
from supple.simulate import first_frame, simulate
from supple.solvers.implicit.solver import Implicit
from supple.solvers.solver import Solver
from supple.solvers.xpbd.solver import XPBD

SHELLS = {"drape", "bag", "balloon", "cuff"}
EVERY = [(name, kind) for name, demo in DEMOS.items() for kind in demo.kinds]
SOLVERS = {"xpbd": XPBD, "implicit": Implicit}


def run(demo, kind, steps=None):
    demo = demo.on(kind)
    measurement = demo.measurement()
    frames = list(simulate(demo.scene(), demo.solver(kind), demo.dt, steps or demo.steps, sinks=[measurement]))
    return frames, measurement.claims()


def test_the_names_and_solvers_of_the_demos():
    names = {"squash", "stretch", "compliance", "bears", "stitch", "twist", "pneunet", "gripper", "knot"} | SHELLS
    assert {name for name, _ in EVERY} == names
    assert {kind for _, kind in EVERY} == set(SOLVERS)
    assert {("squash", "implicit"), ("stretch", "implicit"), ("squash", "xpbd"), ("stretch", "xpbd")} <= set(EVERY)


# The first steps of this one take long. A page of the documentation runs it.
LONG = {("pneunet", "implicit")}


@pytest.mark.parametrize(("name", "kind"), EVERY)
def test_two_frames_converge_and_every_claim_is_measured(name, kind):
    demo = find_demo(name).on(kind)
    assert demo.name == name
    assert isinstance(demo.solver(kind), SOLVERS[kind])
    if (name, kind) in LONG:
        scene = demo.scene()
        system = build_system(scene, initial_state(scene))
        assert np.all(system.rest_volumes > 0.0)
        demo.solver(kind).prepare(system)
        return
    frames, claims = run(demo, kind, steps=2)
    assert [frame.report.status for frame in frames] == [Status.CONVERGED] * 2
    assert all(frame.report.min_det_F > 0.0 for frame in frames)
    assert len(claims) >= 3
    assert all(claim.text and claim.measured for claim in claims)
    assert not all(claim.holds for claim in claims), "two frames are too few for all claims"


@pytest.mark.slow
def test_the_gripper_holds_its_box_and_not_a_slippery_one(monkeypatch):
    for kind in ("implicit", "xpbd"):
        frames, claims = run(DEMOS["gripper"], kind)
        assert {frame.report.status for frame in frames} == {Status.CONVERGED}
        assert all(claim.holds for claim in claims), claims
    monkeypatch.setattr(gripper, "FRICTION", 0.1)
    lifted, *_ = run(DEMOS["gripper"], "implicit", steps=100)[1]
    assert not lifted.holds


@pytest.mark.slow
@pytest.mark.parametrize("name", ["balloon", "cuff"])
def test_a_recording_of_a_demo_of_shells_passes_all_checks(name, tmp_path):
    demo, path = DEMOS[name], tmp_path / "demo.vtkhdf"
    list(simulate(demo.scene(), demo.solver(), demo.dt, demo.steps, sinks=[Recorder(path)]))
    report = check_recording(path)
    assert report.ok, str(report)


@pytest.mark.slow
def test_the_cuff_does_not_lift_a_slippery_ball(monkeypatch):
    monkeypatch.setattr(cuff, "FRICTION", 0.05)
    lifted, *_ = run(DEMOS["cuff"], "implicit", steps=90)[1]
    assert not lifted.holds


def test_crossings_of_a_line_with_itself_have_signs():
    points = knot.tied(knot.RADIUS, knot.ROPE, knot.EDGES)
    assert knot.crossings(points).tolist() == [-1, -1, -1]
    assert knot.crossings(points * [1.0, 1.0, -1.0]).tolist() == [1, 1, 1]
    assert knot.least_distance(points) > 2.0 * knot.ROPE


def test_what_crosses_is_counted():
    scene = DEMOS["drape"].scene()
    state = initial_state(scene)
    frame = first_frame(scene, state)
    assert meetings(frame) == 0
    cloth = body_range(frame, "cloth").vertices
    through = state.positions.copy()
    through[cloth, 1] -= 0.05
    assert meetings(replace(frame, state=replace(state, positions=through))) == 2


def test_both_solvers_stretch_the_ball_to_the_same_shape():
    lengths = {}
    for kind in ("xpbd", "implicit"):
        frames, _ = run(DEMOS["stretch"], kind, steps=30)
        lengths[kind] = np.ptp(frames[-1].positions["ball"][:, 1])
    assert lengths["implicit"] == pytest.approx(lengths["xpbd"], rel=0.02)


def test_the_hat_stays_on_the_flying_bear_with_both_solvers():
    for kind in ("xpbd", "implicit"):
        frames, _ = run(DEMOS["stitch"], kind, steps=6)
        stitching = frames[-1].system.stitching
        assert len(stitching.tets) >= 8
        assert len(np.unique(frames[-1].system.joined_components)) == 1
        longer = np.abs(stitch_lengths(frames[-1]) - stitch_lengths(frames[0])).max()
        assert longer < 1e-3
        assert frames[-1].positions["hat"][:, 1].min() > 0.12


@pytest.mark.slow
@pytest.mark.parametrize(("name", "kind"), EVERY)
def test_every_claim_of_the_whole_demo_holds(name, kind):
    _, claims = run(DEMOS[name], kind)
    assert [claim for claim in claims if not claim.holds] == []


def test_an_unknown_demo_and_an_unknown_solver_are_errors():
    with pytest.raises(SceneError, match=r"demo 'squish' does not exist; there are squash, stretch"):
        find_demo("squish")
    with pytest.raises(SolverError, match=r"demo 'bears' has no solver 'implicit'; it has xpbd"):
        DEMOS["bears"].on("implicit")
    with pytest.raises(SolverError, match=r"demo 'twist' has no solver 'xpbd'; it has implicit"):
        DEMOS["twist"].solver("xpbd")


def test_implicit_rejects_an_xpbd_material_in_one_line():
    with pytest.raises(SolverError, match=r"body 'ball': EdgesAndVolume is a material for XPBD only"):
        simulate(DEMOS["squash"].scene(), Implicit(), 1 / 60, 1)


class OneFrame(Measurement):
    """Claims two things, of which one is false."""

    def claims(self):
        moved = self.last.index - self.first.index
        return [Claim("one frame passes", str(moved), moved == 1), Claim("ten frames pass", str(moved), moved == 10)]


def demo_of(scene, solver: Solver) -> Demo:
    return Demo("made up", "for a test", "A test.", scene, {"xpbd": lambda: solver}, OneFrame, steps=1)


def test_a_claim_that_does_not_hold_is_reported_and_exits_1(monkeypatch, capfd, tmp_path):
    demo = demo_of(DEMOS["stretch"].scene, XPBD(substeps=2))
    assert [claim.holds for claim in run(demo, "xpbd")[1]] == [True, False]
    monkeypatch.setitem(DEMOS, "made", demo)
    code = main(["demo", "made", "-q", "--no-page", "--no-plot", "-o", str(tmp_path)])
    assert code == ExitCode.FAILED
    assert capfd.readouterr().out.splitlines() == [
        "holds: one frame passes (1)",
        "does not hold: ten frames pass (1)",
    ]


def test_newton_iterations_go_to_the_log_at_debug(caplog):
    name = "supple.solvers.implicit.newton.minimize"
    with caplog.at_level(logging.DEBUG, logger=name):
        frames, _ = run(DEMOS["twist"], "implicit", steps=1)
    logged = [record.getMessage() for record in caplog.records if record.name == name]
    rows = [row for row in frames[0].report.details.newton if row.kind == "newton"]
    assert len(rows) >= 1
    assert sum("iteration=" in line for line in logged) == len(rows)


@pytest.mark.slow
def test_the_reference_of_the_bellows_finger_is_that_of_a_finer_mesh():
    frames = simulate(pneunet.scene(pneunet.FINER), DEMOS["pneunet"].solver(), 1.0, pneunet.STEPS)
    np.testing.assert_allclose([pneunet.bend(frame) for frame in frames], pneunet.REFERENCE, rtol=2e-3)
