"""Fields that a recording has in addition: their values, for VTK, in tables, after a resumption; and bad names."""

import csv
import logging
from importlib import import_module

import numpy as np
import pytest

import supple as sp
from supple.app.cli.app import main
from supple.app.cli.console import ExitCode
from supple.results.export.exporter import export
from supple.results.readings.fields import FIELDS
from supple.results.recording.continued import ContinuedRecorder
from supple.results.recording.recorder import frame_layout

RUBBER = sp.StableNeoHookean(youngs=2e4, poisson=0.3)
SOLVER = sp.XPBD(substeps=5)


def scene():
    mesh = sp.shapes.box((0.2, 0.2, 0.2), (2, 2, 2))
    bodies = [
        sp.Body("ball", mesh, RUBBER, position=(0, 0.101, 0)),
        sp.Body("net", mesh, sp.EdgesAndVolume(), position=(1, 0.3, 0)),
    ]
    return sp.Scene(bodies, [sp.HalfSpace(name="floor")])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path = tmp_path_factory.mktemp("fields") / "r.vtkhdf"
    recorder = sp.Recorder(path, fields=list(FIELDS))
    frames = list(sp.simulate(scene(), SOLVER, 1 / 60, 8, sinks=[recorder]))
    return path, frames


def test_every_field_of_every_frame_is_recorded(recorded):
    path, frames = recorded
    assert frames[-1].contact_pressure["ball"].max() > 0.0
    with sp.read_recording(path) as recording:
        assert [field.name for field in recording.fields] == list(FIELDS)
        for frame, read in zip(frames, recording[1:], strict=True):
            for name in FIELDS:
                source = getattr(frame, name.removesuffix("_at_vertices"))
                source = source.at_vertices if name.endswith("_at_vertices") else source
                np.testing.assert_array_equal(read.field(name)["ball"], np.float32(source["ball"]))
            np.testing.assert_array_equal(read.contact_force["ball"], read.field("contact_force")["ball"])
            # Rigid edges have no stress.
            assert np.isnan(read.field("von_mises")["net"]).all()
        assert not recording[0].contact_pressure["ball"].any()


@pytest.mark.parametrize("compressed", [False, True])
def test_vtk_reads_fields(recorded, tmp_path, compressed):
    vtk = pytest.importorskip("vtk")
    to_numpy = import_module("vtk.util.numpy_support").vtk_to_numpy
    path, frames = recorded
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(export(path, "vtkhdf", tmp_path / "small.vtkhdf") if compressed else path))
    for frame in (frames[0], frames[-1]):
        reader.SetStep(frame.index)
        reader.Update()
        cells, points = reader.GetOutput().GetCellData(), reader.GetOutput().GetPointData()
        stress = to_numpy(cells.GetArray("stress"))
        np.testing.assert_array_equal(stress, np.float32(frame.stress.values_of_all.reshape(-1, 9)))
        force = to_numpy(points.GetArray("contact_force"))
        np.testing.assert_array_equal(force, np.float32(frame.contact_force.values_of_all))
        assert to_numpy(points.GetArray("von_mises_at_vertices")).shape == (len(frame.state.positions),)


def test_the_cost_is_said_before_the_run(tmp_path, caplog):
    recorder = sp.Recorder(tmp_path / "r.vtkhdf", fields=["stress", "contact_force"])
    with caplog.at_level(logging.INFO, "supple"):
        frames = sp.simulate(scene(), SOLVER, 1 / 60, 1, sinks=[recorder])
        for _ in frames:
            break
    n, m = 2 * 27, 2 * 48
    size = 4 * (9 * m + 3 * n)
    assert (
        f"stress, contact_force: {size / 1e3:.3g} kB for each frame, {2 * size / 1e3:.3g} kB for 2 frames"
        in caplog.text
    )
    details = frames_details = sp.read_recording(tmp_path / "r.vtkhdf").details
    chosen = [FIELDS["stress"], FIELDS["contact_force"]]
    with_fields = frame_layout(n, m, 1, details, chosen).frame_bytes
    assert with_fields - frame_layout(n, m, 1, frames_details).frame_bytes == size


def test_a_continued_recording_has_the_fields(tmp_path):
    names = ["von_mises", "contact_pressure"]
    whole, parts = tmp_path / "whole.vtkhdf", tmp_path / "parts.vtkhdf"
    list(sp.simulate(scene(), SOLVER, 1 / 60, 5, sinks=[sp.Recorder(whole, fields=names)]))
    *_, middle = sp.simulate(scene(), SOLVER, 1 / 60, 3, sinks=[sp.Recorder(parts, fields=names)])
    list(sp.simulate(middle.system.scene, SOLVER, 1 / 60, 2, start=middle, sinks=[ContinuedRecorder(parts)]))
    with sp.read_recording(whole) as one, sp.read_recording(parts) as other:
        assert len(one) == len(other) == 6
        for a, b in zip(one, other, strict=True):
            for name in names:
                np.testing.assert_array_equal(a.field(name)["ball"], b.field(name)["ball"])


def test_tables_have_the_largest_value_of_each_body(recorded, tmp_path, capfd):
    path, frames = recorded
    assert main(["table", str(path), "-o", str(tmp_path / "t.csv")]) == ExitCode.OK
    assert str(tmp_path / "t.csv") in capfd.readouterr().out
    with (tmp_path / "t.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for frame, row in zip(frames, rows[1:], strict=True):
        assert float(row["von_mises.ball.max"]) == np.float32(frame.von_mises["ball"]).max()
        assert float(row["contact_pressure.ball.max"]) == np.float32(frame.contact_pressure["ball"]).max()
        force = frame.report.details.contact_forces["floor"]
        assert float(row["contact_forces.floor.y"]) == force[1]
    assert rows[1]["von_mises.net.max"] == ""


def test_unknown_and_repeated_fields_are_errors(tmp_path):
    with pytest.raises(sp.OutputError, match=r"field 'von_misses' does not exist; did you mean 'von_mises'\?"):
        sp.Recorder(tmp_path / "r.vtkhdf", fields=["von_misses"])
    with pytest.raises(sp.OutputError, match="'stress' is given twice"):
        sp.Recorder(tmp_path / "r.vtkhdf", fields=["stress", "stress"])
    with pytest.raises(sp.OutputError, match="fields is 'stress'; give a list of names"):
        sp.RunFolder(tmp_path / "out", SOLVER, fields="stress")
    list(sp.simulate(scene(), SOLVER, 1 / 60, 0, sinks=[sp.Recorder(tmp_path / "r.vtkhdf")]))
    with (
        sp.read_recording(tmp_path / "r.vtkhdf") as plain,
        pytest.raises(sp.OutputError, match="contact_force was not recorded; record it with"),
    ):
        plain[0].contact_force  # noqa: B018
    with (
        sp.read_recording(tmp_path / "r.vtkhdf") as plain,
        pytest.raises(sp.OutputError, match=r"field 'stres' does not exist; did you mean 'stress'\?"),
    ):
        plain[0].field("stres")


def test_the_table_of_a_run_that_was_killed(tmp_path, capfd):
    """A file whose writer is gone has all frames that were complete; one that is cut is one line, with exit code 2."""
    path, left, cut = (tmp_path / f"{name}.vtkhdf" for name in ("whole", "left", "cut"))
    frames = sp.simulate(scene(), SOLVER, 1 / 60, 5, sinks=[sp.Recorder(path, fields=["von_mises"])])
    for _ in range(3):
        next(frames)
    left.write_bytes(path.read_bytes())
    cut.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    frames.close()
    assert main(["table", str(left), "-o", str(tmp_path / "t.csv")]) == ExitCode.OK
    with (tmp_path / "t.csv").open(newline="", encoding="utf-8") as file:
        assert all(row["von_mises.ball.max"] for row in csv.DictReader(file))
    for wrong in ([str(cut)], [str(left), "--to", "xml"]):
        capfd.readouterr()
        assert main(["table", *wrong]) == ExitCode.INPUT
        assert capfd.readouterr().err.count("\n") == 1


FILE = """
bodies:
  - name: cube
    shape: {kind: box, divisions: [1, 1, 1]}
    material: {kind: stable_neo_hookean, youngs: 1e5, poisson: 0.3}
solver: {kind: xpbd, substeps: 2}
steps: 1
output: {page: false, plot: false, fields: [von_mises]}
"""


def test_supple_run_records_the_fields_of_the_file_or_of_the_option(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.yaml").write_text(FILE)
    assert main(["run", "scene.yaml", "-o", "a"]) == ExitCode.OK
    assert "von_mises: 24 bytes for each frame, 48 bytes for 2 frames" in capfd.readouterr().out
    assert main(["run", "scene.yaml", "-o", "b", "--fields", "contact_pressure, stress"]) == ExitCode.OK
    assert main(["table", "b"]) == ExitCode.OK
    for folder, names in (("a", ["von_mises"]), ("b", ["contact_pressure", "stress"])):
        with sp.read_recording(tmp_path / folder / "recording.vtkhdf") as recording:
            assert [field.name for field in recording.fields] == names
    assert main(["run", "scene.yaml", "-o", "c", "--fields", "shine"]) == ExitCode.INPUT
    assert "field 'shine' does not exist" in capfd.readouterr().err
    (tmp_path / "bad.yaml").write_text(FILE.replace("von_mises", "shine"))
    assert main(["run", "bad.yaml", "-o", "d"]) == ExitCode.INPUT
    assert "output.fields[0]" in capfd.readouterr().err
