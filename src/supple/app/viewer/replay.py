"""The page of a recording: a time slider, and the same views as for a live simulation."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from typing import Any

import numpy as np

from supple.app.viewer.controls.view.cameras import NOTHING
from supple.app.viewer.controls.view.overlay import Overlay
from supple.app.viewer.controls.view.record_controls import RecordControls
from supple.app.viewer.controls.view.view_controls import ViewControls, add_keys
from supple.app.viewer.frame_rate import FrameRate
from supple.results.recording.reader import Recording
from supple.results.view.from_recording import model_of_recording, moment_of_frame
from supple.results.view.model import Moment
from supple.results.view.options import ViewOptions
from supple.results.view.page import page_of_frames
from supple.results.view.stage import Stage

_SLOWEST, _FASTEST = 0.05, 4.0
_KEPT = 64  # frames
_RESTS = 0.05  # between two looks at the inputs, while it does not play [s]
_SETTLES = 0.3  # time after the last slider input of a visitor [s]


class Replay:
    """Plays a recording on a server of viser.

    Parameters
    ----------
    server : of viser; recording : must stay open while this object is used
    """

    def __init__(self, server: Any, recording: Recording) -> None:
        self._recording = recording
        self._model = model_of_recording(recording)
        self._cached = lru_cache(_KEPT)(lambda index: moment_of_frame(self._model, recording[index]))
        # Only one thread at a time may read HDF5.
        self._reading = threading.Lock()
        # Both the playing thread and visitors change the time.
        self._turn = threading.RLock()
        self._end = threading.Event()
        self.stage = Stage(server, self.moment(0), ViewOptions())
        times = recording.times
        first, last = float(times[0]), float(times[-1])
        gui = server.gui
        with gui.add_folder("Replay"):
            self.play = gui.add_button("Pause" if last > first else "Play", hint="Start or stop the time (space bar)")
            step = (last - first) / max(1, len(times) - 1)
            self.slider = gui.add_slider(
                "Time [s]",
                first,
                last,
                step if step > 0.0 else 1.0,
                initial_value=first,
                disabled=last == first,
                hint="The frame that is drawn (N: the next one)",
            )
            self.speed = gui.add_slider(
                "Speed", _SLOWEST, _FASTEST, 0.05, initial_value=1.0, hint="Recorded seconds in a second"
            )
            self.message = gui.add_markdown(self._facts(0))
            self.export = gui.add_button(
                "Export as page (HTML)", hint="One file with all frames in this view, for any browser"
            )
        self.overlay = Overlay(gui)
        self.controls = ViewControls(server, self.stage, self.overlay, followed=NOTHING)
        self.record = RecordControls(server, self.stage)
        add_keys(
            gui,
            self.controls.cameras,
            {
                "space": ("Play or pause", lambda client: self._toggle()),
                "N": ("One frame", lambda client: self._go_to(self.frame_at(self._time) + 1)),
                "R": ("Back to the start", lambda client: self._go_to(0)),
            },
        )
        self.playing = last > first
        self._time = first
        # The slider value that playing has set last. Another value comes from a visitor, whose event arrives soon.
        self._put = self.slider.value
        self._settle_at: float | None = None
        self._loop = server.get_event_loop()
        self.slider.on_update(self._seek)
        self.play.on_click(lambda _: self._toggle())
        self.export.on_click(self._send_page)
        self._frame_rate = FrameRate(server)
        self._thread = threading.Thread(target=self._run, name="supple replay", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the playing thread."""
        self._end.set()
        self._thread.join()

    def moment(self, index: int) -> Moment:
        """One frame; the frames requested last are cached."""
        with self._reading:
            return self._cached(index)

    def page(self) -> str:
        """The whole recording as HTML page, with the present view options."""
        with self._reading:
            return page_of_frames(self._recording, self._recording, self.stage.options)

    def frame_at(self, seconds: float) -> int:
        """The frame to draw at a time [s]: the last one that is not later."""
        times = self._recording.times
        step = 0.5 * float(np.diff(times).min()) if len(times) > 1 else 0.0
        return int(np.clip(np.searchsorted(times, seconds + step, side="right") - 1, 0, len(times) - 1))

    def show(self, seconds: float) -> None:
        """Draw the frame of a time [s]."""
        times = self._recording.times
        self._time = float(np.clip(seconds, times[0], times[-1]))
        frame = self.frame_at(self._time)
        moment = self.moment(frame)
        if moment is not self.stage.moment:
            self.stage.show(moment)
            self.controls.cameras.move()
            self.record.note(moment)
            self.controls.refresh()
            self.message.content = self._facts(frame)

    def _toggle(self) -> None:
        self.playing = not self.playing
        self.play.label = "Pause" if self.playing else "Play"

    def _seek(self, event: Any) -> None:
        """Handle slider input of a visitor; updates by playing have no client."""
        if event.client is not None:
            self._pause_at(self.slider.value)

    def _go_to(self, frame: int) -> None:
        seconds = float(self._recording.times[min(frame, len(self._recording) - 1)])
        self.slider.value = seconds
        self._pause_at(seconds)

    def _pause_at(self, seconds: float) -> None:
        with self._turn:
            if self.playing:
                self._toggle()
            self._settle_at = time.monotonic() + _SETTLES
            self._put = self.slider.value
            self.show(seconds)

    def _run(self) -> None:
        before = time.monotonic()
        while not self._end.wait(self._frame_rate.pause() if self.playing else _RESTS):
            now = time.monotonic()
            passed, before = now - before, now
            times = self._recording.times
            with self._turn:
                if self.playing and self.slider.value == self._put and self._frame_rate.may_send():
                    following = self._time + passed * self.speed.value
                    if following > times[-1]:
                        following = float(times[0])
                    with self._frame_rate.sending():
                        self.show(following)
                        self._in_loop(self._advance, float(times[self.frame_at(following)]))
                elif self._settle_at is not None and now > self._settle_at:
                    self._settle_at = None
                    self._in_loop(self._send_again)

    def _in_loop(self, call: Callable[..., None], *arguments: float) -> None:
        """Run a function in the loop of the server, which also reads messages: no message comes in between."""
        with suppress(RuntimeError):  # the server has stopped
            self._loop.call_soon_threadsafe(call, *arguments)

    def _advance(self, seconds: float) -> None:
        """Move the slider to the playing time, unless a visitor has moved it."""
        if self.playing and self.slider.value == self._put:
            self._put = seconds
            self.slider.value = seconds

    def _send_again(self) -> None:
        """Send the slider value to all visitors again.

        The last value of playing and the input of a visitor may have been sent at the same time; then that browser
        displays an old time. viser does not send the same value twice, so that its last bit is changed.
        """
        if not self.playing:
            times = self._recording.times
            self._put = float(np.nextafter(self.slider.value, 0.5 * (times[0] + times[-1])))
            self.slider.value = self._put

    def _facts(self, frame: int) -> str:
        recording = self._recording
        report = recording[frame].report
        return (
            f"Frame {frame} of {len(recording) - 1}, {len(recording.tets)} tets, "
            f"{len(recording.rest_positions)} vertices  \n"
            f"smallest J {report.min_det_F:.3g}, {report.status}"
        )

    def _send_page(self, event: Any) -> None:
        if event.client is not None:
            self.export.disabled = True
            try:
                event.client.send_file_download("supple.html", self.page().encode(), save_immediately=True)
            finally:
                self.export.disabled = False
