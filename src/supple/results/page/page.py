"""Pages that play in a browser: one file that needs no installation and no network.

The player is the client of the live page, which the wheel contains as `page.html`; a page is this file with the frames.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from supple.results.page.client import DATA, client
from supple.results.page.described import described_motion, described_scene
from supple.results.page.packed import Packer
from supple.results.recording.frame import RecordedFrame
from supple.results.recording.reader import Recording, opened
from supple.results.view.from_recording import evenly, model_of_recording, render_frame_of
from supple.results.view.model import Model, RenderFrame
from supple.runtime.replacing import whole_file

# Bytes of moving points and fields before compression, which divides them by three; longer pages have fewer frames.
_MOST_BYTES = 36_000_000
_BYTES_OF_A_VERTEX = 9  # three coordinates in 16 bits, three fields in 8


def write_page(
    recording: Recording | str | Path, output: str | Path, *, frames: Sequence[RecordedFrame] | None = None
) -> Path:
    """Write `output` (such as index.html), which plays the recording in a loop in any browser.

    Parameters
    ----------
    recording : an open recording, or its path; output : the page, replaced where it exists.
    frames : of the recording, at least one, which the page plays; all without this.

    Raises
    ------
    OutputError : where the recording cannot be read, or the page cannot be written.
    """
    output = Path(output)
    with opened(recording) as source, whole_file(output) as fresh:
        model, taken = model_of_recording(source), frames or source
        played = [taken[i] for i in evenly(len(taken), _most_frames(model))]
        drawn = [(frame.time, render_frame_of(model, frame)) for frame in played]
        fresh.write_text(_page(drawn, lambda packer: _plots(source, played, packer)), encoding="utf-8")
    return output


def page_of_frames(frames: Sequence[tuple[float, RenderFrame]]) -> str:
    """The HTML of a page that plays frames in a loop: at least one, each with its time on the page [s], ascending."""
    return _page([frames[i] for i in evenly(len(frames), _most_frames(frames[0][1].model))])


def _page(frames: Sequence[tuple[float, RenderFrame]], plots: Any = lambda packer: []) -> str:
    packer, model = Packer(), frames[0][1].model
    names = [body.name for body in model.bodies]
    title = ", ".join(names if len(names) <= 4 else [*names[:3], f"{len(names) - 3} more"])[:80]
    described = {"title": title, **described_scene(model, packer), **described_motion(frames, packer)}
    data = zlib.compress(packer.block({**described, "plots": plots(packer)}), 9)
    return client(title).replace(DATA, base64.b64encode(data).decode("ascii"), 1)


def _most_frames(model: Model) -> int:
    """Number of frames for a page of at most _MOST_BYTES."""
    size = _BYTES_OF_A_VERTEX * len(model.rest_positions) + 12 * len(model.stitches)
    return max(2, _MOST_BYTES // size)


def _plots(recording: Recording, frames: Sequence[RecordedFrame], packer: Packer) -> list[dict[str, Any]]:
    """What was measured over time: titles with units, and named series."""
    rows = [frame.number for frame in frames]
    energies = {name: recording.series(f"{name}_energy") for name in ("kinetic", "elastic", "potential", "stitch")}
    measured: dict[str, dict[str, Any]] = {
        "energy [J]": {name: values for name, values in energies.items() if np.any(values)},
        "smallest J": {"J": recording.series("min_det_F")},
        "linear momentum [kg m/s]": dict(zip("xyz", recording.series("linear_momentum").T, strict=True)),
        "time of a step [ms]": {"step": 1e3 * recording.series("wall_seconds")},
    }
    for sensor in recording.sensors:
        if sensor.kind != "driven":
            numbers = recording.frame_values(sensor.series_name)
            values = [sensor.reading.of_numbers(row).value for row in numbers]
            measured.setdefault(sensor.reading.quantity, {})[sensor.name] = np.array(values)
    return [
        {"title": title, "series": [{"name": name, "values": packer.add(y[rows], "f4")} for name, y in series.items()]}
        for title, series in measured.items()
    ]
