"""Pages that play in a browser: one file that needs no installation and no network.

The player is the client of viser (three.js), which is in the wheel of viser; the page contains the frames, compressed.
"""

from __future__ import annotations

import html
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from supple.results.recording.frame import RecordedFrame
from supple.results.recording.reader import Recording, opened
from supple.results.view.bounds import View
from supple.results.view.from_recording import evenly, model_of_recording, render_frame_of
from supple.results.view.gate import new_token
from supple.results.view.model import Model, RenderFrame
from supple.results.view.options import ViewOptions
from supple.results.view.server import gated_server
from supple.results.view.stage import Stage
from supple.results.view.surfaces import body_surface
from supple.runtime.replacing import whole_file

# Bytes of moving points before compression, which at least halves them; longer pages have fewer frames.
_MOST_BYTES = 36_000_000
_RESOLUTION = 2.0**-13  # to which positions are rounded, as a share of the size of the scene: less than a pixel


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
    output, options = Path(output), ViewOptions()
    with opened(recording) as source, whole_file(output) as fresh:
        model, taken = model_of_recording(source), frames or source
        played = (taken[i] for i in evenly(len(taken), _most_frames(model, options)))
        render_frames = ((frame.time, render_frame_of(model, frame)) for frame in played)
        fresh.write_text(_page(render_frames, options), encoding="utf-8")
    return output


def page_of_frames(render_frames: Sequence[tuple[float, RenderFrame]], options: ViewOptions) -> str:
    """The HTML of a page that plays frames in a loop.

    Parameters
    ----------
    render_frames : at least one, each with its time on the page [s], ascending
    options : how they are drawn
    """
    return _page(
        (render_frames[i] for i in evenly(len(render_frames), _most_frames(render_frames[0][1].model, options))),
        options,
    )


def _page(render_frames: Iterator[tuple[float, RenderFrame]], options: ViewOptions) -> str:
    previous, first = next(render_frames)
    with gated_server(new_token()) as server:  # nobody knows the token
        stage = Stage(server, _rounded(first), options)
        serializer = server.get_scene_serializer()
        for seconds, render_frame in render_frames:
            serializer.insert_sleep(max(0.0, seconds - previous))
            previous = seconds
            stage.show(_rounded(render_frame))
        serializer.insert_sleep(0.1)
        text = serializer.as_html()
    title = html.escape(", ".join(body.name for body in first.model.bodies)[:80])
    return text.replace("<title>Viser</title>", f"<title>{title} · Supple</title>", 1)


def _most_frames(model: Model, options: ViewOptions) -> int:
    """Number of frames for a page of at most _MOST_BYTES."""
    points = sum(len(body_surface(model, body).creased(model).at_rest(model)) for body in model.bodies)
    size = 12 * (points if options.surface in ("skin", "wireframe") else 24 * len(model.tets))
    return max(2, _MOST_BYTES // max(1, size + 24 * len(model.stitches)))


def quantum_of(view: View) -> float:
    """The power of two to which positions are rounded: numbers with few bits compress well."""
    return float(2.0 ** np.floor(np.log2(_RESOLUTION * 2.0 * view.radius)))


def _rounded(render_frame: RenderFrame) -> RenderFrame:
    quantum = quantum_of(render_frame.model.view)
    return replace(render_frame, positions=np.round(render_frame.finite_positions / quantum) * quantum)
