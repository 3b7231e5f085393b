"""The simulation loop: its frames, the calls of its sinks, its end, and restarts."""

import itertools
import logging
from dataclasses import dataclass, replace

import numpy as np
import pytest

import supple as sp
from supple.model.diagnostics import measure
from supple.model.state import SolverDetails, State, Status, StepReport
from supple.model.system import build_system, initial_state
from supple.simulate import NullSink
from supple.solvers.implicit.contact.model import ContactModel
from supple.solvers.solver import Solver

CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
CUBE_TETS = [[0, 4, 6, 7], [0, 6, 2, 7], [0, 2, 3, 7], [0, 3, 1, 7], [0, 1, 5, 7], [0, 5, 4, 7]]


@dataclass(frozen=True)
class FreeFall(Solver):
    """Symplectic Euler under gravity, with pins at their targets; stops at step `stops_at`."""

    stops_at: int | None = None

    def prepare(self, system):
        return {"calls": 0}

    def step(self, system, state, dt, workspace):
        workspace["calls"] += 1
        if workspace["calls"] == self.stops_at:
            return state, StepReport(Status.NOT_FINITE, 3, "vertex 2 left for infinity")
        v = state.velocities + dt * system.gravity
        x = state.positions + dt * v
        time = state.time + dt
        if len(system.pinned_vertices):
            x[system.pinned_vertices] = system.pin_targets(time)
        return State(time, x, v), StepReport(Status.CONVERGED, 1, details=SolverDetails(workspace["calls"]))


class CallLog:
    def __init__(self, log=None, name="", fails_at=None):
        self.log, self.name, self.fails_at = [] if log is None else log, name, fails_at

    def _note(self, what):
        self.log.append(self.name + what)
        if what == self.fails_at:
            raise sp.OutputError(f"{self.name}: no room for {what}")

    def begin(self, first, dt, steps):
        self.first, self.dt, self.steps = first, dt, steps
        self._note("begin")

    def write(self, frame):
        self._note(f"write {frame.index}")

    def end(self):
        self._note("end")


def scene(**changes):
    material = sp.StableNeoHookean(youngs=1e5, poisson=0.4)
    return sp.Scene([sp.Body("cube", sp.TetMesh(CUBE, CUBE_TETS), material, velocity=(1, 0, 0))], **changes)


@pytest.mark.parametrize("steps", [0, 1, 7])
def test_yields_the_requested_number_of_frames(steps):
    frames = list(sp.simulate(scene(), FreeFall(), 0.1, steps))
    assert [frame.index for frame in frames] == list(range(1, steps + 1))
    assert [frame.time for frame in frames] == pytest.approx([0.1 * k for k in range(1, steps + 1)])


def test_frames_carry_positions_by_body_and_a_full_report():
    frame = list(sp.simulate(scene(), FreeFall(), 0.5, 2))[-1]
    np.testing.assert_allclose(frame.positions["cube"], np.add(CUBE, [1.0, -9.81 * 0.75, 0.0]))
    np.testing.assert_allclose(frame.velocities["cube"], np.tile([1.0, -9.81, 0.0], (8, 1)))
    np.testing.assert_allclose(frame.det_F, 1.0)
    report = frame.report
    assert report.status == "converged"
    assert report.min_det_F == pytest.approx(1.0)
    assert report.elastic_energy == pytest.approx(0.0, abs=1e-8)
    assert report.kinetic_energy == pytest.approx(0.5 * 1000.0 * (1 + 9.81**2))
    height = 0.5 * frame.positions["cube"][[0, 7], 1].sum()
    assert report.potential_energy == pytest.approx(1000.0 * 9.81 * height)
    np.testing.assert_allclose(report.linear_momentum, [1000.0, -9810.0, 0.0])
    np.testing.assert_allclose(report.angular_momentum, 0.0, atol=1e-9)
    assert report.wall_seconds >= 0.0
    assert report.details == SolverDetails(contacts=2)


def test_sinks_see_the_start_every_frame_and_the_end():
    log_sink = CallLog()
    frames = list(sp.simulate(scene(), FreeFall(), 0.1, 3, sinks=[NullSink(), log_sink]))
    assert log_sink.log == ["begin", "write 1", "write 2", "write 3", "end"]
    assert (log_sink.dt, log_sink.steps, log_sink.first.index, log_sink.first.time) == (0.1, 3, 0, 0.0)
    np.testing.assert_array_equal(log_sink.first.positions["cube"], CUBE)
    assert len(frames) == 3


@pytest.mark.filterwarnings("ignore::supple.errors.SuppleWarning")
def test_a_failed_step_is_the_last_frame_and_has_the_reason():
    log_sink = CallLog()
    frames = list(sp.simulate(scene(), FreeFall(stops_at=3), 0.1, 10, sinks=[log_sink]))
    assert [frame.report.status for frame in frames] == ["converged", "converged", "not_finite"]
    assert frames[-1].report.message == "vertex 2 left for infinity"
    assert log_sink.log == ["begin", "write 1", "write 2", "write 3", "end"]


def test_sinks_are_ended_when_the_caller_stops_early():
    log_sink = CallLog()
    frames = sp.simulate(scene(), FreeFall(), 0.1, 10, sinks=[log_sink])
    next(frames)
    frames.close()
    assert log_sink.log == ["begin", "write 1", "end"]


@pytest.mark.parametrize("fails_at", ["begin", "write 2", "end"])
def test_every_sink_is_ended_when_one_of_them_fails(fails_at):
    log = []
    sinks = [CallLog(log, "a "), CallLog(log, "b ", fails_at), CallLog(log, "c ")]
    with pytest.raises(sp.OutputError, match=f"b : no room for {fails_at}"):
        list(sp.simulate(scene(), FreeFall(), 0.1, 2, sinks=sinks))
    begun = {line.split()[0] for line in log if line.endswith("begin")}
    assert {line.split()[0] for line in log if line.endswith("end")} == begun


def test_sinks_begin_with_the_first_frame():
    log_sink = CallLog()
    sp.simulate(scene(), FreeFall(), 0.1, 3, sinks=[log_sink])
    assert log_sink.log == []


def test_a_start_that_fails_the_check_of_the_solver_is_an_error_at_the_call():
    class ChecksStart(FreeFall):
        def check(self, system, state, workspace):
            raise sp.SolverError(f"not possible at t = {state.time}")

    with pytest.raises(sp.SolverError, match=r"not possible at t = 0\.0"):
        sp.simulate(scene(), ChecksStart(), 0.1, 3)


@pytest.mark.parametrize("case", ["overlap", "inverted"])
def test_the_implicit_solver_checks_a_start_before_any_sink_begins(case):
    mesh = sp.TetMesh(CUBE, CUBE_TETS)
    law = sp.NeoHookean(youngs=1e5, poisson=0.4)
    second = {"overlap": (0.5, 0.5, 0.5), "inverted": (3, 0, 0)}[case]
    setting = sp.Scene([sp.Body("cube", mesh, law), sp.Body("other", mesh, law, position=second)])
    positions = {"cube": CUBE * [-1, 1, 1]} if case == "inverted" else None
    log_sink = CallLog()
    with pytest.raises(sp.SuppleError, match={"overlap": "overlaps body", "inverted": "flat or inverted"}[case]):
        sp.simulate(setting, sp.Implicit(), 0.01, 1, sinks=[log_sink], initial_positions=positions)
    assert log_sink.log == []


def test_a_start_is_checked_once(monkeypatch):
    checked = []
    plain = ContactModel.raise_if_intersecting

    def check(self, x, time):
        checked.append(time)
        plain(self, x, time)

    monkeypatch.setattr(ContactModel, "raise_if_intersecting", check)
    frames = list(sp.simulate(scene(), sp.Implicit(), 0.01, 3))
    assert [frame.report.status for frame in frames] == ["converged"] * 3
    assert checked == [0.0]


@pytest.mark.parametrize(
    "motion", [None, sp.Keyframes([0.0, 1.0], angles=[0.0, 3.0], axis=(1, 2, 3), pivot=(0.1, 0, 0))]
)
def test_a_restart_from_a_frame_gives_the_same_bits(motion):
    setting = scene(pins=[sp.Pin("cube", [0, 5], motion)])
    whole = list(sp.simulate(setting, FreeFall(), 1 / 60, 20))
    first = list(sp.simulate(setting, FreeFall(), 1 / 60, 9))[-1]
    rest = list(sp.simulate(setting, FreeFall(), 1 / 60, 11, start=first))
    assert [frame.index for frame in rest] == list(range(10, 21))
    for one, other in zip(whole[9:], rest, strict=True):
        assert one.time == other.time
        assert np.array_equal(one.state.positions, other.state.positions)
        assert np.array_equal(one.state.velocities, other.state.velocities)


@pytest.mark.parametrize("integrator", ["backward_euler", "bdf2", "newmark"])
def test_a_restart_with_the_same_solver_keeps_the_scales_of_contact(integrator):
    """A cube on a floor jumps: a start in the air is farther from the floor than the beginning."""
    body = replace(scene().bodies[0], position=(0, 1e-3, 0), velocity=(0.1, 0.8, 0), friction=0.4)
    setting = sp.Scene([body], obstacles=[sp.HalfSpace(friction=0.4)])
    solver = sp.Implicit(integrator=integrator)
    whole = list(sp.simulate(setting, solver, 1 / 60, 16))
    assert whole[4].report.min_distance is None  # in the air
    assert whole[-1].report.min_distance is not None
    for k in (5, 14):
        rest = list(sp.simulate(setting, solver, 1 / 60, 16 - k, start=whole[k - 1]))
        for one, other in zip(whole[k:], rest, strict=True):
            assert np.array_equal(one.state.positions, other.state.positions)
            assert np.array_equal(one.state.velocities, other.state.velocities)
            assert one.report.details.dhat == other.report.details.dhat


def test_a_start_may_be_a_state():
    state = State(2.0, CUBE + 1.0, np.zeros((8, 3)))
    frame = next(sp.simulate(scene(gravity=(0, 0, 0)), FreeFall(), 0.5, 1, start=state))
    assert (frame.index, frame.time) == (1, 2.5)
    np.testing.assert_array_equal(frame.positions["cube"], CUBE + 1.0)


@pytest.mark.parametrize("solver", [sp.XPBD(substeps=5), sp.Implicit()])
def test_a_start_may_be_a_frame_of_a_recording(tmp_path, solver):
    setting = scene(pins=[sp.Pin("cube", [0, 5])])
    path = tmp_path / "first.vtkhdf"
    frames = list(sp.simulate(setting, solver, 1 / 60, 3, sinks=[sp.Recorder(path)]))
    with sp.read_recording(path) as recording:
        again = list(sp.simulate(setting, solver, 1 / 60, 2, start=recording[-1]))
    whole = list(sp.simulate(setting, solver, 1 / 60, 2, start=frames[-1].state))
    assert [frame.index for frame in again] == [4, 5]
    for one, other in zip(again, whole, strict=True):
        assert one.time == other.time
        assert np.array_equal(one.state.positions, other.state.positions)


def test_initial_positions_and_velocities():
    given = {"initial_positions": {"cube": 2 * CUBE}, "initial_velocities": {"cube": np.zeros((8, 3))}}
    frame = next(sp.simulate(scene(gravity=(0, 0, 0)), FreeFall(), 0.5, 1, **given))
    np.testing.assert_array_equal(frame.positions["cube"], 2 * CUBE)
    assert frame.report.min_det_F == pytest.approx(8.0)
    # psi at F = 2 I: mu/2 (12 - 3) - 7 mu + lam/2 49
    mu, lam = sp.StableNeoHookean(youngs=1e5, poisson=0.4).lame_parameters()
    assert frame.report.elastic_energy == pytest.approx(float(4.5 * mu - 7 * mu + 24.5 * lam))


WRONG = [
    ({"dt": 0.0}, sp.SolverError, "dt is 0.0"),
    ({"dt": float("nan")}, sp.SolverError, "dt is nan"),
    ({"dt": "1/60"}, sp.SolverError, "dt is '1/60'"),
    ({"steps": -1}, sp.SolverError, "steps is -1"),
    ({"steps": 2.5}, sp.SolverError, "steps is 2.5"),
    ({"scene": "scene.yaml"}, sp.SceneError, "the scene is a str"),
    ({"solver": "xpbd"}, sp.SolverError, "the solver is 'xpbd'"),
    ({"start": 3}, sp.SceneError, "start is a int"),
    ({"start": State(0.0, CUBE[:4], CUBE[:4])}, sp.SceneError, "start has 4 vertices, the scene has 8"),
    ({"start": State(0.0, CUBE * np.nan, CUBE)}, sp.SceneError, "not finite"),
    ({"start": State(0.0, CUBE, CUBE), "initial_positions": {}}, sp.SceneError, "not both"),
]


@pytest.mark.parametrize(("changes", "error", "words"), WRONG)
def test_invalid_input_is_an_error_at_the_call(changes, error, words):
    call = {"scene": scene(), "solver": FreeFall(), "dt": 0.1, "steps": 3, **changes}
    with pytest.raises(error, match=words):
        sp.simulate(call.pop("scene"), call.pop("solver"), call.pop("dt"), call.pop("steps"), **call)


def test_energies_of_edges_and_volume_follow_their_compliances():
    material = sp.EdgesAndVolume(edge_compliance=1e-3, volume_compliance=1e-5)
    setting = sp.Scene([sp.Body("cube", sp.TetMesh(CUBE, CUBE_TETS), material)], gravity=(0, 0, 0))
    system = build_system(setting)
    stretched = initial_state(setting, {"cube": CUBE * [1.1, 1.0, 1.0]})
    ends = CUBE[system.edges]
    change = np.linalg.norm((ends[:, 1] - ends[:, 0]) * [1.1, 1, 1], axis=1) - system.rest_lengths
    expected = 0.5 * (change @ change) / 1e-3 + 0.5 * 6 * (0.1 / 6) ** 2 / 1e-5
    assert measure(system, stretched).elastic_energy == pytest.approx(expected)


def test_an_early_end_is_a_warning_of_python_and_of_the_log(caplog):
    with pytest.warns(sp.SuppleWarning) as warned:
        list(sp.simulate(scene(), FreeFall(stops_at=3), 0.1, 10))
    assert [warning.filename for warning in warned] == [__file__]
    text = "stopped at frame 3 of 10, t = 0.2 s: not_finite: vertex 2 left for infinity"
    assert str(warned[0].message) == text
    assert [record.getMessage() for record in caplog.records] == [text]


def test_a_warning_is_seen_once_where_no_log_is_set_up(caplog, monkeypatch):
    monkeypatch.setattr(logging.getLogger("supple"), "propagate", False)
    with pytest.warns(sp.SuppleWarning, match="stopped at frame 3 of 10") as warned:
        list(sp.simulate(scene(), FreeFall(stops_at=3), 0.1, 10))
    assert len(warned) == 1
    assert not caplog.records


@pytest.mark.filterwarnings("error")
def test_strict_raises_at_the_frame_that_did_not_converge():
    log_sink = CallLog()
    frames = sp.simulate(scene(), FreeFall(stops_at=3), 0.1, 10, sinks=[log_sink], strict=True)
    with pytest.raises(sp.SolverError, match=r"^simulate: frame 3 of 10, t = 0.2 s: not_finite: vertex 2 left"):
        list(frames)
    assert log_sink.log == ["begin", "write 1", "write 2", "write 3", "end"]
    assert len(list(sp.simulate(scene(), FreeFall(), 0.1, 3, strict=True))) == 3


def burst(**options):
    """A thin ball of rubber under more pressure than any equilibrium bears."""
    mesh = sp.shapes.spherical_shell(inner_radius=0.1, outer_radius=0.12, edge_length=0.08)
    body = sp.Body("balloon", mesh, sp.NeoHookean(youngs=1e5, poisson=0.4))
    foot = sp.Pin("balloon", sp.InBox((-1, -1, -1), (1, -0.09, 1)))
    filled = sp.Cavity("balloon", pressure=sp.Curve([0, 1], [0, 2e5]))
    setting = sp.Scene([body], pins=[foot], cavities=[filled], gravity=(0, 0, 0))
    solver = sp.Implicit("static", max_iterations=20, max_substeps=1)
    return sp.simulate(setting, solver, 0.025, 10, **options)


def test_a_load_without_an_equilibrium_ends_with_a_reason_and_a_remedy():
    with pytest.warns(sp.SuppleWarning, match="have no equilibrium: follow the motion with integrator='backward_eul"):
        frames = list(burst())
    assert 1 < len(frames) < 10
    with pytest.raises(sp.SolverError, match=r"frame 2 of 10, .*: iteration_limit: "):
        list(burst(strict=True))


@pytest.mark.filterwarnings("ignore::supple.errors.SuppleWarning")
def test_a_check_says_how_a_run_ended_before_its_last_frame(tmp_path):
    path, solvers = tmp_path / "recording.vtkhdf", (FreeFall(stops_at=3), FreeFall())
    texts = ("the solver stopped at frame 3 of 10 (not_finite)", "it ends at frame 4 of 10")
    for solver, text in zip(solvers, texts, strict=True):
        frames = sp.simulate(scene(), solver, 0.1, 10, sinks=[sp.Recorder(path)])
        list(itertools.islice(frames, 4))
        frames.close()
        report = sp.check_recording(path, only=["finite", "status"])
        assert report.unfinished == text
        assert f" frames checked ({text}), " in report.verdict
        assert report.ok is (solver.stops_at is None)
        path.unlink()
    list(sp.simulate(scene(), FreeFall(), 0.1, 2, sinks=[sp.Recorder(path)]))
    assert sp.check_recording(path, only=["finite", "status"]).verdict.endswith("all 3 frames checked, 2 checks passed")
