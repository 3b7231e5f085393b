"""The reports of all frames as a table."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path
from typing import Any

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


def _cell(value: Any) -> Any:
    return "" if isinstance(value, float) and math.isnan(value) else value
