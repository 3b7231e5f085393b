"""What is known of a simulation, of ours or of another program, and of each of its frames."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from supple.materials.elastic import EdgesAndVolume
from supple.materials.laws.internal import NEVER_FLOWED
from supple.materials.per_tet import TetMaterial
from supple.model.state import SolverDetails
from supple.results.check.geometry import quadratic_tets
from supple.results.check.geometry.vectors import determinants, edge_vectors, inverses
from supple.results.check.rods import StoredByRod
from supple.results.check.shells import StoredByShell
from supple.results.recording.frame import RecordedFrame
from supple.results.recording.reader import Recording
from supple.scene.joints.placed import PlacedJoint
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.rows import BodyRows
from supple.scene.stitches.measures import StitchEnds
from supple.scene.stitches.stitching import Stitching

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Forces = Callable[[float, Floats, Floats], Floats]
"""(n, 3) on the vertices [N], at a time [s], of their positions and velocities (n, 3)."""
_NONE = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Part:
    """A body of a series, as `BodyRows` of a recording: its rows of the arrays of all, and its boundary. No skin."""

    name: str
    vertices: slice
    tets: slice
    boundary: NDArray[np.int32]
    rigid: bool = False
    skin: None = None
    touching_skin: None = None

    def points(self, x: Floats) -> Floats:
        """Positions (k, 3) of its points, of those of all vertices x (n, 3)."""
        return x[self.vertices]


class Weld(NamedTuple):
    """Vertices (k,) that are points of a rigid body; rigid, soft : numbers of the bodies."""

    soft: int
    rigid: int
    vertices: Ints


class Cavity(NamedTuple):
    """A cavity; triangles : (t, 3) vertices of the surface around it, seen counter-clockwise from inside."""

    name: str
    triangles: Ints


class Cable(NamedTuple):
    """A cable through points W x + offsets; weights : W (p, n); offsets : (p, 3) [m]."""

    name: str
    weights: csr_array
    offsets: Floats


class Growing(NamedTuple):
    """Tets (k,) that grow; directions : (k, 3), or (0, 3) for all; stretch : [-] of time [s]."""

    rows: Ints
    directions: Floats
    stretch: Callable[[float], Floats]


class Known(ABC):
    """What no frame changes. The values here are those of what is not known, and of what is not there.

    Attributes
    ----------
    path : of the file, as the user gave it
    knows : what the checks may need, see `frame_check.UNKNOWN`
    source : the recording, where this is one; implicit : whether the solver is `Implicit`
    times : (frames,) [s], or the numbers of frames; dt : from frame to frame [s]
    rest_positions : (n, 3) [m]; masses : (n,) [kg]; tets : (m, 4); material : of the tets
    quadratic : rows (k,), ascending, and nodes (k, 10) of the quadratic tets
    thin : shells and rods, with what each stores
    springs : for each body its law, where that is of edges and volumes
    allowed : (p, p) which bodies, then obstacles, must stay apart; None where all must
    joint_limits : of each joint the largest effort of its motor [N m] or [N], and rate [rad/s] or [m/s]
    rows : of each body that a scene describes, by its name
    loads : the name of the work of each, and its forces or why they are not known
    stitching, stitch_ends : all stitches
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
    bodies: Sequence[Part | BodyRows]
    rest_positions: Floats
    masses: Floats
    tets: NDArray[np.int32]
    material: TetMaterial
    source: Recording | None = None
    implicit: bool = False
    thin: Sequence[tuple[BodyRows, StoredByShell | StoredByRod]] = ()
    quadratic: tuple[Ints, NDArray[np.int32]] = np.zeros(0, np.int64), np.zeros((0, 10), np.int32)
    springs: Sequence[EdgesAndVolume | None] = ()
    obstacles: Sequence[Obstacle] = ()
    pinned_vertices: Ints = np.zeros(0, np.int64)
    allowed: NDArray[np.bool_] | None = None
    welds: Sequence[Weld] = ()
    joints: Sequence[PlacedJoint] = ()
    joint_limits: Sequence[tuple[float, float]] = ()
    rows: Mapping[str, BodyRows] = MappingProxyType({})
    loads: Sequence[tuple[str, Forces | str]] = ()
    growing: Sequence[Growing] = ()
    cavities: Sequence[Cavity] = ()
    cables: Sequence[Cable] = ()
    stitching: Stitching | None = None
    stitch_ends: StitchEnds | None = None
    acting: str | None = None
    driving: str | None = None
    file_numbers: Mapping[str, Ints] | None = None
    numbers: Ints | None = None
    notes: tuple[str, ...] = ()
    unfinished: str = ""

    @abstractmethod
    def snapshot(self, number: int) -> Frame:
        """A frame."""

    def __len__(self) -> int:
        return len(self.times)

    @property
    def records(self) -> Recording:
        """What a recording has beside positions and velocities, for checks that need one."""
        assert self.source is not None
        return self.source

    @cached_property
    def rest_inverse(self) -> Floats:
        """(m, 3, 3) Dm^-1 [1/m]; NaN where a tet is flat at rest."""
        return inverses(edge_vectors(self.rest_positions, self.tets))

    @cached_property
    def quadratic_at_rest(self) -> Floats:
        """(k, 10, 3) nodes of the quadratic tets at rest [m]."""
        return self.rest_positions[self.quadratic[1]]

    @cached_property
    def rest_volumes(self) -> Floats:
        """(m,) [m^3]."""
        volumes = determinants(edge_vectors(self.rest_positions, self.tets)) / 6.0
        volumes[self.quadratic[0]] = quadratic_tets.volumes(self.quadratic_at_rest)
        return volumes

    @cached_property
    def size(self) -> float:
        """Longest extent of the largest body at rest [m]."""
        return max(float(np.ptp(body.points(self.rest_positions), axis=0).max()) for body in self.bodies)


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame, with what is measured on its tets.

    Attributes
    ----------
    of : what is known of all frames; number, time : of the frame, [s]
    positions, velocities : (n, 3) [m], [m/s]; poses : (obstacles, 3, 4)
    internal : (k, 11) internal variables of materials that flow, see `State`
    broken, latest : (b,) pairs of stitches that have broken, and those of them that broke since the frame before
    other : why it cannot be compared with the other frames of a series, or None
    recorded : the frame of the recording, where this is one
    """

    of: Known
    number: int
    time: float
    positions: Floats
    velocities: Floats
    poses: Floats = field(default_factory=lambda: np.zeros((0, 3, 4)))
    internal: Floats = field(default_factory=lambda: NEVER_FLOWED)
    broken: NDArray[np.int64] = field(default_factory=lambda: _NONE)
    latest: NDArray[np.int64] = field(default_factory=lambda: _NONE)
    other: str | None = None
    recorded: RecordedFrame | None = None

    @property
    def details(self) -> SolverDetails:
        """What the solver said of the step."""
        return SolverDetails() if self.recorded is None else self.recorded.report.details

    @cached_property
    def finite(self) -> bool:
        """Whether positions, velocities and poses are finite, and the frame can be compared with others."""
        known = (self.positions, self.poses) if self.recorded is None else (self.positions, self.poses, self.velocities)
        return self.other is None and all(bool(np.isfinite(values).all()) for values in known)

    @cached_property
    def moves(self) -> bool:
        """Whether velocities are finite: those of a series are not beside a frame that cannot be used."""
        return bool(np.isfinite(self.velocities).all())

    @cached_property
    def quadratic(self) -> tuple[NDArray[np.int64], Floats]:
        """The rows (k,) of the quadratic tets, and their nodes (k, 10, 3) [m]."""
        rows, nodes = self.of.quadratic
        return rows, self.positions[nodes]

    @cached_property
    def F(self) -> Floats:
        """(m, 3, 3) deformation gradients."""
        return edge_vectors(self.positions, self.of.tets) @ self.of.rest_inverse

    @cached_property
    def J(self) -> Floats:
        """(m,) their determinants, computed here; of quadratic tets, the ratios of their volumes."""
        J, (rows, nodes) = determinants(self.F), self.quadratic
        J[rows] = quadratic_tets.volumes(nodes) / self.of.rest_volumes[rows]
        return J

    @cached_property
    def least_J(self) -> Floats:
        """(m,) as `J`; in quadratic tets the smallest of those at nodes and quadrature points."""
        least, (rows, nodes) = self.J.copy(), self.quadratic
        least[rows] = quadratic_tets.smallest_ratios(nodes, self.of.quadratic_at_rest)
        return least

    @cached_property
    def bounded_J(self) -> Floats:
        """(m,) as `J`; in quadratic tets, what bounds it below everywhere in them where they are straight at rest."""
        least, (rows, nodes) = self.J.copy(), self.quadratic
        least[rows] = quadratic_tets.lowest_coefficients(nodes, self.of.quadratic_at_rest)
        return least

    @cached_property
    def growth(self) -> tuple[Floats, Floats]:
        """(m, 3, 3) the inverses of all growths together, and (m,) their determinants."""
        m = len(self.of.tets)
        if not self.of.growing:
            return np.broadcast_to(np.eye(3), (m, 3, 3)), np.ones(m)
        F_g = np.tile(np.eye(3), (m, 1, 1))
        for rows, d, stretch in self.of.growing:
            stretched = np.einsum("ki,kj->kij", d, d) if len(d) else np.eye(3)
            F_g[rows] = F_g[rows] @ (np.eye(3) + (stretch(self.time) - 1.0) * stretched)
        return inverses(F_g), determinants(F_g)

    @cached_property
    def kinetic_energy(self) -> float:
        """[J]"""
        return 0.5 * float(self.of.masses @ np.einsum("ij,ij->i", self.velocities, self.velocities))
