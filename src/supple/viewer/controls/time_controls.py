"""Play, pause, step, reset and slow motion."""

from __future__ import annotations

from typing import Any

from supple.viewer.controls.controller import Controller, sequential
from supple.viewer.protocol import limits
from supple.viewer.protocol.messages import Pause, Play, Reset, SetSpeed, Step
from supple.viewer.protocol.snapshots import Snapshot
from supple.viewer.server.browser_values import number, one_of
from supple.viewer.server.plain_markdown import plain

_BACK = ("step", "reset")


class TimeControls:
    """The folder "Time"."""

    def __init__(self, gui: Any, controller: Controller) -> None:
        self._controller = controller
        with gui.add_folder("Time"):
            self._message = gui.add_markdown("")
            self._text = self._time_text = ""
            self.play = gui.add_button("Play")
            self.back = gui.add_button_group("Frames", _BACK)
            self.speed = gui.add_slider(
                "Slow motion", limits.SLOWEST_MOTION, limits.FASTEST_MOTION, 0.01, initial_value=1.0
            )
        self.play.on_click(
            sequential(lambda e: controller.send(e.client, Play if controller.snapshot.paused else Pause))
        )
        self.back.on_click(sequential(self._go_back))
        self.speed.on_update(sequential(self._set_speed))

    def show(self, snapshot: Snapshot) -> None:
        """Say how things stand."""
        label = "Play" if snapshot.paused else "Pause"
        if self.play.label != label:
            self.play.label = label
        self._time_text = time_text(snapshot)
        self._show_message(self._time_text)

    def wait(self, seconds: float) -> None:
        """Say that nothing has been heard of the simulation for some seconds."""
        why = "a long step, or kernels that are compiled when they are first used"
        self._show_message(f"{self._time_text}  \n**Busy for {seconds:.0f} s:** {why}")

    def show_error(self, error: str) -> None:
        """Say that the simulation is gone."""
        self._show_message(f"**The simulation is gone:** {plain(error)}")
        for handle in (self.play, self.speed):
            if not handle.disabled:
                handle.disabled = True

    def _show_message(self, text: str) -> None:
        if text != self._text:
            self._message.content = self._text = text

    def _go_back(self, event: Any) -> None:
        self._controller.send(event.client, Step if one_of(self.back.value, _BACK) == "step" else Reset)

    def _set_speed(self, event: Any) -> None:
        if event.client is not None:
            factor = number(self.speed.value, limits.SLOWEST_MOTION, limits.FASTEST_MOTION)
            self._controller.send(event.client, lambda: SetSpeed(factor))


def time_text(snapshot: Snapshot) -> str:
    """A line or two: the time, how fast it goes, and whether that is as fast as it should."""
    timing = snapshot.timing
    lines = [f"t = {snapshot.time:.2f} s, frame {snapshot.frame}"]
    if snapshot.paused:
        lines.append("paused")
    else:
        lines.append(
            f"{timing.step_ms:.1f} ms per frame, {timing.frames_per_second:.0f} frames/s, "
            f"{timing.real_time_ratio:.2f} of real time"
        )
        if not timing.keeps_up:
            lines.append(
                f"**Too slow for {'real time' if snapshot.speed == 1.0 else f'{snapshot.speed:g} of real time'}:** "
                "fewer substeps or tets would help"
            )
    return "  \n".join(lines)
