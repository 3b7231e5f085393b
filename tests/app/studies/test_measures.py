"""Measures of study files, on the recording of a free fall with a known solution."""

import numpy as np
import pytest

import supple as sp
from supple.app.studies.measures import NUMBERS, VECTORS, Measure, Measures

from .conftest import FALL_DT, FALL_STEPS, fallen, make_fall

G = 10.0


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("fall") / "recording.vtkhdf"
    solver = sp.XPBD(substeps=1, contact=None)
    for _ in sp.simulate(make_fall(G), solver, FALL_DT, FALL_STEPS, sinks=[sp.Recorder(path)]):
        pass
    with sp.read_recording(path) as opened:
        yield opened


SPEED = G * FALL_DT * FALL_STEPS


@pytest.mark.parametrize(
    ("measure", "expected"),
    [
        (Measure("kinetic_energy"), 500.0 * SPEED**2),
        (Measure("kinetic_energy", time="first"), 0.0),
        (Measure("min_det_F", time="min"), 1.0),
        (Measure("linear_momentum", axis="y"), -1000.0 * SPEED),
        (Measure("linear_momentum", time="max"), 1000.0 * SPEED),
        (Measure("potential_energy", time="range"), 1000.0 * G * -fallen(G)),
        (Measure("displacement", "cube", axis="y"), fallen(G)),
        (Measure("displacement", "cube"), -fallen(G)),
        (Measure("displacement", "cube", axis="x", time="max"), 0.0),
        (Measure("position", "cube", axis="y", over="max", time="first"), 2.5),
        (Measure("position", "cube", axis="y", over="range", time="mean"), 1.0),
        (Measure("position", "cube", axis="x", vertices=(0,)), -0.5),
        (Measure("velocity", "cube", axis="y", time="min"), -SPEED),
        (Measure("velocity", "cube", axis="y", time="sum"), fallen(G) / FALL_DT),
    ],
)
def test_measures_equal_the_formula(recording, measure, expected):
    assert measure.of(recording) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_every_series_is_one_that_recordings_have(recording):
    for name in (*NUMBERS, *VECTORS):
        assert len(recording.series(name)) == FALL_STEPS + 1


@pytest.mark.parametrize(
    ("measure", "words"),
    [
        (Measure("largest_stitch_stretch"), "is in no frame"),
        (Measure("position", "ball"), "body 'ball' does not exist"),
        (Measure("position", "cube", vertices=(1, 8)), "8 vertices; vertex 8 does not exist"),
    ],
)
def test_what_cannot_be_measured_is_one_line(recording, measure, words):
    with pytest.raises(sp.SuppleError, match=words):
        measure.of(recording)


def test_measures_have_names_and_units(recording):
    measures = Measures({"drop": Measure("displacement", "cube"), "energy": Measure("kinetic_energy")})
    assert list(measures(recording)) == ["drop", "energy"]
    assert measures.units == {"drop": "m", "energy": "J"}
    assert all(np.isfinite(list(measures(recording).values())))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"quantity": "kinetic_energy", "axis": "x"}, "kinetic_energy has no axis; remove it"),
        ({"quantity": "kinetic_energy", "body": "cube"}, "is of the whole scene; remove body"),
        ({"quantity": "linear_momentum", "over": "max"}, "linear_momentum has no over; remove it"),
        ({"quantity": "velocity"}, "velocity needs a body"),
        ({"quantity": "speed"}, "quantity is 'speed'; give 'kinetic_energy'"),
        ({"quantity": "velocity", "body": "cube", "vertices": [-1]}, "vertices is -1; give a whole number"),
    ],
)
def test_measures_that_make_no_sense_are_refused_in_one_line(arguments, words):
    with pytest.raises(sp.StudyError, match=words):
        Measure(**arguments)
