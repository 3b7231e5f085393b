"""The beam of the benchmarks runs with both solvers, and the benchmarks' measures are correct."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import supple as sp
from supple.results.readings.fields import FIELDS

ROOT = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def _benchmarks_can_be_imported(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT))


@pytest.mark.parametrize(
    "arguments",
    [
        ["xpbd", "1", "60", "2"],
        ["xpbd_without_contact", "1", "60", "2"],
        ["implicit", "1", repr(1 / 120), "newmark", "0", "2"],
    ],
    ids=lambda arguments: arguments[0],
)
def test_the_beam_falls_and_its_positions_are_kept(arguments, monkeypatch, capsys, tmp_path):
    from benchmarks import our_beam

    file = tmp_path / "positions.npy"
    monkeypatch.setattr(sys, "argv", ["our_beam.py", *arguments, str(file)])
    our_beam.main()
    result = json.loads(capsys.readouterr().out)
    assert result["tets"] == 1152
    assert result["finite"]
    assert result["statuses"] == ["converged"]
    kept = np.load(file)
    drop = (kept[:, 1] - kept[:, 4])[kept[:, 0] > 0.59].mean()
    assert drop == pytest.approx(0.5 * 9.81 * (2 / 60) ** 2, rel=0.3)  # as in free fall: the wall is not felt yet


def test_errors_are_relative_to_the_tip():
    from benchmarks.work_precision import relative_error

    rest = np.array([[0.0, 0, 0], [1.0, 0, 0]])
    end = np.array([[0.0, 0, 0], [1.0, -0.5, 0]])
    reference = np.hstack([rest, end])
    assert relative_error(reference, reference) == 0.0
    off = np.hstack([rest, end + np.array([0, 0.05, 0])])
    assert relative_error(off, reference) == pytest.approx(0.1)


def test_the_sag_at_the_automatic_number_of_substeps_has_the_accuracy_asked_for():
    from benchmarks import automatic_substeps as sag

    *_, still = sp.simulate(sag.scene(1e5, 0.45, 0.1), sp.Implicit(integrator="static", contact=None), 1 / 60, 2)
    reference = sag.sag(still, 0.1)
    for youngs, size, dt in ((1e5, 0.1, 1 / 60), (1e7, 1.0, 1 / 60), (1e4, 0.01, 1 / 240)):
        status, substeps, error = sag.case(youngs, 0.45, size, dt, reference)
        assert status == "converged"
        assert substeps > 10
        assert abs(error) < 0.022
    assert sag.case(1e3, 0.45, 10.0, 1 / 240, reference) is None


@pytest.mark.slow
def test_the_live_ball_is_simulated_with_and_without_its_page(capsys):
    from benchmarks import live

    figures = live.main(rounds=1, frames=6, edge_length=0.25, seconds=0.2)
    assert list(figures["ways"]) == ["headless", "engine", "page"]
    assert all(item["best"] == item["median"] > 0.0 for item in figures["ways"].values())
    assert "of real time" in capsys.readouterr().out


def test_times_of_the_parts_of_steps_with_contact():
    from benchmarks.contact_scenes import PARTS, case, measured

    result = measured(case("knives:small"), 14)
    assert result["tets"] == 300
    assert result["contacts"] > 0
    assert result["converged"]
    assert result["iterations"] >= 1.0
    assert all(0.0 < result[part] < 1.0 for part in PARTS)
    assert sum(result[part] for part in PARTS) <= 1.0


def test_the_time_of_an_iteration_in_a_small_scene():
    from benchmarks.small_scenes import measured

    result = measured("slope")
    assert result["tets"] == 48
    assert result["converged"]
    assert result["iterations"] > result["steps"]
    assert result["ms"] > 0.0


@pytest.mark.slow
def test_the_search_for_contact_is_measured_in_piles_of_bears(capsys):
    from benchmarks import candidate_search

    figures = candidate_search.main((1, 3))
    assert [row[0] for row in figures["rows"]] == [1, 3]
    assert "power" in figures["notes"][0]
    assert "power" in capsys.readouterr().out


@pytest.mark.slow
def test_contact_scenes_are_measured_against_another_checkout(capsys):
    from benchmarks import contact_scenes

    figures = contact_scenes.main(["slope:small"], steps=4, against=ROOT / "src")
    this, other = figures["rows"]
    assert (this[0], other[0]) == ("slope:small", "other")
    assert this[1:4] == other[1:4]  # tets, contacts, iterations: both are the same package
    assert this[4] > 0.0
    assert "other / this, Newton/step and ms/step:  1.00" in capsys.readouterr().out


def test_a_checkout_without_the_package_is_refused(tmp_path):
    from benchmarks import contact_scenes

    with pytest.raises(SystemExit, match="the package supple is missing in it"):
        contact_scenes.main(["slope:small"], against=tmp_path)


@pytest.mark.slow
def test_quadratic_tets_are_compared_with_linear_ones(capsys):
    from benchmarks import quadratic_tets

    problem = quadratic_tets.PROBLEMS[0]
    quadratic_tets.main((replace(problem, linear=(2, 4), quadratic=(2,), reference=4),), rounds=1)
    out = capsys.readouterr().out
    assert "Cook's membrane, nu = 1/3: 24 quadratic tets are as good as 96 linear ones" in out


def test_plates_that_are_bodies_are_compared_with_obstacles(capsys):
    from benchmarks import rigid_bodies

    figures = rigid_bodies.main(0.03, steps=4, skipped=2, rounds=1)
    assert list(figures["solvers"]) == ["Implicit", "XPBD"]
    for plates in figures["solvers"].values():
        assert list(plates) == ["obstacles", "scripted bodies", "free bodies"]
        assert all(item["ms_per_step"] > 0.0 for item in plates.values())
    assert "between two plates" in capsys.readouterr().out


def test_the_scripted_plate_moves_as_the_free_one():
    from benchmarks import rigid_bodies

    solver = sp.XPBD()
    path = rigid_bodies.path_of_the_free_plate(solver, 0.03, steps=6)
    *_, free = sp.simulate(rigid_bodies.scene("free bodies", 0.03), solver, rigid_bodies.STEP, 6)
    *_, moved = sp.simulate(rigid_bodies.scene("scripted bodies", 0.03, path), solver, rigid_bodies.STEP, 6)
    fallen = rigid_bodies.HEIGHT - free.poses["upper"].translation[1]
    assert fallen > 0.01
    np.testing.assert_allclose(moved.poses["upper"].translation, free.poses["upper"].translation, rtol=0.0, atol=1e-12)


@pytest.mark.slow
def test_a_pile_of_bears_presses_on_itself_and_stays_apart():
    from benchmarks import bear_pile

    found = bear_pile.one(5)
    assert found["statuses"] == "converged"
    assert found["failures"] == []
    assert found["steps"][0][1] > 1000  # contacts


@pytest.mark.slow
def test_reading_all_fields_of_a_finger_is_measured(capsys):
    from benchmarks import reading_fields

    figures = reading_fields.main(chambers=1, frames=2, skipped=1)
    assert list(figures["fields"]) == list(FIELDS)
    assert 0.0 < figures["share"] < 1.0
    assert "all fields" in capsys.readouterr().out
