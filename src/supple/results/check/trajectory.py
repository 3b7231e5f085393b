"""What the checks read: the frames of a simulation, of ours or of another program, and what is known beside them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.active import ActiveTets
from supple.materials.laws.internal import NEVER_FLOWED
from supple.materials.per_tet import NOT_ELASTIC, TetMaterial
from supple.mesh.skin import Skin
from supple.results.check.load_forces import CablePath, CavitySurface, LoadPattern
from supple.results.recording.reader import Recording
from supple.scene.joints.placed import PlacedJoint
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.stitches.measures import StitchEnds

Floats = NDArray[np.float64]
_NONE = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Part:
    """A body.

    Attributes
    ----------
    vertices, tets : its rows of the arrays of all
    triangles : (t, 3) its boundary, counter-clockwise from outside, rows of its own vertices
    skin : a surface that it carries, or None; that of a rigid body, whose vertices are control points, is the body
    touches_with_skin : whether the skin is what touches other things
    """

    name: str
    vertices: slice
    tets: slice
    triangles: NDArray[np.int32]
    skin: Skin | None = None
    rigid: bool = False
    touches_with_skin: bool = False

    def points(self, x: Floats) -> Floats:
        """Positions (k, 3) of its points, of those of all vertices x (n, 3)."""
        own = x[self.vertices]
        return self.skin.positions(own) if self.rigid and self.skin is not None else own


@dataclass(frozen=True, eq=False)
class Weld:
    """Vertices (k,) that are points of a rigid body; rigid, soft : numbers of the bodies."""

    soft: int
    rigid: int
    vertices: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Stitches:
    """Stitches and their laws: tets first, then springs.

    Attributes
    ----------
    rest_shape_inverse : (t, 3, 3) Dm^-1 of the tets [1/m]; moduli : (t, 2) mu and lam of their energy density [Pa]
    springs : (s, 2) stiffness [N/m] and rest length [m]
    """

    ends: StitchEnds
    rest_shape_inverse: Floats
    moduli: Floats
    springs: Floats


@dataclass(frozen=True, eq=False)
class TrajectoryFrame:
    """One frame.

    Attributes
    ----------
    number, time : of the frame, [s]
    positions, velocities : (n, 3) [m], [m/s]; det_F : (m,) as recorded; poses : (obstacles, 3, 4)
    internal : (k, 11) internal variables of materials that flow, see `State`; active : growths and muscles
    load_values : vectors and numbers of the loads, by name
    pressures, tensions : of cavities [Pa], and of spans of cables [N], by name
    broken, latest : (b,) pairs of stitches that have broken, and those of them that broke since the frame before
    other : why it cannot be compared with the other frames of a series, or None
    """

    number: int
    time: float
    positions: Floats
    velocities: Floats
    det_F: Floats = field(default_factory=lambda: np.zeros(0))
    poses: Floats = field(default_factory=lambda: np.zeros((0, 3, 4)))
    internal: Floats = field(default_factory=lambda: NEVER_FLOWED)
    active: tuple[ActiveTets, ...] = ()
    load_values: Mapping[str, Floats | float] = field(default_factory=dict)
    pressures: Mapping[str, float] = field(default_factory=dict)
    tensions: Mapping[str, float] = field(default_factory=dict)
    broken: NDArray[np.int64] = field(default_factory=lambda: _NONE)
    latest: NDArray[np.int64] = field(default_factory=lambda: _NONE)
    other: str | None = None


@dataclass(eq=False, kw_only=True)
class Trajectory(ABC):
    """Frames, and what no frame changes.

    Attributes
    ----------
    path : of the file, as the user gave it
    knows : what the checks may need, see `frame_check.UNKNOWN`
    source : the recording, where this is one
    times : (frames,) [s], or the numbers of frames; dt : from frame to frame [s]
    rest_positions : (n, 3) [m]; masses : (n,) [kg]; tets : (m, 4); rest_volumes : (m,) [m^3]; material : of the tets
    quadratic : rows (k,), ascending, and nodes (k, 10) of the quadratic tets; None without such
    compliances : for each body those of its edges [m/N] and volumes [m^5/N], or None for a body of another law
    untouching : pairs that may pass through each other: numbers of bodies, then obstacles
    joint_limits : of each joint the largest effort of its motor [N m] or [N], and rate [rad/s] or [m/s]
    loads : those whose forces follow from one value, by its name in a frame; other_loads : names of works of others
    acting : what may act from outside besides gravity; driving : what may do work; each None where nothing does
    file_numbers : rows in the files of vertices, tets and triangles; of a triangle between tets and outside, -1
    numbers : (frames,) in the names of files; notes : what was assumed, one sentence each
    unfinished : how the frames end before the last one that was asked for, or ""
    """

    path: Path
    knows: frozenset[str]
    times: Floats
    dt: float
    gravity: Floats
    bodies: Sequence[Part]
    rest_positions: Floats
    masses: Floats
    tets: NDArray[np.int32]
    rest_volumes: Floats
    material: TetMaterial
    compliances: Sequence[tuple[float, float] | None]
    source: Recording | None = None
    quadratic: tuple[NDArray[np.int64], NDArray[np.int32]] | None = None
    obstacles: Sequence[Obstacle] = ()
    pinned_vertices: NDArray[np.integer] = field(default_factory=lambda: _NONE)
    untouching: Sequence[tuple[int, int]] = ()
    welds: Sequence[Weld] = ()
    joints: Sequence[PlacedJoint] = ()
    joint_limits: Sequence[tuple[float, float]] = ()
    loads: Mapping[str, LoadPattern] = field(default_factory=dict)
    other_loads: frozenset[str] = frozenset()
    cavities: Sequence[CavitySurface] = ()
    cables: Sequence[CablePath] = ()
    stitches: Stitches | None = None
    acting: str | None = None
    driving: str | None = None
    file_numbers: Mapping[str, NDArray[np.int64]] | None = None
    numbers: NDArray[np.int64] | None = None
    notes: tuple[str, ...] = ()
    unfinished: str = ""

    def __len__(self) -> int:
        return len(self.times)

    @property
    def records(self) -> Recording:
        """What a recording has beside positions and velocities, for checks that need one."""
        assert self.source is not None
        return self.source

    @abstractmethod
    def frame(self, number: int) -> TrajectoryFrame:
        """A frame."""

    def knows_law(self, body: int) -> bool:
        """Whether the elastic energy of a body can be computed."""
        kinds = self.material.kind[self.bodies[body].tets]
        return self.compliances[body] is not None or bool((kinds != NOT_ELASTIC).all())

    def nodes_of(self, body: Part) -> NDArray[np.int32]:
        """(m, 4) or (m, 10) nodes of a body's tets, rows of all vertices."""
        if self.quadratic is not None:
            rows, nodes = self.quadratic
            begin, end = np.searchsorted(rows, [body.tets.start, body.tets.stop])
            if end > begin:
                return nodes[begin:end]
        return self.tets[body.tets]
