"""`check_recording` on good recordings, and on copies of them that were spoilt on purpose."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

import supple as sp
from supple.cli.app import main
from supple.errors import OutputError
from supple.output import check as check_package
from supple.output.check.settings import NAMES
from supple.output.recording import REPORT_NUMBERS, REPORT_VECTORS

FRAMES = 7
X, V = "VTKHDF/Points", "VTKHDF/PointData/velocities"
JELLY = sp.StableNeoHookean(youngs=1e4, poisson=0.45, density=1000.0)


def octahedron(center, radius):
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]) * radius + center
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    return sp.SurfaceMesh(vertices, faces)


def recorded(path, scene, solver, **options):
    for _ in sp.simulate(scene, solver, 1 / 60, FRAMES - 1, sinks=[sp.Recorder(path, solver=solver)], **options):
        pass
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("checked")


@pytest.fixture(scope="module")
def free(folder):
    """Two blocks that fall past each other without touching; one spins, one wobbles."""
    block = sp.shapes.box((1.0, 0.5, 0.5), (2, 2, 2))
    bodies = [
        sp.Body("left", block, JELLY, angular_velocity=(1, 0, 0)),
        sp.Body("right", block, JELLY, position=(1.5, 0, 0)),
    ]
    start = {"right": block.vertices * [0.9, 1.0, 1.0] + [1.5, 0, 0]}
    return recorded(folder / "free.vtkhdf", sp.Scene(bodies), sp.XPBD(substeps=5), initial_positions=start)


@pytest.fixture(scope="module")
def around(folder):
    """A cube in a room, over a floor, with every kind of obstacle near it, two of them moving."""
    away = sp.Keyframes(times=[0.0, 1.0], displacements=[[0, 0, 0], [-0.5, 0, 0]])
    obstacles = [
        sp.HalfSpace(name="floor"),
        sp.HalfSpace(name="slope", point=(3, 0, 0), normal=(-1, 1, 0.3)),
        sp.HalfSpace(name="door", point=(-2, 0, 0), normal=(1, 0, 0), motion=away),
        sp.Box(name="room", center=(0, 0, 5), size=(20, 20, 20), rotation=(0.1, 0.2, 0.3), inside=True),
        sp.Sphere(name="bowl", radius=9, inside=True),
        sp.Sphere(name="ball", center=(0, 1, 2), radius=0.4),
        sp.Box(name="crate", center=(0, 1, -2), size=(0.5, 0.5, 0.5), rotation=(0, 0.4, 0), motion=away),
        sp.TriangleObstacle(name="rock", surface=octahedron((0.3, 3.0, 0.2), 0.4)),
    ]
    scene = sp.Scene([sp.Body("cube", sp.shapes.box((1, 1, 1), (2, 2, 2)), JELLY, position=(0, 1, 0))], obstacles)
    return recorded(folder / "around.vtkhdf", scene, sp.XPBD(substeps=5))


@pytest.fixture
def spoilt(tmp_path):
    """spoilt(path, change): a copy, changed by change(file, n), n being the number of vertices."""

    def spoil(path, change):
        copy = tmp_path / "spoilt.vtkhdf"
        shutil.copy(path, copy)
        with h5py.File(copy, "r+") as file:
            change(file, len(file["supple/rest_positions"]))
        return copy

    return spoil


def failures(path, **settings):
    """Which checks fail, and in which frame first."""
    report = sp.check_recording(path, sp.CheckSettings(**settings))
    assert report.ok == (not report.failures)
    return {result.name: result.first_failure for result in report.failures}


def verdicts(path, **settings):
    return {
        result.name: str(result.verdict) for result in sp.check_recording(path, sp.CheckSettings(**settings)).results
    }


def set_header(file, change):
    header = json.loads(file["supple/header"][()])
    change(header)
    del file["supple/header"]
    file["supple/header"] = json.dumps(header)


def test_a_good_recording_passes_everything_that_can_be_checked(free, around):
    assert verdicts(free) == {name: "skipped" if name == "obstacles" else "pass" for name in NAMES}
    why_not = {"momentum": "skipped", "spin": "skipped", "energy": "skipped"}
    assert verdicts(around) == {name: why_not.get(name, "pass") for name in NAMES}
    report = sp.check_recording(around)
    assert (report.frames, report.frames_checked) == (FRAMES, FRAMES)
    assert report["energy"].said == "obstacles move, which does work"
    assert (report["intersection"].worst, report["intersection"].frame) == (0.0, None)
    # The cube falls a few centimetres; the ball is nearest to it at the start, or the floor later.
    assert 0.0 < report["distance"].worst < 1.0
    assert report["inversion"].worst == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("integrator", ["backward_euler", "bdf2", "newmark"])
def test_implicit_recordings_pass(tmp_path, integrator):
    block = sp.shapes.box((1.0, 0.5, 0.5), (2, 1, 1))
    solver = sp.Implicit(integrator=integrator)
    scene = sp.Scene([sp.Body("block", block, JELLY, angular_velocity=(0, 3, 1))])
    path = recorded(tmp_path / "r.vtkhdf", scene, solver, initial_positions={"block": block.vertices * [0.9, 1.05, 1]})
    found = verdicts(path, skip=["obstacles"])
    assert set(found.values()) == {"pass"}


def test_bodies_of_edges_and_volumes_pass(tmp_path):
    scene = sp.Scene(
        [
            sp.Body(
                "net",
                sp.shapes.box((1, 1, 1), (2, 2, 2)),
                sp.EdgesAndVolume(edge_compliance=1e-4, volume_compliance=1e-6),
            )
        ]
    )
    start = {"net": scene.bodies[0].mesh.vertices * [0.9, 1, 1]}
    path = recorded(tmp_path / "r.vtkhdf", scene, sp.XPBD(substeps=5), initial_positions=start)
    assert failures(path) == {}
    assert sp.check_recording(path)["records"].worst < 1e-12


def nan_position(file, n):
    file[X][3 * n + 4, 1] = np.nan


def nan_velocity(file, n):
    file[V][2 * n] = np.inf


def nan_report(file, n):
    file["supple/frames/kinetic_energy"][5] = np.nan


def nan_determinant(file, n):
    file["VTKHDF/CellData/det_F"][len(file["supple/tets"])] = np.nan


def nan_mass(file, n):
    file["supple/masses"][0] = np.nan


@pytest.mark.parametrize(
    ("change", "frame"),
    [(nan_position, 3), (nan_velocity, 2), (nan_report, 5), (nan_determinant, 1)],
)
def test_one_number_that_is_none(free, spoilt, change, frame):
    path = spoilt(free, change)
    assert failures(path) == {"finite": frame}
    assert sp.check_recording(path)["finite"].failed_frames == 1


def test_a_mass_that_is_no_number(free, spoilt):
    report = sp.check_recording(spoilt(free, nan_mass))
    assert report["finite"].verdict == "fail"
    assert report["finite"].where == "masses"
    assert {result.verdict for result in report.results if result.name != "finite"} == {"skipped"}


def test_no_frame_that_can_be_computed_with(free, spoilt):
    def change(file, n):
        file[X][:] = np.nan

    report = sp.check_recording(spoilt(free, change))
    assert [(result.name, result.first_failure) for result in report.failures] == [("finite", 0)]
    assert {result.name for result in report.results if result.verdict == "pass"} == {
        "sequence",
        "status",
        "rest shape",
    }


def test_names_say_where(free, spoilt):
    report = sp.check_recording(spoilt(free, nan_position))
    assert report["finite"].said == "not finite: 1 number (position of vertex 4 of left); in 1 frame, first 3"
    assert (report["finite"].frame, report["finite"].time) == (3, pytest.approx(3 / 60))


@pytest.mark.parametrize("distance", [1e-5, 1e-7])
def test_one_vertex_moved(free, spoilt, distance):
    def change(file, n):
        file[X][4 * n + 7, 2] += distance

    path = spoilt(free, change)
    assert failures(path) == {"records": 4}
    assert "det F" in sp.check_recording(path)["records"].where


def flip(file, n, share):
    """Move a vertex of tet 11 through its opposite face: share 2 mirrors it, 1 puts it into the face's plane."""
    tet = file["supple/tets"][11]
    x = file[X][3 * n : 4 * n]
    a, b, c, d = x[tet]
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    x[tet[3]] = d - share * ((d - a) @ normal) * normal
    file[X][3 * n : 4 * n] = x
    return tet


def test_one_tet_flipped(free, spoilt):
    path = spoilt(free, lambda file, n: flip(file, n, 2.0))
    report = sp.check_recording(path)
    assert report["inversion"].verdict == "fail"
    assert (report["inversion"].first_failure, report["inversion"].failed_frames) == (3, 1)
    assert report["inversion"].worst < -0.5
    assert report["inversion"].where.endswith("of left")
    assert failures(path)["records"] == 3


def test_one_tet_exactly_flat(free, spoilt):
    def change(file, n):
        a, b, c, d = file["supple/tets"][11]
        file[X][3 * n + d] = 0.5 * file[X][3 * n + a] + 0.5 * file[X][3 * n + b]
        file[X][3 * n + c] = file[X][3 * n + c]

    assert failures(spoilt(free, change), only=["inversion"]) == {"inversion": 3}


def test_a_tet_inverted_at_rest(free, spoilt):
    def change(file, n):
        tet = file["supple/tets"][5]
        file["supple/tets"][5] = tet[[1, 0, 2, 3]]

    report = sp.check_recording(spoilt(free, change))
    assert report["rest shape"].verdict == "fail"
    assert "tet 5 of left" in report["rest shape"].said
    assert report["rest shape"].frame is None
    assert failures(report.path, only=["inversion"]) == {"inversion": 0}


def frame_series(file):
    names = ["time", "index", "status", "iterations", *REPORT_NUMBERS, *REPORT_VECTORS]
    return [file[f"supple/frames/{name}"] for name in names]


def repeat(file, n, source, target, *, but=()):
    m = len(file["supple/tets"])
    for data, rows in ((file[X], n), (file[V], n), (file["VTKHDF/CellData/det_F"], m)):
        data[target * rows : (target + 1) * rows] = data[source * rows : (source + 1) * rows]
    for data in frame_series(file):
        if data.name.rpartition("/")[2] not in but:
            data[target] = data[source]


def test_a_frame_twice(free, spoilt):
    found = failures(spoilt(free, lambda file, n: repeat(file, n, 3, 4)))
    assert found == {"sequence": 4}
    report = sp.check_recording(spoilt(free, lambda file, n: repeat(file, n, 3, 4, but=("time", "index"))))
    assert report["sequence"].where == "repeats frame 3 although it moves"
    assert {result.name: result.first_failure for result in report.failures} == {"sequence": 4, "momentum": 4}


def test_a_frame_left_out(free, spoilt):
    def change(file, n):
        file["supple/frames/index"][4:] = file["supple/frames/index"][4:] + 1

    assert failures(spoilt(free, change)) == {"sequence": 4}


def test_a_step_that_did_not_converge(free, spoilt):
    def change(file, n):
        file["supple/frames/status"][5] = 1

    report = sp.check_recording(spoilt(free, change))
    assert [(r.name, r.first_failure, r.where) for r in report.failures] == [("status", 5, "iteration_limit")]


def apart(file, n, frame, gap):
    """Shift the right block until its lowest x is `gap` away from the left block's highest."""
    x = file[X][frame * n : (frame + 1) * n]
    half = n // 2
    x[half:, 0] += x[:half, 0].max() + gap - x[half:, 0].min()
    # Straight faces: the block's own shape decides nothing here.
    x[:half] = file["supple/rest_positions"][:half]
    x[half:] = file["supple/rest_positions"][half:] + np.array([1.0 + gap, 0.0, 0.0])
    file[X][frame * n : (frame + 1) * n] = x


CONTACT = ["intersection", "containment", "distance"]


@pytest.mark.parametrize("gap", [1e-9, -1e-9, 0.0])
def test_a_surface_pushed_through_another(free, spoilt, gap):
    path = spoilt(free, lambda file, n: apart(file, n, 2, gap))
    if gap > 0.0:
        assert failures(path, only=CONTACT) == {}
        report = sp.check_recording(path)
        assert report["distance"].worst == pytest.approx(gap, rel=1e-6)
        assert report["distance"].frame == 2
    else:
        assert failures(path, only=CONTACT) == {"intersection": 2, "distance": 2}
        assert "of left and triangle" in sp.check_recording(path)["intersection"].where


def test_a_body_that_meets_itself(free, spoilt):
    def change(file, n):
        # The left block's end is pulled through its middle.
        x = file[X][n : 2 * n]
        rest = file["supple/rest_positions"][: n // 2]
        end = rest[:, 0] == rest[:, 0].max()
        x[: n // 2][end] -= [1.0, 0.1, 0.1]
        file[X][n : 2 * n] = x

    assert failures(spoilt(free, change), only=["intersection"]) == {"intersection": 1}


def test_a_body_swallowed_whole(free, spoilt):
    def change(file, n):
        x = file[X][2 * n : 3 * n]
        left, right = x[: n // 2], x[n // 2 :]
        x[n // 2 :] = (right - right.mean(axis=0)) * 0.3 + left.mean(axis=0)
        file[X][2 * n : 3 * n] = x

    report = sp.check_recording(spoilt(free, change), sp.CheckSettings(only=CONTACT))
    assert [(result.name, result.first_failure) for result in report.failures] == [("containment", 2)]
    assert report["containment"].where == "right in left"


def test_pairs_that_the_scene_lets_pass_are_left_out(free, spoilt):
    def overlap(file, n):
        apart(file, n, 2, -0.1)
        set_header(file, lambda header: header["physics"].update(untouching=[[1, 0]]))

    assert failures(spoilt(free, overlap), only=CONTACT) == {}


def test_vertices_that_may_touch_a_triangle_are_left_out(free, spoilt):
    def touch(file, n, exempt):
        """One vertex of the right block on the middle of a triangle of the left one."""
        triangles = file["supple/triangles"][:]
        half = len(triangles) // 2
        x = file[X][2 * n : 3 * n]
        rest = file["supple/rest_positions"][: n // 2]
        facing = [t for t in range(half) if (rest[triangles[t], 0] == rest[:, 0].max()).all()]
        vertex = int(triangles[half:].min()) + int(np.argmin(file["supple/rest_positions"][n // 2 :, 0]))
        x[vertex] = x[triangles[facing[0]]].mean(axis=0) - [1e-6, 0, 0]
        file[X][2 * n : 3 * n] = x
        if exempt:
            del file["supple/physics/stitched"]
            file["supple/physics/stitched"] = np.array([[vertex, *triangles[facing[0]]]])

    assert failures(spoilt(free, lambda file, n: touch(file, n, False)), only=["intersection"]) == {"intersection": 2}
    assert failures(spoilt(free, lambda file, n: touch(file, n, True)), only=["intersection"]) == {}


def move_to(lowest, frame=3):
    """Put the cube's corner of lowest coordinates somewhere."""

    def change(file, n):
        x = file[X][frame * n : (frame + 1) * n]
        file[X][frame * n : (frame + 1) * n] = x - x.min(axis=0) + np.asarray(lowest)

    return change


BY_FORMULA = {
    "floor": [-0.5, -1e-12, -0.5],
    "slope": [2.6, 0.5, 0.0],
    "door": [-2.1, 1.0, 0.0],
    "room": [0.0, 1.0, -6.5],
    "bowl": [0.0, 8.1, 0.0],
    "ball": [-0.5, 0.5, 1.65],
}


@pytest.mark.parametrize("name", BY_FORMULA)
def test_a_body_in_an_obstacle_that_is_a_formula(around, spoilt, name):
    report = sp.check_recording(spoilt(around, move_to(BY_FORMULA[name])), sp.CheckSettings(only=["obstacles"]))
    found = report["obstacles"]
    assert (found.verdict, found.first_failure, found.failed_frames) == ("fail", 3, 1)
    assert name in found.where
    assert found.worst < 0.0


def test_just_over_the_floor_and_just_past_the_moving_door_is_fine(around, spoilt):
    assert failures(spoilt(around, move_to([-0.5, 1e-12, -0.5])), only=["obstacles", "distance"]) == {}
    door = -2.0 - 0.5 * 3 / 60
    assert failures(spoilt(around, move_to([door + 1e-9, 1.0, 0.0])), only=["obstacles"]) == {}
    assert failures(spoilt(around, move_to([door - 1e-9, 1.0, 0.0])), only=["obstacles"]) == {"obstacles": 3}


@pytest.mark.parametrize(("lowest", "name"), [([-0.2, 0.9, -2.3], "crate"), ([0.3, 2.0, 0.2], "rock")])
def test_a_body_that_meets_an_obstacle_made_of_triangles(around, spoilt, lowest, name):
    report = sp.check_recording(spoilt(around, move_to(lowest)), sp.CheckSettings(only=["intersection"]))
    assert report["intersection"].first_failure == 3
    assert f"obstacle {name}" in report["intersection"].where


@pytest.mark.parametrize(
    ("lowest", "size", "where"),
    [
        ([-0.1, 0.95, -2.05], 0.1, "cube in crate"),
        ([0.25, 2.95, 0.15], 0.1, "cube in rock"),
        ([-0.5, 2.0, -0.5], 4.0, "rock in cube"),
        ([-2.0, 0.0, 0.5], 4.0, "ball in cube"),
    ],
)
def test_what_swallows_or_is_swallowed_by_an_obstacle(around, spoilt, lowest, size, where):
    def change(file, n):
        x = file["supple/rest_positions"][:]
        x = (x - x.min(axis=0)) * size + np.asarray(lowest)
        file[X][5 * n : 6 * n] = x

    report = sp.check_recording(spoilt(around, change), sp.CheckSettings(only=["containment"]))
    assert report["containment"].first_failure == 5
    assert report["containment"].where == where


def consistently(file, n, frame, velocities):
    """Replace the velocities of a frame, and what was measured on them."""
    m, x = file["supple/masses"][:], file[X][frame * n : (frame + 1) * n]
    file[V][frame * n : (frame + 1) * n] = velocities
    P, center = m @ velocities, m @ x / m.sum()
    file["supple/frames/kinetic_energy"][frame] = 0.5 * m @ (velocities**2).sum(axis=1)
    file["supple/frames/linear_momentum"][frame] = P
    file["supple/frames/angular_momentum"][frame] = m @ np.cross(x - center, velocities - P / m.sum())


def test_momentum_out_of_nowhere(free, spoilt):
    def push(file, n):
        consistently(file, n, 6, file[V][6 * n : 7 * n] + np.array([1e-4, 0, 0]))

    assert failures(spoilt(free, push)) == {"momentum": 6}


def test_spin_out_of_nowhere(free, spoilt):
    def turn(file, n):
        x, v = file[X][6 * n : 7 * n], file[V][6 * n : 7 * n]
        m = file["supple/masses"][:]
        consistently(file, n, 6, v + np.cross([0, 1e-3, 0], x - m @ x / m.sum()))

    assert failures(spoilt(free, turn)) == {"spin": 6}


def test_energy_out_of_nowhere(free, spoilt):
    def stir(file, n):
        rng = np.random.default_rng(2)
        consistently(file, n, 4, file[V][4 * n : 5 * n] + rng.normal(scale=2.0, size=(n, 3)))

    assert failures(spoilt(free, stir), only=["energy", "records"]) == {"energy": 4}
    assert failures(spoilt(free, stir), only=["energy"], max_energy_gain=1e3) == {}


def test_a_velocity_that_was_not_measured(free, spoilt):
    def change(file, n):
        file[V][5 * n + 3, 0] += 1e-6

    assert failures(spoilt(free, change), only=["records"]) == {"records": 5}


@pytest.mark.parametrize("name", ["kinetic_energy", "elastic_energy", "potential_energy", "min_det_F"])
def test_a_measure_that_was_changed(free, spoilt, name):
    def change(file, n):
        file[f"supple/frames/{name}"][2] *= 1.0 + 1e-5

    assert failures(spoilt(free, change)) == {"records": 2}


def test_volume(free, spoilt):
    def squeeze(file, n):
        file[X][4 * n : 5 * n] = file[X][4 * n : 5 * n] * [1.0, 0.4, 1.0]

    assert failures(free, max_volume_change=1e-3) == {"volume": 0}
    assert sp.check_recording(free)["volume"].worst == pytest.approx(0.1, rel=1e-6)
    assert failures(spoilt(free, squeeze), only=["volume"]) == {"volume": 4}
    assert failures(spoilt(free, squeeze), only=["volume"], max_volume_change=0.7) == {}


def test_a_recording_without_physics_is_read_and_says_what_is_not_known(free, spoilt):
    def age(file, n):
        set_header(file, lambda header: header.pop("physics"))
        del file["supple/physics"]

    report = sp.check_recording(spoilt(free, age))
    assert report.ok
    skipped = {result.name for result in report.results if result.verdict == "skipped"}
    assert skipped == {"obstacles", "momentum", "spin", "energy"}
    assert "older version" in report["energy"].said


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda header: header["physics"].update(untouching=[[0, 7]]), "not there"),
        (lambda header: header["physics"].update(untouching=3), "not described"),
        (lambda header: header["physics"].pop("laws"), "not described"),
        (lambda header: header["physics"].update(compliances=[]), "another number of bodies"),
    ],
)
def test_physics_that_contradict_themselves(free, spoilt, change, says):
    with pytest.raises(OutputError, match=says):
        sp.check_recording(spoilt(free, lambda file, n: set_header(file, change)))


def test_every_kth_frame_and_the_last(free, spoilt):
    path = spoilt(free, nan_position)
    report = sp.check_recording(path, sp.CheckSettings(every=4))
    assert (report.frames, report.frames_checked, report.ok) == (FRAMES, 3, True)
    assert failures(path, every=3) == {"finite": 3}
    seen = []
    sp.check_recording(path, sp.CheckSettings(every=4, only=["finite"]), progress=lambda *done: seen.append(done))
    assert seen == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"only": ["inversions"]}, "no check 'inversions'"),
        ({"skip": list(NAMES)}, "nothing is left"),
        ({"every": 0}, "every is 0"),
        ({"max_energy_gain": -1.0}, "max_energy_gain is -1"),
    ],
)
def test_settings_that_make_no_sense(settings, says):
    with pytest.raises(OutputError, match=says):
        sp.CheckSettings(**settings)


def test_the_shell(free, spoilt, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    assert main(["check", str(free), "--json", str(tmp_path / "out" / "r.json")]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in NAMES)
    said = json.loads((tmp_path / "out" / "r.json").read_text())
    assert said["ok"] is True
    assert [result["name"] for result in said["results"]] == list(NAMES)
    path = str(spoilt(free, nan_position))
    assert main(["check", path]) == 1
    assert "fail" in capsys.readouterr().out
    assert main(["check", path, "--skip", "finite"]) == 0
    assert main(["check", path, "--only", "finite", "--only", "status", "--quiet"]) == 1
    out = capsys.readouterr().out
    assert "status" not in out.split("verdict")[-1]
    assert main(["check", str(free), "-q"]) == 0
    assert capsys.readouterr() == ("", "")


def test_files_that_cannot_be_checked(free, tmp_path, capsys):
    short = tmp_path / "short.vtkhdf"
    short.write_bytes(free.read_bytes()[:20_000])
    other = tmp_path / "other.vtkhdf"
    other.write_text("no HDF5")
    for arguments in (
        [str(short)],
        [str(other)],
        [str(tmp_path / "none.vtkhdf")],
        [str(free), "--only", "nonsense"],
        [str(free), "--every", "1.5"],
    ):
        assert main(["check", *arguments]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert err.startswith("supple: ")
        assert err.count("\n") == 1


def test_the_checker_shares_no_code_with_the_solvers():
    code = (
        "import sys, supple.output.check.checker\n"
        "print([n for n in sys.modules if n.startswith(('supple.implicit', 'supple.xpbd', 'supple.numerics.cubic',"
        " 'supple.mesh.surface_checks', 'ipctk'))])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=100)
    assert done.stdout.strip() == "[]", done
    mine = Path(check_package.__file__).parent
    known = re.compile(r"supple\.(output|errors|state|materials|numerics\.threads)\b")
    for path in mine.glob("*.py"):
        for name in re.findall(r"^\s*(?:from|import) (supple[\w.]*)", path.read_text(encoding="utf-8"), flags=re.M):
            assert known.match(name), f"{path.name} imports {name}"


def test_contact_that_never_intersects_passes(tmp_path):
    cube = sp.shapes.box((1, 1, 1), (1, 1, 1))
    scene = sp.Scene(
        [
            sp.Body("left", cube, JELLY, friction=0.3),
            sp.Body("right", cube, JELLY, position=(1.05, 0.1, 0.2), velocity=(-4, 0, 0), friction=0.3),
        ]
    )
    report = sp.check_recording(recorded(tmp_path / "r.vtkhdf", scene, sp.Implicit()))
    assert {result.verdict for result in report.results if result.name != "obstacles"} == {"pass"}
    # They did touch.
    assert 0.0 < report["distance"].worst < 5e-3
    assert report["distance"].frame > 0


def test_what_the_scene_lets_touch_is_recorded(tmp_path):
    cube = sp.shapes.box((1, 1, 1), (1, 1, 1))
    rock = octahedron((0.5, 0.5, 2.5), 1.0)
    scene = sp.Scene(
        [
            sp.Body("a", cube, JELLY),
            sp.Body("b", cube, JELLY, position=(0.9, 0, 0)),
            sp.Body("c", cube, JELLY, position=(0, 3, 0)),
        ],
        [sp.HalfSpace(name="floor", point=(0, -1, 0)), sp.TriangleObstacle(name="rock", surface=rock)],
        contact_pairs=[sp.ContactPair("a", "b", collide=False), sp.ContactPair("c", "*", collide=False)],
        stitches=[
            sp.SoftVertexTriangleStitch("c", "a", pairs=[(0, 3)], youngs=1e3, poisson=0.3),
            sp.VertexVertexStitch("b", "rock", pairs=[(1, 4)], stiffness=10.0),
        ],
        gravity=(0, 0, 0),
    )
    path = tmp_path / "r.vtkhdf"
    with sp.read_recording(recorded(path, scene, sp.XPBD(substeps=2))) as recording:
        said = recording.untouching
        n = len(recording.rest_positions)
        assert {(0, 1), (0, 2), (1, 2), (2, 2)} <= set(said.pairs)
        assert not {(0, 0), (1, 1), (0, 3), (3, 4)} & set(said.pairs)
        a = scene.bodies[0].mesh.surface.triangles[3]
        assert [row.tolist() for row in np.sort(said.stitched)] == [[*sorted(a), 2 * n // 3], [n // 3 + 1, n, n, n]]
        assert said.stitched[:, 0].tolist() == [2 * n // 3, n // 3 + 1]
        np.testing.assert_array_equal(said.anchors, [[1, 4]])
        assert recording.physics.stitches == 2
    # a and b overlap, and may.
    assert failures(path, only=CONTACT) == {}
