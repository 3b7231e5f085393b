"""The reports of all frames as a table: CSV, which every program reads, and Parquet, which keeps types and is small."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.results.recording.reader import Recording
from supple.results.recording.report_columns import report_columns
from supple.runtime.replacing import whole_file


def write_csv(recording: Recording, output: Path) -> None:
    """Write one row for each frame, with all digits; a cell is empty where there is no value."""
    columns = report_columns(recording)
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(map(_cell, column.tolist()) for column in columns.values()), strict=True))
    with whole_file(output) as fresh:
        fresh.write_text(text.getvalue(), encoding="utf-8", newline="")


def write_parquet(recording: Recording, output: Path) -> None:
    """Write the same columns in Parquet; NaN where there is no value."""
    from arro3 import io as arro3_io
    from arro3.core import Table

    data = io.BytesIO()
    columns = {name: _arrow(column) for name, column in report_columns(recording).items()}
    arro3_io.write_parquet(Table.from_pydict(columns), data)
    with whole_file(output) as fresh:
        fresh.write_bytes(data.getvalue())


def _cell(value: Any) -> Any:
    return "" if isinstance(value, float) and math.isnan(value) else value


def _arrow(column: NDArray[Any]) -> Any:
    from arro3.core import Array, DataType

    if column.dtype.kind == "U":
        return Array(column.tolist(), type=DataType.string())
    return Array.from_numpy(np.ascontiguousarray(column))
