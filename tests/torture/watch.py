"""A torture scene in several sizes, and the claims that all torture scenes share."""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement, body_range
from supple.model.state import Status
from supple.results.frame import Frame
from supple.scene.scene import Scene
from supple.solvers.implicit.solver import Implicit


@dataclass(frozen=True)
class Torture:
    """A scene in several sizes.

    Attributes
    ----------
    small : for `make test`; full : for `make test-all`
    large : about 20,000 tets, for benchmarks; None where no benchmark uses the scene
    """

    small: Demo
    full: Demo
    large: Demo | None = None


class Size(NamedTuple):
    """The arguments of a scene's function, the time from frame to frame [s], and the number of frames."""

    arguments: tuple[Any, ...]
    dt: float
    steps: int


def torture(
    name: str,
    summary: str,
    explanation: str,
    scene: Callable[..., Scene],
    measurement: Callable[[], Measurement],
    small: Size,
    full: Size,
    large: Size | None = None,
    solver: Callable[[], Implicit] = Implicit,
) -> Torture:
    """The same demo in all sizes; the parameters are those of `Demo` and `Torture`."""

    def demo(size: Size) -> Demo:
        made, solvers = partial(scene, *size.arguments), {"implicit": solver}
        return Demo(f"torture-{name}", summary, explanation, made, solvers, measurement, size.steps, size.dt)

    return Torture(demo(small), demo(full), demo(large) if large is not None else None)


class ContactMeasurement(Measurement):
    """Claims that every step converges, no tet inverts and no surfaces touch, and what the scene itself claims."""

    def begin(self, first: Frame, dt: float, steps: int) -> None:
        super().begin(first, dt, steps)
        self.problem = ""

    def write(self, frame: Frame) -> None:
        super().write(frame)
        report = frame.report
        if report.min_distance is not None:
            self.series["distance"].append(report.min_distance)
        if report.status is not Status.CONVERGED:
            self.problem = f"; at {frame.time:.4g} s: {report.message}"

    def claims(self) -> list[Claim]:
        nearest = min(self.series["distance"], default=np.inf)
        near = f"smallest distance {1e3 * nearest:.3g} mm" if nearest < np.inf else "no surfaces came near each other"
        frames = self.statuses.total()
        return [
            Claim(
                f"all {self.steps} steps converge",
                f"{self.endings}, {self.iterations / frames:.1f} iterations each{self.problem}",
                frames == self.steps and self.every_step_converged,
            ),
            self.no_tet_inverts(),
            Claim("no surfaces touch", near, nearest > 0.0),
            *self.own_claims(),
        ]

    @abstractmethod
    def own_claims(self) -> list[Claim]:
        """The claims of this scene only."""


def mechanical_energy(frame: Frame) -> float:
    """Kinetic, elastic and potential energy [J]. The energy of barriers, which is never negative, is left out."""
    report = frame.report
    return report.kinetic_energy + report.elastic_energy + report.potential_energy


def center(frame: Frame, name: str) -> np.ndarray:
    """(3,) the center of mass of a body [m]."""
    m = frame.system.masses[body_range(frame, name).vertices]
    return m @ frame.positions[name] / m.sum()


def mass(frame: Frame, name: str) -> float:
    """The mass of a body [kg]."""
    return float(frame.system.masses[body_range(frame, name).vertices].sum())


def push(frame: Frame, on: str, by: str) -> float:
    """The upward normal force on one body or obstacle by another [N]."""
    contacts = frame.contacts
    return float(contacts.force_between(on, by)[1]) if contacts is not None else 0.0
