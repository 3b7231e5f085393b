"""Every published case stays within its bounds of the values that its source gives, and the page shows each."""

import json
from pathlib import Path

import numpy as np
import pytest
from benchmarks import published, published_against
from tests.published.case import modules

import supple as sp

CASES = modules()
NAMES = sorted(CASES)


def errors(case, mesh):
    """The relative error of each quantity."""
    solution = case.solve(mesh)
    assert set(solution.values) == set(case.references)
    return {name: reference.error(solution.values[name]) for name, reference in case.references.items()}


@pytest.mark.parametrize("name", NAMES)
def test_the_coarser_mesh_is_within_its_bounds(name):
    case = CASES[name].CASE
    found = errors(case, case.meshes[0])
    assert {key: error for key, error in found.items() if not error <= case.references[key].coarse} == {}


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_the_finer_mesh_is_within_its_bounds_and_has_the_order(name):
    case = CASES[name].CASE
    found = errors(case, case.meshes[1])
    assert {key: error for key, error in found.items() if not error <= case.references[key].bound} == {}
    if case.order is not None:
        first = next(iter(case.references))
        before = errors(case, case.meshes[0])[first]
        assert np.log(before / found[first]) / np.log(case.refined) >= case.order


@pytest.mark.parametrize("name", NAMES)
def test_a_case_is_one_short_file_and_states_its_source(name):
    text = Path(str(CASES[name].__file__)).read_text(encoding="utf-8")
    case = CASES[name].CASE
    assert text.count("\n") <= 120
    assert case.source.rpartition(" ")[0].split(",")[0] in str(CASES[name].__doc__).replace("\n", " ")
    assert all(reference.bound <= 0.03 for reference in case.references.values())


def test_the_page_shows_every_case():
    page = published.PAGE.read_text(encoding="utf-8")
    assert published.with_cases(page) == page
    assert published.measured_names() == NAMES
    for name in NAMES:
        assert (published.PICTURES / f"{name}.png").is_file()


def test_the_page_shows_each_program_on_each_of_the_compared_cases():
    page = published.PAGE.read_text(encoding="utf-8")
    for program in published_against.PROGRAMS:
        figures = json.loads(published_against.file_of(program).read_text(encoding="utf-8"))
        assert list(figures["rows"]) == list(published_against.CASES)
        for rows in figures["rows"].values():
            for _, quantity, _, label, value, *_ in rows:
                assert f"| {quantity} |" in page
                assert f"| {label} | {value} |" in page


def test_linear_tets_between_the_nodes_of_quadratic_ones_fill_them():
    x, tets = published_against.linear(CASES["cook"].panel(4, 1.0))
    assert sp.TetMesh(x, tets).volume == pytest.approx(48 * (44 + 16) / 2)


def test_forces_at_nodes_are_those_of_linear_tets():
    problem = published_against.hertz_problem()
    sheared = problem.points @ (np.eye(3) + 1e-3 * np.eye(3, k=1))
    forces = published_against.elastic_forces(problem, sheared)
    shear = 1e-3 * problem.lame()[1] * 4 * (published_against.ball.FAR * published_against.ball.CONTACT) ** 2
    top = problem.points[:, 1] > problem.points[:, 1].max() - 1e-9
    assert np.abs(forces.sum(axis=0)).max() < 1e-9 * np.abs(forces).max()
    assert abs(forces[top, 0].sum()) == pytest.approx(shear, rel=1e-2)
