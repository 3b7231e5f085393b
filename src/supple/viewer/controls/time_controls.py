"""The folder "Time" of the panel: play, pause, step, reset and slow motion."""

from __future__ import annotations

from typing import Any

from supple.viewer.controls.controller import Controller, sequential
from supple.viewer.protocol import limits
from supple.viewer.protocol.commands import Pause, Play, Reset, SetSpeed, Step
from supple.viewer.protocol.snapshots import Snapshot
from supple.viewer.server.browser_values import number, one_of
from supple.viewer.server.plain_markdown import plain

_FRAME_ACTIONS = ("step", "reset")


class TimeControls:
    """The folder "Time"."""

    def __init__(self, gui: Any, controller: Controller) -> None:
        self._controller = controller
        with gui.add_folder("Time"):
            self._message = gui.add_markdown("")
            self._time_text = ""
            self.play = gui.add_button("Play")
            self.frames = gui.add_button_group("Frames", _FRAME_ACTIONS)
            self.speed = gui.add_slider(
                "Slow motion", limits.SLOWEST_MOTION, limits.FASTEST_MOTION, 0.01, initial_value=1.0
            )
        self.play.on_click(
            sequential(lambda e: controller.send(e.client, Play if controller.snapshot.paused else Pause))
        )
        self.frames.on_click(sequential(self._change_frame))
        self.speed.on_update(sequential(self._set_speed))

    def show(self, snapshot: Snapshot) -> None:
        """Display time, speed and state."""
        self.play.label = "Play" if snapshot.paused else "Pause"
        self._time_text = time_text(snapshot)
        self._show_message(self._time_text)

    def wait(self, seconds: float) -> None:
        """Display that the simulation has not sent anything for some seconds."""
        why = "a long step, or the compilation of kernels at their first use"
        self._show_message(f"{self._time_text}  \n**Busy for {seconds:.0f} s:** {why}")

    def show_error(self, error: str) -> None:
        """Display that the simulation has ended."""
        self._show_message(f"**The simulation has ended:** {plain(error)}")
        self.play.disabled = self.speed.disabled = True

    def _show_message(self, text: str) -> None:
        if text != self._message.content:
            self._message.content = text

    def _change_frame(self, event: Any) -> None:
        self._controller.send(event.client, Step if one_of(self.frames.value, _FRAME_ACTIONS) == "step" else Reset)

    def _set_speed(self, event: Any) -> None:
        if event.client is not None:
            factor = number(self.speed.value, limits.SLOWEST_MOTION, limits.FASTEST_MOTION)
            self._controller.send(event.client, lambda: SetSpeed(factor))


def time_text(snapshot: Snapshot) -> str:
    """Time, speed, and a warning where the simulation is too slow."""
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
                "use fewer substeps or tets"
            )
    return "  \n".join(lines)
