"""A torture scene in several sizes, and the claims that all torture scenes share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from supple.demos.demo import Claim, Demo, Measurement
from supple.simulate import Frame
from supple.state import Status


@dataclass(frozen=True)
class Torture:
    """A scene in several sizes.

    Attributes
    ----------
    small : for `make test`; full : the demo
    large : about 20,000 tets, for benchmarks; None where no benchmark uses the scene
    """

    small: Demo
    full: Demo
    large: Demo | None = None


class ContactMeasurement(Measurement):
    """Claims that every step converges, no tet inverts and no surfaces touch, and what the scene itself claims.

    Attributes
    ----------
    min_J, nearest : smallest det F and distance [m] of all frames
    """

    def begin(self, first: Frame, dt: float, steps: int) -> None:
        super().begin(first, dt, steps)
        self.dt, self.steps, self.frames = dt, steps, 0
        self.min_J = self.nearest = np.inf
        self.statuses: dict[Status, int] = {}
        self.iterations = 0
        self.problem = ""

    def write(self, frame: Frame) -> None:
        super().write(frame)
        self.frames += 1
        report = frame.report
        self.statuses[report.status] = self.statuses.get(report.status, 0) + 1
        self.iterations += report.iterations
        self.min_J = min(self.min_J, report.min_det_F)
        if report.min_distance is not None:
            self.nearest = min(self.nearest, report.min_distance)
        if report.status is not Status.CONVERGED:
            self.problem = f"; at {frame.time:.4g} s: {report.message}"

    def claims(self) -> list[Claim]:
        gap = (
            f"smallest distance {1e3 * self.nearest:.3g} mm"
            if np.isfinite(self.nearest)
            else "no surfaces came near each other"
        )
        ends = ", ".join(f"{count} {status}" for status, count in self.statuses.items())
        return [
            Claim(
                f"all {self.steps} steps converge",
                f"{ends}, {self.iterations / max(self.frames, 1):.1f} iterations each{self.problem}",
                self.frames == self.steps and set(self.statuses) == {Status.CONVERGED},
            ),
            Claim("no tetrahedron inverts", f"smallest det F {self.min_J:.3g}", self.min_J > 0.0),
            Claim("no surfaces touch", gap, self.nearest > 0.0),
            *self.own_claims(),
        ]

    def own_claims(self) -> list[Claim]:
        """The claims of this scene only."""
        return []


def mechanical_energy(frame: Frame) -> float:
    """Kinetic, elastic and potential energy [J]. The energy of barriers, which is never negative, is left out."""
    report = frame.report
    return report.kinetic_energy + report.elastic_energy + report.potential_energy


def center(frame: Frame, name: str) -> np.ndarray:
    """(3,) the center of mass of a body [m]."""
    part = next(part for part in frame.system.bodies if part.name == name)
    m = frame.system.masses[part.vertices]
    return m @ frame.positions[name] / m.sum()


def mass(frame: Frame, name: str) -> float:
    """The mass of a body [kg]."""
    part = next(part for part in frame.system.bodies if part.name == name)
    return float(frame.system.masses[part.vertices].sum())
