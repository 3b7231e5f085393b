"""The values that designs choose: exact levels, strata, balance, and errors of one line."""

import numpy as np
import pytest

import supple as sp
from supple.app.studies.factors import as_factor, plain

Factor = sp.studies.Factor
FACTORS = {"a": Factor(values=(1, 2, 3)), "b": Factor(values=("x", "y"))}


def test_a_grid_has_every_combination_once_and_the_last_factor_is_fastest():
    points = sp.studies.Grid().points(FACTORS)
    assert [(p["a"], p["b"]) for p in points] == [(1, "x"), (1, "y"), (2, "x"), (2, "y"), (3, "x"), (3, "y")]


def test_levels_of_ranges_have_exact_ends_and_constant_differences_or_ratios():
    even = sp.studies.uniform(0.1, 1.0, 4).levels("f")
    assert (even[0], even[-1]) == (0.1, 1.0)
    np.testing.assert_allclose(even, [0.1, 0.4, 0.7, 1.0], rtol=1e-15)
    ratios = sp.studies.loguniform(1e3, 1e6, 4).levels("f")
    assert (ratios[0], ratios[-1]) == (1e3, 1e6)
    np.testing.assert_allclose(ratios, [1e3, 1e4, 1e5, 1e6], rtol=1e-14)
    assert sp.studies.uniform(2, 3, 1).levels("f") == [2.0]
    assert sp.studies.loguniform(2, 3, 1).levels("f") == [2.0]


def test_a_latin_hypercube_has_one_point_in_each_stratum():
    factors = {
        "u": sp.studies.uniform(-1.0, 3.0),
        "v": sp.studies.loguniform(1.0, 1024.0),
        "w": Factor(values=("p", "q")),
    }
    points = sp.studies.LatinHypercube(16, seed=3).points(factors)
    u = np.sort([p["u"] for p in points])
    v = np.sort(np.log2([p["v"] for p in points]))
    assert np.array_equal(np.floor((u + 1.0) / 4.0 * 16), np.arange(16))
    assert np.array_equal(np.floor(v / 10.0 * 16), np.arange(16))
    assert sorted(p["w"] for p in points) == ["p"] * 8 + ["q"] * 8
    assert points == sp.studies.LatinHypercube(16, seed=3).points(factors)
    assert points != sp.studies.LatinHypercube(16, seed=4).points(factors)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: sp.studies.uniform(1.0, 1.0), "the lower one first"),
        (lambda: sp.studies.uniform(0.0, float("inf")), "finite"),
        (lambda: sp.studies.uniform("x", 1), "two numbers"),  # pyright: ignore[reportArgumentType]
        (lambda: sp.studies.loguniform(0.0, 1.0), "above zero"),
        (lambda: sp.studies.loguniform(1.0, 2.0, 0), "count is 0"),
        (
            lambda: sp.studies.Grid().points({"f": sp.studies.uniform(0.0, 1.0)}),
            "'f': a grid needs .* give its count",
        ),
        (lambda: sp.studies.Grid().points({k: Factor(values=tuple(range(200))) for k in "abc"}), "8e\\+06 cases"),
        (lambda: sp.studies.LatinHypercube(0), "samples is 0"),
        (lambda: Factor(), "none of them given; give exactly one of values, uniform and loguniform"),
        (lambda: sp.studies.LatinHypercube(8, seed=-1), "seed is -1"),
        (lambda: Factor(values=()), "0 values"),
        (lambda: Factor(values=(float("nan"),)), "not finite"),
        (lambda: Factor(values=(object(),)), "give numbers, texts"),
        (lambda: as_factor("f", 3.0), "give a list"),
        (lambda: as_factor("f", "abc"), "give a list"),
    ],
)
def test_factors_and_designs_that_make_no_sense_are_refused_in_one_line(make, words):
    with pytest.raises(sp.StudyError, match=words):
        make()


def test_values_become_what_json_has():
    assert plain(np.float64(0.5), "x") == 0.5
    assert plain(np.arange(3), "x") == [0, 1, 2]
    assert plain((1, [True, None, "x"]), "x") == [1, [True, None, "x"]]
    factor = as_factor("f", np.array([1, 2]))
    assert [type(value) for value in factor.values] == [int, int]
