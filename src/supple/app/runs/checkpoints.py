"""Between frames and checkpoints: what is kept of a frame, and the frame that a run goes on from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from supple.app.runs.journal import versions
from supple.model.system import System, rebuilt_system
from supple.results.checkpoint.file import Checkpoint, RunFacts
from supple.results.checkpoint.scene_hash import scene_hash
from supple.results.frame import Frame, start_frame
from supple.scene.scene import Scene
from supple.solvers.solver import Solver


def facts_of(system: System, start: tuple[int, float], dt: float, steps: int, solver: Solver) -> RunFacts:
    """What a run is that begins with the index and the time [s] `start`, and has so many steps of dt [s]."""
    span = (float(start[1]), float(steps * dt))
    return RunFacts(start[0], int(steps), float(dt), scene_hash(system, *span), span, str(solver))


def checkpoint_of(frame: Frame, run: RunFacts) -> Checkpoint:
    """All that the next step depends on."""
    return Checkpoint(
        run=run,
        index=frame.index,
        state=frame.state,
        start_states=tuple(replace(state, memory=None) for state in frame.system.start_states),
        anchors=tuple(np.asarray(pin.anchors) for pin in frame.system.pins),
        versions=versions(),
    )


def frame_of(checkpoint: Checkpoint, scene: Scene, solver: Solver) -> Frame | None:
    """The frame of a checkpoint; None where the scene is not the one that was run."""
    count = sum(len(body.mesh.vertices) for body in scene.bodies)
    if len(checkpoint.state.positions) != count or len(checkpoint.anchors) != len(scene.pins):
        return None
    system = rebuilt_system(scene, checkpoint.start_states, checkpoint.anchors)
    if scene_hash(system, *checkpoint.run.span) != checkpoint.run.scene:
        return None
    return start_frame(system, checkpoint.state, checkpoint.index, solver)
