"""A demo: a scene, a solver for it, and claims that are measured while it runs; measures that several demos share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.contact.start.intersections import intersections_of
from supple.contact.start.surfaces import start_surfaces
from supple.errors import SolverError
from supple.model.state import Status
from supple.model.system import BodyRange
from supple.results.frame import Frame
from supple.scene.contact_pairs import pair_table
from supple.scene.scene import Scene
from supple.solvers.solver import Solver


@dataclass(frozen=True)
class Claim:
    """One sentence that the run tests.

    Attributes
    ----------
    text : the claim, with its limit; measured : the measured values; holds : whether the claim is true.
    """

    text: str
    measured: str
    holds: bool


class Measurement(ABC):
    """A sink that measures a demo and returns at the end which of its claims hold.

    Attributes
    ----------
    first, last : the frame at the start, and the latest one
    dt : time from frame to frame [s]; steps : how many frames the run should have
    statuses : how many steps ended how; iterations : of all steps
    series : by name, the `values` of every frame after the start
    """

    def begin(self, first: Frame, dt: float, steps: int) -> None:
        """Called with the frame at the start."""
        self.first = self.last = first
        self.dt, self.steps = dt, steps
        self.statuses: Counter[Status] = Counter()
        self.iterations = 0
        self.series: defaultdict[str, list[Any]] = defaultdict(list)

    def write(self, frame: Frame) -> None:
        """Called with every frame."""
        self.last = frame
        self.statuses[frame.report.status] += 1
        self.iterations += frame.report.iterations
        for name, value in self.values(frame).items():
            self.series[name].append(value)

    def values(self, frame: Frame) -> dict[str, Any]:
        """What the claims need of every frame, by name."""
        return {"min_J": frame.report.min_det_F}

    @property
    def endings(self) -> str:
        """How many steps ended how, for a claim."""
        return ", ".join(f"{count} {status}" for status, count in self.statuses.items())

    @property
    def every_step_converged(self) -> bool:
        return set(self.statuses) == {Status.CONVERGED}

    def no_tet_inverts(self) -> Claim:
        min_J = min(self.series["min_J"])
        return Claim("no tetrahedron inverts", f"smallest J {min_J:.3g}", min_J > 0.0)

    def nothing_crosses(self) -> Claim:
        """For demos whose `values` have "meetings"."""
        total = sum(self.series["meetings"])
        return Claim("nothing crosses or touches anything in any frame, by exact tests", f"{total} pairs", total == 0)

    def end(self) -> None:  # noqa: B027 - most demos have nothing to do here
        """Called when the run is over."""

    @abstractmethod
    def claims(self) -> list[Claim]:
        """The claims, with what was measured for each."""


@dataclass(frozen=True)
class Demo:
    """A named scene.

    Attributes
    ----------
    name, summary : for the list of demos; explanation : a paragraph on what the demo shows
    scene : builds the scene; measurement : builds the sink that measures the claims
    solvers : by kind ("xpbd", "implicit"), each builds the solver; the first is the default
    dt : time from frame to frame [s]; steps : how many frames
    variants : by kind of solver, a separate demo for a solver that needs another scene
    """

    name: str
    summary: str
    explanation: str
    scene: Callable[[], Scene]
    solvers: Mapping[str, Callable[[], Solver]]
    measurement: Callable[[], Measurement]
    steps: int
    dt: float = 1 / 60
    variants: Mapping[str, Demo] = field(default_factory=dict)

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of solver that this demo runs on; the first is the default."""
        return (*self.solvers, *self.variants)

    def on(self, kind: str) -> Demo:
        """The demo for that kind of solver: this one, or its variant.

        Raises
        ------
        SolverError : where this demo has no solver of that kind.
        """
        if kind not in self.kinds:
            raise SolverError(f"demo {self.name!r} has no solver {kind!r}; it has {', '.join(self.kinds)}")
        return self.variants.get(kind, self)

    def solver(self, kind: str | None = None) -> Solver:
        """The solver of that kind, or the default one.

        Raises
        ------
        SolverError : where this demo has no solver of that kind.
        """
        kind = self.kinds[0] if kind is None else kind
        return self.on(kind).solvers[kind]()


def body_range(frame: Frame, name: str) -> BodyRange:
    """The rows of the frame's flat arrays that belong to that body."""
    return next(part for part in frame.system.bodies if part.name == name)


def meetings(frame: Frame) -> int:
    """How many pairs of things have surfaces that are not apart, and how many cross themselves."""
    surfaces = start_surfaces(frame.system, frame.state.positions, frame.time)
    return len(intersections_of(surfaces, pair_table(frame.system.scene)))


def volume(frame: Frame, name: str) -> float:
    """Volume of a body [m^3]."""
    part = body_range(frame, name)
    return float(frame.det_F[part.tets] @ frame.system.rest_volumes[part.tets])


def spin_about(frame: Frame, name: str, axis: int) -> float:
    """Angular momentum over moment of inertia, about a coordinate axis through the center of mass [rad/s]."""
    part = body_range(frame, name)
    m = frame.system.masses[part.vertices]
    x, v = frame.positions[name], frame.velocities[name]
    r = x - m @ x / m.sum()
    L = m @ np.cross(r, v - m @ v / m.sum())
    across = np.delete(r, axis, axis=1)
    return float(L[axis] / (m @ np.einsum("ij,ij->i", across, across)))


def pin_error(frame: Frame) -> float:
    """The largest distance of a pinned vertex from where its motion puts it, along one axis [m]."""
    off = frame.state.positions[frame.system.pinned_vertices] - frame.system.pin_targets(frame.time)
    return float(np.abs(off).max())


def height(frame: Frame, name: str) -> float:
    """The vertical extent of a body [m]."""
    return float(np.ptp(frame.positions[name][:, 1]))


def stitch_lengths(frame: Frame) -> NDArray[np.float64]:
    """(k,) distances from stitched vertices to the centers of the triangles that they are stitched to [m]."""
    x, nodes = frame.state.positions, frame.system.stitching.tets.vertices
    return np.linalg.norm(x[nodes[:, 0]] - x[nodes[:, 1:]].mean(axis=1), axis=1)
