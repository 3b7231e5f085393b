"""Every planted fault is found in every format, and no series without a fault fails."""

import json

import numpy as np
import pytest
from PIL import Image

import supple as sp
from supple.app.cli.app import main
from supple.results.check.checker import check_series
from supple.results.check.geometry.moving_triangles import triangles_pass
from supple.results.check.series import SeriesMetadata

from .generated import FAULTS, SURFACES, WRITERS, clean

NAMES = list(FAULTS)


def can_hold(kind, fault):
    return not (kind in SURFACES and fault == "inversion")


@pytest.mark.parametrize("kind", WRITERS)
def test_a_series_passes_and_the_same_with_a_fault_fails(tmp_path, kind):
    seed = list(WRITERS).index(kind)
    frames = clean(seed)
    good, bad = tmp_path / "good", tmp_path / "bad"
    good.mkdir()
    bad.mkdir()
    report = check_series(WRITERS[kind](frames, good))
    assert report.ok, report
    assert (report["inversion"].verdict == "skipped") == (kind in SURFACES)
    fault = next(name for name in NAMES[seed % len(NAMES) :] + NAMES if can_hold(kind, name))
    report = check_series(WRITERS[kind](FAULTS[fault](frames), bad))
    assert report[fault].verdict == "fail", report


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10, 13))
def test_two_hundred_series(tmp_path, seed):
    """For each seed, in each of eleven formats: one without a fault, one with a fault of each kind; 255 in all."""
    for kind, write in WRITERS.items():
        for fault in (None, *NAMES):
            if fault is not None and not can_hold(kind, fault):
                continue
            folder = tmp_path / f"{kind}_{fault}"
            folder.mkdir()
            frames = clean(seed)
            report = check_series(write(frames if fault is None else FAULTS[fault](frames), folder))
            if fault is None:
                assert report.ok, (kind, report)
            else:
                assert report[fault].verdict == "fail", (kind, fault, report)


def test_the_shell_checks_files_of_other_programs(tmp_path, capsys):
    frames = clean(3)
    WRITERS["obj"](FAULTS["volume"](frames), tmp_path)
    paths = sorted(map(str, tmp_path.glob("*.obj")))
    assert main(["check", *paths, "--json", str(tmp_path / "report.json")]) == 1
    out = capsys.readouterr().out
    assert "FAILED: volume" in out
    assert "skipped  inversion: the files have no tets" in out
    assert json.loads((tmp_path / "report.json").read_text())["ok"] is False
    assert main(["check", str(tmp_path), "--max-volume-change", "0.02", "-q"]) == 0


def test_a_failure_has_a_picture(tmp_path):
    frames = FAULTS["intersection"](clean(4))
    path = WRITERS["npz"](frames, tmp_path)
    picture = tmp_path / "out.png"
    assert main(["check", str(path), "-q", "--picture", str(picture)]) == 1
    image = np.asarray(Image.open(picture).convert("RGB")).astype(int)
    # What meets is red.
    assert ((image[..., 0] > 120) & (image[..., 1:].max(axis=-1) < 60)).sum() > 500


def test_sides_that_are_parallel_for_a_moment_do_not_pass():
    """Mirror images of each other, so that both turn through being parallel at the same time as their planes meet."""
    left0 = np.array([[-0.1, 1.0, 0.0], [-0.01, 1.0, 0.01], [-0.05, 1.2, 0.0]])
    left1 = np.array([[-0.1, 1.0, 0.0], [-0.01, 1.0, -0.01], [-0.05, 1.2, 0.0]])
    x0, x1 = (np.concatenate([left, left * [-1, 1, 1]]) for left in (left0, left1))
    assert not triangles_pass(x0, x1, np.array([0, 1, 2]), np.array([3, 4, 5]))


def test_momentum_and_energy_of_a_free_fall(tmp_path):
    """A box in free fall keeps its energy; with a velocity that grows by itself, energy and momentum do not hold."""
    box = clean(1)
    n = int(box.tets[len(box.tets) // 2 - 1].max()) + 1
    tets, x = box.tets[: len(box.tets) // 2], box.positions[0, :n]
    times = np.arange(20) / 100.0
    fall = x + 0.5 * times[:, None, None] ** 2 * np.array([0.0, 0.0, -9.81])
    given = {"density": 1e3, "youngs": 1e5, "poisson": 0.4, "gravity": (0.0, 0.0, -9.81), "free": True}
    for factor, verdict in ((1.0, "pass"), (1.5, "fail")):
        np.savez(tmp_path / "fall.npz", positions=x + factor * (fall - x), tets=tets, times=times)
        report = check_series(tmp_path / "fall.npz", SeriesMetadata(**given))
        assert [report[name].verdict for name in ("momentum", "energy")] == [verdict] * 2, report


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.npz", b"no archive", "cannot be read as .npz"),
        ("a.npz", b"", "it is empty"),
        ("a.pvd", b"<VTKFile>", "it is not a .pvd file"),
        ("a.pvd", b'<VTKFile><DataSet timestep="0" file="../../etc/passwd"/></VTKFile>', "outside of its folder"),
        ("a.vtu.series", b"[[[[", "not a list of a series"),
        ("a.glb", b"glTF" + bytes(40), "it is damaged"),
        ("a.glb", b"glTX", "does not begin as a GLB file"),
        ("a.usda", b"#usda 1.0\n(subLayers = [@/etc/passwd@])", "it refers to other files"),
        ("a.usda", b"#usda 1.0\ndef Mesh {", "OpenUSD cannot read it"),
        ("a.hdf", b"\x89HDF\r\n\x1a\n" + bytes(100), "it is damaged"),
        ("f_1.obj", b"v 0 0 0", "it is one mesh"),
        ("a.stuff", b"1", "nothing to check"),
    ],
)
def test_malformed_files_are_one_line(tmp_path, capsys, name, data, message):
    (tmp_path / name).write_bytes(data)
    assert main(["check", str(tmp_path / name)]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert message in err


def test_what_passes_between_frames(tmp_path):
    """A box that jumps through one with the same grid, points on points; one that turns beside a wall does not."""
    box, thin = sp.shapes.box((1, 1, 1), (2, 2, 2)), sp.shapes.box((1, 0.2, 1), (2, 1, 2))
    x, wall = np.array(box.vertices), np.array(thin.vertices)
    tets = np.concatenate([box.tets, thin.tets + len(x)])
    jump = np.stack([np.concatenate([x + np.array([0, y, 0]), wall]) for y in (1.0, 1.0, -1.0, -1.0)])
    angles = np.arange(8) * 0.1 - 0.35
    arcs = []
    for angle in angles:
        turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        arcs.append(np.concatenate([x @ turn.T, wall - np.array([0, 0.81, 0])]))
    for frames, verdict in ((jump, "fail"), (np.stack(arcs), "pass")):
        np.savez(tmp_path / "a.npz", positions=frames, tets=tets)
        report = check_series(tmp_path / "a.npz", only=["intersection", "tunnelling"])
        assert report["intersection"].verdict == "pass"
        assert report["tunnelling"].verdict == verdict, report
