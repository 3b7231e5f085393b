"""What is drawn between the states at the ends of steps."""

from __future__ import annotations

from dataclasses import replace

from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.protocol.snapshots import Snapshot
from supple.contact.mesh.obstacles import ObstaclePoses
from supple.model.state import State
from supple.solvers.xpbd.workspace import XPBDWorkspace

# Time without a picture, and in a step, after which the next substep of XPBD is drawn [s].
LONGEST_UNSEEN = 0.025


def between(before: State, after: State, share: float) -> State:
    """The state at a share of the way between two."""
    return State(
        before.time + share * (after.time - before.time),
        before.positions + share * (after.positions - before.positions),
        before.velocities + share * (after.velocities - before.velocities),
        internal=after.internal,
    )


def within_step(live: LiveScene, last: Snapshot, shown: float) -> Snapshot | None:
    """The last snapshot with the positions after the latest substep of the present step.

    None where that is not later than `shown` [s], as at the start of a step or in its repetition, and for a solver
    that has no state within a step. What is measured, colors included, is that of the last whole step.
    """
    workspace = live.workspace
    if not isinstance(workspace, XPBDWorkspace) or workspace.time <= shown:
        return None
    system, setup, state = live.system, live.setup, workspace.present()
    points, pusher = system.split(state.positions), setup.pusher
    return replace(
        last,
        time=state.time,
        positions=state.positions,
        velocities=None if last.velocities is None else state.velocities,
        obstacle_poses=ObstaclePoses(system.obstacles).at(state.time),
        grabs=tuple(spring.drawn(points[spring.command.body]) for spring in setup.grabs.values()),
        pusher=None if pusher is None else (tuple(pusher.place(state.time).tolist()), pusher.radius),
    )
