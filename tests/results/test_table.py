"""The reports of all frames as CSV."""

import csv
import math

import supple as sp
from supple.results.export.exporter import export
from supple.results.recording.reader import read_recording


def expected(recording):
    """The rows from the frames' reports, one by one."""
    for frame in recording:
        report = frame.report
        yield {
            "frame": frame.index,
            "time": frame.time,
            "status": str(report.status),
            "iterations": report.iterations,
            "min_det_F": report.min_det_F,
            "min_distance": report.min_distance,
            "angular_momentum.z": report.angular_momentum[2],
            "dhat": report.details.dhat,
            "contact_forces.cube.y": report.details.contact_forces.get("cube", (None, None))[1],
            "seconds.other": report.details.seconds["other"],
            "message": report.message,
        }


def same(cell, value):
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return cell is None or (isinstance(cell, float) and math.isnan(cell))
    return cell == value


def test_csv_contains_every_digit(recorded, tmp_path):
    path = export(recorded[0], "csv", tmp_path / "r.csv")
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    with read_recording(recorded[0]) as recording:
        wanted = list(expected(recording))
    assert len(rows) == len(wanted)
    for row, values in zip(rows, wanted, strict=True):
        for name, value in values.items():
            cell = row[name]
            read = cell if isinstance(value, str) else None if cell == "" else type(value or 0.0)(cell)
            assert same(read, value), name


def test_a_message_may_contain_anything(tmp_path, tools):
    message = 'a "quoted", text\nof two lines ☃'
    sink = sp.Recorder(tmp_path / "r.vtkhdf")
    list(sp.simulate(tools.small_scene(), tools.Prescribed(message=message), 0.1, 2, sinks=[sink]))
    with export(tmp_path / "r.vtkhdf", "csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["message"] for row in rows] == ["", message, message]
