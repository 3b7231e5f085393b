"""The reports of all frames as CSV and Parquet."""

import csv
import math
from importlib import import_module

import numpy as np

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


def test_parquet_contains_the_same(recorded, tmp_path):
    path = export(recorded[0], "parquet")
    table = import_module("arro3.io").read_parquet(path).read_all()
    columns = {name: table.column(name).to_pylist() for name in table.column_names}
    with read_recording(recorded[0]) as recording:
        wanted = list(expected(recording))
    for k, values in enumerate(wanted):
        for name, value in values.items():
            assert same(columns[name][k], value), name
    header = export(recorded[0], "csv", tmp_path / "r.csv").read_text(encoding="utf-8").partition("\n")[0]
    assert header.split(",") == table.column_names


def test_a_message_may_contain_anything(tmp_path, tools):
    message = 'a "quoted", text\nof two lines ☃'
    sink = sp.Recorder(tmp_path / "r.vtkhdf")
    list(sp.simulate(tools.small_scene(), tools.Prescribed(message=message), 0.1, 2, sinks=[sink]))
    with export(tmp_path / "r.vtkhdf", "csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["message"] for row in rows] == ["", message, message]
    table = import_module("arro3.io").read_parquet(export(tmp_path / "r.vtkhdf", "parquet")).read_all()
    assert table.column("message").to_pylist() == ["", message, message]
    assert np.array_equal(table.column("time").to_numpy(), [0.0, 0.1, 0.2])
