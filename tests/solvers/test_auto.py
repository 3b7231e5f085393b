"""Which solver is chosen, by counts alone, and where it is said."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.app.cli.run_estimate import RunEstimate, faster_ways
from supple.app.cli.run_rows import run_rows
from supple.app.scene_file.loader import load_run
from supple.app.scene_file.new_scenes import new_scene
from supple.app.studies.sources import varied_function
from supple.model.system import build_system, initial_state
from supple.results import progress
from supple.solvers.auto import Auto, Counts

FLOOR = sp.HalfSpace()


def system_of(*bodies, **parts):
    scene = sp.Scene(bodies, [FLOOR], **parts)
    return build_system(scene, initial_state(scene))


def box(size, cells, youngs, name="part", **changes):
    mesh = sp.shapes.box((size,) * 3, (cells,) * 3)
    return sp.Body(name, mesh, sp.StableNeoHookean(youngs=youngs, poisson=0.4), position=(0, size, 0), **changes)


# (size, cells, E): measured CPU of a frame of XPBD and of Implicit [ms]; see notes/measured_trials.md.
MEASURED = {
    (0.3, 4, 1e4): (6.6, 9.9),
    (1.0, 4, 1e6): (4.3, 7.1),
    (0.05, 8, 1e4): (18, 38),
    (0.05, 4, 1e5): (17, 10),
    (0.005, 4, 1e6): (499, 4.9),
    (0.05, 4, 1e9): (1276, 5.1),
}


@pytest.mark.parametrize(("part", "cost"), MEASURED.items())
def test_the_solver_that_was_measured_to_be_faster_is_chosen(part, cost):
    chosen = Auto().choices(system_of(box(*part)), 1 / 60)[0]
    assert type(chosen) is (sp.XPBD if cost[0] < cost[1] else sp.Implicit)


def test_a_stiff_washer_is_simulated_with_implicit_and_the_reason_is_recorded(tmp_path):
    washer = sp.Body(
        "washer", sp.shapes.box((0.04, 0.003, 0.04), (8, 1, 8)), box(1, 1, 1e6).material, position=(0, 0.003, 0)
    )
    scene, path = sp.Scene([washer], [FLOOR]), tmp_path / "washer.vtkhdf"
    (frame,) = sp.simulate(scene, dt=1 / 60, steps=1, sinks=[sp.Recorder(path)])
    assert frame.solver == sp.Implicit()
    reason = f"XPBD needs {Counts.of(frame.system, 1 / 60, 0.02).substeps:,} substeps a frame for the stiffness"
    assert frame.solver.because == f"{reason} of body 'washer'"
    with sp.read_recording(path) as recording:
        assert recording.solver == f"{frame.solver}, chosen: {frame.solver.because}"
    (again,) = sp.simulate(scene, dt=1 / 60, steps=1, start=frame)  # the choice depends on the scene, not on the state
    assert again.solver == frame.solver


def test_fewer_substeps_are_needed_in_shorter_frames_and_with_less_accuracy():
    system = system_of(box(0.05, 4, 1e5))
    assert type(Auto().choices(system, 1 / 600)[0]) is sp.XPBD
    assert Auto(accuracy=0.1).choices(system, 1 / 60)[0] == sp.XPBD(accuracy=0.1)
    with pytest.raises(sp.SolverError, match="accuracy"):
        Auto(accuracy=2.0)


def test_joints_and_welds_make_substeps_dear():
    assert type(Auto().choices(system_of(box(0.1, 2, 3e4)), 1 / 60)[0]) is sp.XPBD
    palm = sp.RigidBody("palm", sp.shapes.box((0.1,) * 3), density=1000, position=(0.101, 0.1, 0))
    weld = sp.Weld("part", "palm", max_distance=2e-3)
    assert type(Auto().choices(system_of(box(0.1, 2, 3e4), palm, welds=[weld]), 1 / 60)[0]) is sp.Implicit


def test_several_soft_bodies_cost_more_iterations():
    one = Counts(80, "a", 2000)
    assert one.implicit < one.xpbd
    assert one._replace(bodies=5).implicit > one._replace(bodies=5).xpbd


def test_what_only_one_solver_can_simulate_is_left_to_it():
    rubber = sp.Body(
        "ring", sp.shapes.box(divisions=(1, 1, 1)), sp.NeoHookean(youngs=1e3, poisson=0.3), position=(0, 2, 0)
    )
    (chosen,) = Auto().choices(system_of(rubber), 1 / 60)
    assert chosen == sp.Implicit()
    assert "material NeoHookean, which XPBD cannot simulate" in chosen.because
    springs = sp.EdgesAndVolume(edge_compliance=1e-9, volume_compliance=0.0, density=1000)
    hung = sp.Body("springs", sp.shapes.box(divisions=(1, 1, 1)), springs, position=(0, 2, 0))
    (chosen,) = Auto().choices(system_of(hung), 1 / 60)
    assert chosen == sp.XPBD(accuracy=0.02)
    with pytest.raises(sp.SolverError, match="XPBD: body 'ring' has the material NeoHookean"):
        Auto().choices(system_of(rubber, hung), 1 / 60)


def test_a_part_that_stands_on_the_floor_is_simulated_with_the_solver_that_starts_there():
    stiff = box(0.1, 2, 1e6)
    resting = sp.Body("part", stiff.mesh, stiff.material, position=(0, 0.05, 0))
    (frame,) = sp.simulate(sp.Scene([resting], [FLOOR]), dt=1 / 60, steps=1)
    assert frame.solver == sp.XPBD()
    assert frame.solver.because.startswith("Implicit cannot start: body 'part' touches obstacle")
    lifted = {"part": frame.positions["part"] + [0, 0.1, 0]}
    higher = replace(frame, state=replace(frame.state, positions=lifted["part"]))
    (after,) = sp.simulate(higher.system.scene, dt=1 / 60, steps=1, start=higher)
    assert after.solver == frame.solver  # a run that resumes keeps its solver
    with pytest.raises(sp.SceneError, match="touches"):
        sp.simulate(sp.Scene([resting], [FLOOR]), sp.Implicit(), 1 / 60, 1)


def test_time_and_number_of_steps_must_be_given():
    with pytest.raises(sp.SolverError, match="dt is None"):
        sp.simulate(sp.Scene([box(0.1, 1, 1e4)]))
    with pytest.raises(sp.SolverError, match="steps is None"):
        sp.simulate(sp.Scene([box(0.1, 1, 1e4)]), dt=0.1)
    with pytest.raises(sp.SolverError, match=r"the solver is 0\.1"):
        sp.simulate(sp.Scene([box(0.1, 1, 1e4)]), 0.1, 3)


def test_a_scene_file_leaves_the_choice_to_the_scene(tmp_path):
    text = new_scene("ball.yaml")
    assert "substeps a frame: auto is xpbd then" in text
    (tmp_path / "ball.yaml").write_text(text)
    run = load_run(tmp_path / "ball.yaml")
    assert run.solver == Auto(accuracy=0.1)
    assert run.chosen_solver == sp.XPBD(accuracy=0.1)
    (tmp_path / "ball.yaml").write_text(text.replace("youngs: 5e4", "youngs: 1e9"))
    assert load_run(tmp_path / "ball.yaml").chosen_solver == sp.Implicit()
    job = varied_function(lambda: load_run(tmp_path / "ball.yaml").scene, None, 1 / 60, 3)({}).job
    assert job(tmp_path).chosen_solver == sp.Implicit()


def test_a_run_folder_keeps_the_choice_and_resume_takes_it(tmp_path):
    stiff = sp.Scene([box(0.05, 2, 1e7)], [FLOOR])
    list(sp.simulate(stiff, dt=1 / 60, steps=1, sinks=[sp.RunFolder(tmp_path / "out")]))
    (frame,) = sp.resume(tmp_path / "out", stiff, Auto(), steps=2)
    assert frame.solver == sp.Implicit()
    solver = dict(run_rows(tmp_path / "out"))["solver"]
    assert solver.startswith("Implicit(integrator=")
    assert ", chosen: XPBD needs " in solver
    with pytest.raises(sp.OutputError, match="was run with Implicit"):
        sp.resume(tmp_path / "out", stiff, sp.XPBD(), steps=3)


def test_faster_ways_are_cheaper_by_counts():
    soft, stiff = system_of(box(0.3, 4, 1e4)), system_of(box(0.03, 4, 1e6))
    ways = faster_ways(sp.XPBD(), stiff, 1 / 60)
    assert ways[0] == "solver: {kind: implicit}"
    assert ways[-1] == "fewer tets"
    assert any("accuracy: 0.1" in way for way in ways)
    assert faster_ways(sp.Implicit(), soft, 1 / 60)[0] == "solver: {kind: xpbd}"
    assert faster_ways(sp.Implicit(), stiff, 1 / 60)[0].startswith("solver: {kind: implicit, max_iterations: 1}")
    assert faster_ways(sp.XPBD(), soft, 1 / 60) == ["fewer tets"]
    hard = system_of(box(0.03, 4, 1e9))  # XPBD takes its largest number of substeps at both accuracies
    assert faster_ways(sp.XPBD(), hard, 1 / 60) == ["solver: {kind: implicit}", "fewer tets"]


@pytest.mark.filterwarnings("ignore::supple.errors.SuppleWarning")
def test_a_long_run_says_what_it_will_take_and_again_when_frames_get_slower(monkeypatch):
    class Said(list):
        def print(self, text, **options):
            self.append(text)

    said = Said()
    monkeypatch.setattr(progress, "error_console", lambda: said)
    stiff = sp.Scene([box(0.03, 4, 1e6)])
    estimate = RunEstimate()
    frames = list(sp.simulate(stiff, sp.XPBD(substeps=100), 1 / 60, 1))
    estimate.begin(frames[0], 1 / 60, 100)
    for seconds in (60.0, *[1.0] * 9, 20.0):
        slow = np.float64(seconds)
        object.__setattr__(frames[0].report, "wall_seconds", slow)
        estimate.write(frames[0])
    estimate.end()
    assert said[0] == "about 2 min more for 94 frames; faster: solver: {kind: implicit}, or fewer tets"
    assert len(said) == 2
    assert said[1].startswith("about ")
    assert "faster" not in said[1]
