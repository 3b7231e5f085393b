"""What makes a simulation slower than real time, and a command that remedies it."""

from __future__ import annotations

from typing import NamedTuple

from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.commands import Command, SetParameter, SetSpeed
from supple.app.viewer.protocol.snapshots import Snapshot


class Bottleneck(NamedTuple):
    """The cause, the label of a button that remedies it, and its command; no button where none is known."""

    cause: str
    label: str = ""
    remedy: Command | None = None


def bottleneck(snapshot: Snapshot) -> Bottleneck | None:
    """Why the simulation falls behind the requested speed; None where it does not."""
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
        fewer = int(0.8 * iterations * allowed / timing.step_ms)
        if 1 <= fewer < iterations and "substeps" in scene.values:
            return Bottleneck(cause, f"Use {fewer} substep{'s' * (fewer > 1)}", SetParameter("substeps", fewer))
    else:
        contacts = snapshot.measures.contacts
        cause = f"{step}: {iterations} Newton iterations with {scene.n_tets} tets and {contacts} contacts"
    slower = max(limits.SLOWEST_MOTION, float(f"{0.8 * snapshot.speed * allowed / timing.step_ms:.1g}"))
    if slower < snapshot.speed:
        return Bottleneck(cause, f"Slow motion {slower:g}", SetSpeed(slower))
    return Bottleneck(cause)
