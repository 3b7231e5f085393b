"""Every example runs, and its physical number is correct."""

import importlib.util
import warnings
from functools import partial
from pathlib import Path

import pytest

import supple as sp
from supple.app.scene_file.loader import load_run
from supple.simulate import simulate

EXAMPLES = Path(__file__).parents[1] / "examples"


def run_example(name, *arguments):
    return example(name).main(*arguments)


def example(name):
    (path,) = EXAMPLES.glob(f"{name}_*.py")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_01_a_ball_falls_freely_is_squashed_and_springs_back():
    found = run_example("01")
    assert found["fall_error"] < 2e-3
    assert found["lowest"] < 0.7
    assert found["rebound"] > 0.95


def test_02_a_stretched_bar_has_the_lateral_stretch_of_its_material():
    assert run_example("02") == pytest.approx(0.84327, rel=0.01)


def test_03_a_free_spin_keeps_its_angular_momentum():
    assert run_example("03") < 1e-10


def test_04_a_block_slides_as_coulombs_law_predicts():
    assert run_example("04") == pytest.approx(1.0, rel=0.02)


def test_05_a_cantilever_bends_as_beam_theory_predicts():
    found = run_example("05")
    assert found["theory"] == pytest.approx(4.031e-4, rel=1e-4)
    assert found["coarse"] < 0.85 * found["theory"] < 0.92 * found["theory"] < found["fine"] < found["theory"]
    assert found["limit"] == pytest.approx(found["theory"], rel=0.03)


def test_06_random_search_improves_the_reward_of_a_controller():
    gymnasium = pytest.importorskip("gymnasium")
    module = example("06")
    make = partial(module.Reach, episode_steps=25, substeps=4)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # The forces and their reach are bounded, what a soft arm does is not; four substeps are few.
        warnings.filterwarnings("ignore", message=".*observation space m.*imum value is -?infinity")
        warnings.filterwarnings("ignore", category=sp.SuppleWarning)
        pytest.importorskip("gymnasium.utils.env_checker").check_env(make(), skip_render_check=True)
    rewards = module.main(3, make, gymnasium.vector.SyncVectorEnv)
    assert rewards == sorted(rewards), "the best one is kept"
    assert rewards[0] < -0.2, "without forces, the tip hangs beside the goal"
    assert rewards[-1] > 0.7 * rewards[0], "on the average of the way, it is much nearer"


def test_07_rigid_jaws_carry_a_soft_cube_by_friction():
    assert run_example("07") == pytest.approx(1.0, rel=0.01)


def test_every_example_is_run_by_a_test_of_this_file():
    numbers = {path.name[:2] for path in EXAMPLES.glob("[0-9]*.py")}
    tested = {name[5:7] for name in globals() if name.startswith("test_0")}
    assert numbers == tested


def test_the_patch_stays_on_the_swinging_bar():
    run = load_run(EXAMPLES / "scenes" / "patch.yaml")
    (seam,) = run.scene.stitching.ranges
    assert len(seam.pairs.rows) == 28
    *_, frame = simulate(run.scene, run.solver, run.dt, 30, **run.start)
    report = frame.report
    assert report.status == "converged"
    assert frame.positions["bar"][:, 1].min() < -0.5, "the bar hangs down"
    assert 1.0 < report.largest_stitch_stretch < 1.2
    assert 0.0 < report.stitch_energy < 0.01 * report.elastic_energy
    assert report.min_det_F > 0.5


@pytest.mark.parametrize("path", sorted((EXAMPLES / "scenes").glob("*.yaml")), ids=lambda path: path.stem)
def test_every_scene_file_loads(path):
    assert load_run(path).steps > 0


def test_the_study_of_the_slope_follows_coulomb_s_law(tmp_path):
    table = sp.studies.load_study(EXAMPLES / "studies" / "slope.yaml").run(tmp_path, workers=1)
    # s = (g sin 30 - mu g cos 30) t^2 / 2 after one second, and nothing where tan 30 is less than mu
    expected = [max(0.0, 0.5 * (4.905 - mu * 8.495709)) for mu in table["obstacles.slope.friction"]]
    assert table["slid"] == pytest.approx(expected, rel=0.03, abs=2e-3)
    assert table.units == {"obstacles.slope.friction": "", "slid": "m"}
