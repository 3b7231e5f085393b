"""The folder "Time" of the panel: play, pause, step, reset and slow motion."""

from __future__ import annotations

import html
import threading
from collections.abc import Callable
from typing import Any, NamedTuple

from supple.app.viewer.controls.controller import Controller, notify, sequential
from supple.app.viewer.controls.number_input import NumberInput
from supple.app.viewer.controls.view.overlay import Overlay, button, plain
from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.commands import Command, Pause, Play, Reset, SetSpeed, Step
from supple.app.viewer.protocol.snapshots import Progress, Snapshot
from supple.errors import SuppleError

_ROUNDS = {"xpbd": "substep", "implicit": "Newton iteration"}
_FRAME_ACTIONS = ("step", "reset")


class TimeControls:
    """The folder "Time"."""

    def __init__(self, gui: Any, controller: Controller, overlay: Overlay) -> None:
        self._controller, self._overlay = controller, overlay
        self._restarts = threading.Lock()
        with gui.add_folder("Time"):
            self._message = gui.add_markdown("")
            self._time_text = ""
            self.play = gui.add_button("Play", hint="Start or stop the time (space bar)")
            self.frames = gui.add_button_group("Frames", _FRAME_ACTIONS, hint="One frame (N), or back to the start (R)")
            self.speed = NumberInput(
                gui,
                "Slow motion",
                1.0,
                limits.SLOWEST_MOTION,
                limits.FASTEST_MOTION,
                hint="Simulated seconds in a second; the time step of the solver does not change",
                changed=lambda client, factor: controller.send(client, lambda: SetSpeed(factor)),
            )
            self.remedy = gui.add_button("Remedy", visible=False, hint="Make the simulation as fast as real time")
            self.restart = gui.add_button("Restart", visible=False, hint="Start the simulation again")
            self.reload = gui.add_button(
                "Reload", visible=controller.simulation.again is not None, hint="Read the file again, and start from it"
            )
        self.play.on_click(sequential(lambda event: self.toggle(event.client)))
        self.frames.on_click(sequential(self._change_frame))
        self.remedy.on_click(sequential(self._apply_remedy))
        self.restart.on_click(self._restart)
        if self.reload.visible:
            self.reload.on_click(lambda event: self._start_again(event, controller.simulation.reload))

    def show(self, snapshot: Snapshot) -> None:
        """Display time, speed and state."""
        self.play.label = "Play" if snapshot.paused else "Pause"
        self._overlay.show("start", self._start(snapshot))
        self._time_text = time_text(snapshot)
        self._show_message(self._time_text)
        slow = bottleneck(snapshot)
        self.remedy.visible = slow is not None and slow.remedy is not None
        self.remedy.label = slow.label if slow is not None and slow.label else "Remedy"
        chosen = button(slow.label, self.remedy) if slow is not None and slow.remedy is not None else ""
        self._overlay.show("warning", "" if slow is None else f"Too slow: {html.escape(slow.cause)} {chosen}")

    def _start(self, snapshot: Snapshot) -> str:
        """A large button, where a visitor waits for something to happen that needs time to run."""
        if snapshot.paused and snapshot.grabs:
            return button("▶ Paused: the spring pulls when time runs. Play", self.play)
        if snapshot.paused and snapshot.frame == 0 and snapshot.description.bodies:
            return button(f"▶ Play, then drag the {snapshot.description.bodies[0].name}", self.play)
        return ""

    def wait(self, progress: Progress) -> None:
        """Display that the simulation is within a long step."""
        what = "a long step"
        if progress.kernels is not None:
            what = "compiling kernel {} of {}, once on this machine".format(*progress.kernels)
        rounds = (
            f", {_ROUNDS[self._controller.snapshot.description.solver]} {progress.rounds}" if progress.rounds else ""
        )
        text = f"Busy for {progress.seconds:.0f} s: {what}{rounds}"
        self._overlay.show("busy", text)
        self._show_message(f"{self._time_text}  \n**{text}**")

    def go_on(self) -> None:
        """The simulation is not within a long step."""
        self._overlay.show("busy", "")

    def show_error(self, error: str) -> None:
        """Display that the simulation has ended, with a button that starts it again."""
        self._show_message(f"**The simulation has ended:** {plain(error)}")
        self.restart.visible = True
        again = button("Restart the simulation", self.restart)
        self._overlay.show("warning", f"The simulation has ended: {html.escape(error)} {again}")
        self._overlay.show("start", "")
        self.play.disabled = self.speed.handle.disabled = True

    def restarted(self) -> None:
        """The simulation runs again. Called by the thread that calls `show_error`: both set the same buttons."""
        self.play.disabled = self.speed.handle.disabled = self.restart.visible = False

    def _restart(self, event: Any) -> None:
        if self._controller.simulation.error is not None:
            self._start_again(event, self._controller.simulation.restart)

    def _start_again(self, event: Any, start: Callable[[], None]) -> None:
        """Called in a thread: a start takes seconds."""
        if event.client is None:
            return
        if not self._restarts.acquire(blocking=False):  # somebody else has pressed the button
            return
        self._overlay.show("warning", "The simulation starts again.")
        try:
            start()
        except SuppleError as error:
            notify(event.client, "Not started", str(error), "red")
            self._overlay.show("warning", "")
        finally:
            self._restarts.release()

    def _apply_remedy(self, event: Any) -> None:
        slow = bottleneck(self._controller.snapshot)
        remedy = None if slow is None else slow.remedy
        if event.client is not None and remedy is not None:
            self._controller.send(event.client, lambda: remedy)

    def _show_message(self, text: str) -> None:
        if text != self._message.content:
            self._message.content = text

    def toggle(self, client: Any) -> None:
        """Start or stop the time."""
        self._controller.send(client, Play if self._controller.snapshot.paused else Pause)

    def _change_frame(self, event: Any) -> None:
        self._controller.send(event.client, Step if self.frames.value == "step" else Reset)


def time_text(snapshot: Snapshot) -> str:
    """Time and speed."""
    timing = snapshot.timing
    lines = [f"t = {snapshot.time:.2f} s, frame {snapshot.frame}"]
    if snapshot.paused:
        lines.append("paused")
    else:
        lines.append(
            f"{timing.step_ms:.1f} ms per frame, {timing.frames_per_second:.0f} frames/s, "
            f"{timing.real_time_ratio:.2f} of real time"
        )
    return "  \n".join(lines)


class Bottleneck(NamedTuple):
    """The cause, the label of a button that remedies it, and its command; no button where none is known."""

    cause: str
    label: str = ""
    remedy: Command | None = None


def bottleneck(snapshot: Snapshot) -> Bottleneck | None:
    """Why the simulation falls behind the requested speed; None where it does not.

    The remedy is slow motion: fewer substeps or iterations would make the result wrong.
    """
    timing, scene = snapshot.timing, snapshot.description
    if snapshot.paused or timing.keeps_up:
        return None
    allowed = 1e3 * float(scene.values.get("dt", 1.0 / 60.0)) / snapshot.speed
    step = f"a step takes {timing.step_ms:.0f} ms of {allowed:.0f} ms"
    if timing.step_ms < allowed:
        return Bottleneck(f"the machine is busy with something else: {step}")
    iterations = snapshot.measures.iterations
    if scene.solver == "xpbd":
        cause = f"{step}: {iterations} substeps of {scene.n_tets} tets, {snapshot.measures.contacts} contacts"
    else:
        contacts = snapshot.measures.contacts
        cause = f"{step}: {iterations} Newton iterations with {scene.n_tets} tets and {contacts} contacts"
    slower = max(limits.SLOWEST_MOTION, float(f"{0.8 * snapshot.speed * allowed / timing.step_ms:.1g}"))
    if slower < snapshot.speed:
        return Bottleneck(cause, f"Slow motion {slower:g}", SetSpeed(slower))
    return Bottleneck(cause)
