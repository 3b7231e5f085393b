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
from supple.results.page.described import described_motion, described_scene, described_values
from supple.results.page.packed import Packer
from supple.results.recording.frame import RecordedFrame
from supple.results.recording.reader import Recording, opened
from supple.results.view.fields import Field, nodal_values, volume_ratio
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
        played = [taken[i] for i in evenly(len(taken), _most_frames(model, len(source.fields)))]
        drawn = [(frame.time, render_frame_of(model, frame)) for frame in played]

        def more(packer: Packer) -> dict[str, Any]:
            recorded = _recorded_fields(source, list(zip(played, drawn, strict=True)), packer)
            return {"plots": _plots(source, played, packer), "recorded": recorded}

        fresh.write_text(_page(drawn, more), encoding="utf-8")
    return output


def page_of_frames(frames: Sequence[tuple[float, RenderFrame]]) -> str:
    """The HTML of a page that plays frames in a loop: at least one, each with its time on the page [s], ascending."""
    return _page([frames[i] for i in evenly(len(frames), _most_frames(frames[0][1].model))])


def _page(frames: Sequence[tuple[float, RenderFrame]], more: Any = lambda packer: {"plots": [], "recorded": []}) -> str:
    packer, model = Packer(), frames[0][1].model
    names = [body.name for body in model.bodies]
    title = ", ".join(names if len(names) <= 4 else [*names[:3], f"{len(names) - 3} more"])[:80]
    described = {"title": title, **described_scene(model, packer), **described_motion(frames, packer)}
    found = more(packer)
    described["fields"] += found.pop("recorded")
    data = zlib.compress(packer.block({**described, **found}), 9)
    return client(title).replace(DATA, base64.b64encode(data).decode("ascii"), 1)


def _most_frames(model: Model, fields: int = 0) -> int:
    """Number of frames for a page of at most _MOST_BYTES, with so many recorded fields."""
    size = (_BYTES_OF_A_VERTEX + fields) * len(model.rest_positions) + 12 * len(model.stitches)
    return max(2, _MOST_BYTES // size)


def _recorded_fields(
    recording: Recording, frames: list[tuple[RecordedFrame, tuple[float, RenderFrame]]], packer: Packer
) -> list[dict[str, Any]]:
    """What was recorded beside the fields that every page has; of vectors and tensors their sizes, of stretches the
    largest."""
    found = []
    for field in recording.fields:
        if field.name in ("von_mises", "energy_density"):
            continue
        known, at_vertices = [], []
        for frame, (_, drawn) in frames:
            values = frame.field(field.name).values_of_all.reshape(-1, max(1, int(np.prod(field.shape))))
            one = values.max(axis=1) if "stretches" in field.name else np.linalg.norm(values, axis=1)
            one = one if field.shape else values[:, 0]
            known.append(one)
            at_vertices.append(nodal_values(drawn, one) if field.at == "tets" else np.nan_to_num(one))
        shown = Field(field.name, field.name.replace("_", " "), field.unit, None, volume_ratio)
        found.append(described_values(shown, np.concatenate(known), at_vertices, packer))
    return [one for one in found if one]


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
