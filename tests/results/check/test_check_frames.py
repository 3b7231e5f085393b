"""Spoilt copies: numbers that are none, tets turned inside out, frames twice or left out."""

import numpy as np
import pytest
from tests.recordings import set_in_scene, system_in

import supple as sp
from supple.results.recording.recorder import REPORT_NUMBERS, REPORT_VECTORS

from .conftest import FRAMES, JELLY, V, X, failures, nan_position, recorded


def nan_velocity(file, n):
    file[V][2 * n] = np.inf


def nan_report(file, n):
    file["supple/frames/kinetic_energy"][5] = np.nan


def nan_determinant(file, n):
    file["VTKHDF/CellData/det_F"][int(file["VTKHDF/NumberOfCells"][0])] = np.nan


@pytest.mark.parametrize(
    ("change", "frame"),
    [(nan_position, 3), (nan_velocity, 2), (nan_report, 5), (nan_determinant, 1)],
)
def test_one_number_that_is_not_finite(free, corrupted, change, frame):
    path = corrupted(free, change)
    assert failures(path) == {"finite": frame}
    assert sp.check_recording(path)["finite"].failed_frames == 1


def test_a_mass_that_is_not_finite(free, corrupted):
    def change(file, n):
        set_in_scene(file, "scene/bodies/0/material/density", float("nan"))

    with pytest.raises(sp.OutputError, match="StableNeoHookean: density is nan; it must be finite and above zero"):
        sp.check_recording(corrupted(free, change))


def test_no_frame_is_finite(free, corrupted):
    def change(file, n):
        file[X][:] = np.nan

    report = sp.check_recording(corrupted(free, change))
    assert [(result.name, result.first_failure) for result in report.failures] == [("finite", 0)]
    assert {result.name for result in report.results if result.verdict == "pass"} == {
        "sequence",
        "status",
        "rest shape",
    }


def test_results_name_the_place(free, corrupted):
    report = sp.check_recording(corrupted(free, nan_position))
    assert report["finite"].message == "not finite: 1 number (position of vertex 4 of left); in 1 frame, first 3"
    assert (report["finite"].frame, report["finite"].time) == (3, pytest.approx(3 / 60))


@pytest.mark.parametrize("distance", [1e-5, 1e-7])
def test_one_vertex_moved(free, corrupted, distance):
    def change(file, n):
        file[X][4 * n + 7, 2] += distance

    path = corrupted(free, change)
    assert failures(path) == {"records": 4} | ({"balance": 4} if distance > 1e-6 else {})
    assert "det F" in sp.check_recording(path)["records"].where


def flip(file, n, share):
    """Move a vertex of tet 11 through its opposite face: share 2 mirrors it, 1 puts it into the face's plane."""
    tet = system_in(file).tets[11]
    x = file[X][3 * n : 4 * n]
    a, b, c, d = x[tet]
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    x[tet[3]] = d - share * ((d - a) @ normal) * normal
    file[X][3 * n : 4 * n] = x
    return tet


def test_one_tet_flipped(free, corrupted):
    path = corrupted(free, lambda file, n: flip(file, n, 2.0))
    report = sp.check_recording(path)
    assert report["inversion"].verdict == "fail"
    assert (report["inversion"].first_failure, report["inversion"].failed_frames) == (3, 1)
    assert report["inversion"].worst < -0.5
    assert report["inversion"].where.endswith("of left")
    assert failures(path)["records"] == 3


def test_one_tet_exactly_flat(free, corrupted):
    def change(file, n):
        a, b, c, d = system_in(file).tets[11]
        file[X][3 * n + d] = 0.5 * file[X][3 * n + a] + 0.5 * file[X][3 * n + b]
        file[X][3 * n + c] = file[X][3 * n + c]

    assert failures(corrupted(free, change), only=["inversion"]) == {"inversion": 3}


def test_a_tet_inverted_at_rest(free, corrupted):
    def change(file, n):
        tets = file["supple/scene/bodies/0/mesh/tets"]
        tets[5] = tets[5][[1, 0, 2, 3]]

    with pytest.raises(sp.OutputError, match="1 tets of body 'left' are inverted at rest"):
        sp.check_recording(corrupted(free, change))


def frame_series(file):
    names = ["time", "index", "status", "iterations", *REPORT_NUMBERS, *REPORT_VECTORS]
    return [file[f"supple/frames/{name}"] for name in names]


def repeat(file, n, source, target, *, but=()):
    m = int(file["VTKHDF/NumberOfCells"][0])
    for data, rows in ((file[X], n), (file[V], n), (file["VTKHDF/CellData/det_F"], m)):
        data[target * rows : (target + 1) * rows] = data[source * rows : (source + 1) * rows]
    for data in frame_series(file):
        if data.name.rpartition("/")[2] not in but:
            data[target] = data[source]


def test_a_repeated_frame(free, corrupted):
    found = failures(corrupted(free, lambda file, n: repeat(file, n, 3, 4)))
    assert found == {"sequence": 4, "balance": 4}
    report = sp.check_recording(corrupted(free, lambda file, n: repeat(file, n, 3, 4, but=("time", "index"))))
    assert report["sequence"].where == "repeats frame 3 although it moves"
    assert {result.name: result.first_failure for result in report.failures} == {
        "sequence": 4,
        "momentum": 4,
        "balance": 4,
    }


def test_a_missing_frame(free, corrupted):
    def change(file, n):
        file["supple/frames/index"][4:] = file["supple/frames/index"][4:] + 1

    assert failures(corrupted(free, change)) == {"sequence": 4}


def test_a_step_that_failed_ends_a_recording_in_order(tmp_path):
    """The last frame is the state before the step, at the time of that."""
    cube = sp.Body("cube", sp.shapes.box((0.2, 0.2, 0.2), (1, 1, 1)), JELLY)
    scene = sp.Scene([cube], gravity=(0, -1e17, 0))
    path = recorded(tmp_path / "lost.vtkhdf", scene, sp.XPBD(substeps=5))
    assert failures(path) == {"status": 1}
    assert sp.check_recording(path)["status"].where == "not_finite"


def test_a_failed_step_that_goes_back_in_time(free, corrupted):
    def change(file, n):
        file["supple/frames/status"][FRAMES - 1] = list(sp.Status).index(sp.Status.NOT_FINITE)
        file["supple/frames/time"][FRAMES - 1] = 0.0

    assert failures(corrupted(free, change))["sequence"] == FRAMES - 1


@pytest.fixture(scope="module")
def landing(folder):
    """A cube that falls on a floor; only the floor determines when it stops."""
    cube = sp.Body("cube", sp.shapes.box((0.2, 0.2, 0.2), (1, 1, 1)), JELLY, position=(0, 0.105, 0))
    return recorded(folder / "landing.vtkhdf", sp.Scene([cube], [sp.HalfSpace()]), sp.Implicit())


def test_frames_in_another_order(landing, corrupted):
    """Everything in the frames is correct except their times."""

    def change(file, n):
        copies = {k: [data[k * rows : (k + 1) * rows] for data, rows in parts(file, n)] for k in (1, 2)}
        for source, target in ((1, 2), (2, 1)):
            for (data, rows), values in zip(parts(file, n), copies[source], strict=True):
                data[target * rows : (target + 1) * rows] = values

    def parts(file, n):
        kept = [data for data in frame_series(file) if data.name.rpartition("/")[2] not in ("time", "index")]
        m = int(file["VTKHDF/NumberOfCells"][0])
        return [(file[X], n), (file[V], n), (file["VTKHDF/CellData/det_F"], m), *((data, 1) for data in kept)]

    assert failures(landing) == {}
    report = sp.check_recording(corrupted(landing, change))
    assert [(result.name, result.first_failure) for result in report.failures] == [("sequence", 2), ("balance", 1)]
    assert "from where its velocities lead" in report["sequence"].where


def test_a_static_solution_of_a_body_that_begins_with_a_velocity(tmp_path):
    bar = sp.shapes.box((0.3, 0.1, 0.1), (2, 1, 1))
    held = sp.Pin("bar", np.flatnonzero(bar.vertices[:, 0] < -0.1))
    scene = sp.Scene([sp.Body("bar", bar, JELLY, velocity=(1, 0, 0))], pins=[held])
    path = tmp_path / "static.vtkhdf"
    list(sp.simulate(scene, sp.Implicit("static", contact=None), 1 / 60, 2, sinks=[sp.Recorder(path)]))
    assert failures(path) == {}


def test_a_step_that_did_not_converge(free, corrupted):
    def change(file, n):
        file["supple/frames/status"][5] = 1

    report = sp.check_recording(corrupted(free, change))
    assert [(r.name, r.first_failure, r.where) for r in report.failures] == [("status", 5, "iteration_limit")]
