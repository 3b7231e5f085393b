"""What the simulation sends to the page: a description of the scene, and snapshots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.protocol.parameters import Value
from supple.model.diagnostics import Diagnostics
from supple.results.readings.frame_readings import JointReading
from supple.scene.joints.placed import PlacedJoint
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.rows import BodyRows
from supple.scene.stitches.measures import StitchEnds


@dataclass(frozen=True, eq=False)
class BodyDescription(BodyRows):
    """One body, with its rows of the arrays of a snapshot.

    Attributes
    ----------
    values : of the parameters that a page can change, by name
    """

    values: dict[str, Value]


@dataclass(frozen=True, eq=False)
class SceneDescription:
    """Everything that does not change from frame to frame.

    Attributes
    ----------
    obstacles : at time 0; `Snapshot.obstacle_poses` transforms them to other times
    revision : changes with every change, also of a parameter or of the solver
    solver : "xpbd" or "implicit"; values : of the parameters of solver and scene, by name
    up : (3,) unit vector against gravity
    low, high : (3,) corners of the bounding box of the bodies at the start [m]
    stitches : of all kinds
    joints : of rigid bodies
    n_tets : of the whole scene
    """

    revision: int
    bodies: tuple[BodyDescription, ...]
    obstacles: tuple[Obstacle, ...]
    solver: str
    values: dict[str, Value]
    up: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    stitches: StitchEnds
    n_tets: int
    joints: tuple[PlacedJoint, ...] = ()

    def body(self, name: str) -> BodyDescription:
        """The body of that name."""
        return {body.name: body for body in self.bodies}[name]


@dataclass(frozen=True)
class GrabState:
    """A spring to draw: from `point` (3,) on the body to `target` (3,) [m]; `body` is its name."""

    grab: int
    body: str
    point: tuple[float, float, float]
    target: tuple[float, float, float]


@dataclass(frozen=True)
class Notice:
    """A line of text for the page. Numbers increase, so that each notice appears once. `level` is "info" or "error"."""

    number: int
    level: str
    text: str


@dataclass(frozen=True, eq=False)
class Measures(Diagnostics):
    """Numbers of one frame, for the panel.

    Attributes
    ----------
    status, message : of the last step, see `supple.model.state.Status`
    contacts : number of active contacts; min_distance : smallest gap [m] or None
    iterations : of the last step
    joints : what joints do, by name
    """

    status: str
    message: str
    contacts: int
    min_distance: float | None
    iterations: int
    joints: Mapping[str, JointReading] = field(default_factory=dict)


@dataclass(frozen=True)
class Timing:
    """The speed of the simulation, measured over the last second.

    Attributes
    ----------
    step_ms : wall-clock time of one step [ms]
    frames_per_second : steps simulated in a second of wall-clock time
    real_time_ratio : simulated time over wall-clock time; 1 is real time
    keeps_up : whether this ratio reaches the requested speed (within a tenth)
    """

    step_ms: float = 0.0
    frames_per_second: float = 0.0
    real_time_ratio: float = 0.0
    keeps_up: bool = True


@dataclass(frozen=True)
class Progress:
    """What takes long: a step, or a stage of the start.

    Attributes
    ----------
    seconds : since it began; rounds : substeps or Newton iterations so far
    kernels : where kernels are compiled now, the number of the current one, and how many there will be
    what : it is
    """

    seconds: float
    rounds: int = 0
    kernels: tuple[int, int] | None = None
    what: str = "a long step"

    def text(self, solver: str = "xpbd") -> str:
        """What the simulation does while it sends no frames."""
        what = self.what
        if self.kernels is not None:
            what = "compiling kernel {} of {}, once on this machine".format(*self.kernels)
        name = {"xpbd": "substep", "implicit": "Newton iteration"}[solver]
        return f"Busy for {self.seconds:.0f} s: {what}" + (f", {name} {self.rounds}" if self.rounds else "")


@dataclass(frozen=True)
class Reading:
    """What one sensor, cavity or cable reads. `unit` is that of `value`."""

    name: str
    unit: str
    value: float


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The simulation at one time.

    Attributes
    ----------
    description : of the scene that this snapshot belongs to
    frame : steps since the start or the last reset; time : simulated [s]
    positions : (n, 3) of all bodies [m]
    obstacle_poses : rotations (k, 3, 3) and translations (k, 3) [m] of the obstacles
    pinned : (p,) global vertices that are pinned
    grabs : springs that pull
    paused : whether the time is stopped; speed : see `SetSpeed`
    measures, timing : numbers for the panel
    notices : the newest ones; see `Notice`
    applied : number of the newest command that was executed, see `Engine.send`
    tet_values : (m,), contact_points : (c, 3) [m], where `SetView` requests them
    contact_forces : points (c, 3) [m] and forces (c, 3) [N] of the strongest contacts, each on the first of its two
        bodies, where `SetView` requests contacts and the solver knows them
    readings : of sensors, cavities and cables
    tet_quantity : the quantity of `tet_values`: "J", "von_mises", "energy" or None
    broken_stitches : see `State`
    """

    description: SceneDescription
    frame: int
    time: float
    positions: NDArray[np.float64]
    obstacle_poses: tuple[NDArray[np.float64], NDArray[np.float64]]
    pinned: NDArray[np.int32]
    grabs: tuple[GrabState, ...]
    paused: bool
    speed: float
    measures: Measures
    timing: Timing
    notices: tuple[Notice, ...] = ()
    applied: int = 0
    tet_values: NDArray[np.float64] | None = None
    tet_quantity: str | None = None
    contact_points: NDArray[np.float64] | None = None
    contact_forces: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
    readings: tuple[Reading, ...] = ()
    broken_stitches: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
