"""Three bodies, three compliances, one floor."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement, height
from supple.materials.elastic import EdgesAndVolume
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.scene import Scene
from supple.solvers.xpbd.solver import XPBD

RADIUS = 0.4
KINDS = {
    "stiff": EdgesAndVolume(edge_compliance=2e-5, volume_compliance=0.0, damping=0.01),
    "medium": EdgesAndVolume(edge_compliance=2e-4, volume_compliance=0.0, damping=0.003),
    "soft": EdgesAndVolume(edge_compliance=8e-4, volume_compliance=0.0, damping=0.0005),
}


def scene() -> Scene:
    """Three spheres of radius 0.4 m, dropped from 0.6 m; only the compliance of their edges differs."""
    mesh = shapes.sphere(radius=RADIUS, edge_length=0.11)
    bodies = [
        Body(name, mesh, material, position=(1.3 * (i - 1), RADIUS + 0.6, 0.0), friction=0.3)
        for i, (name, material) in enumerate(KINDS.items())
    ]
    return Scene(bodies=bodies, obstacles=[HalfSpace(name="floor", friction=0.5)])


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        return {name: height(frame, name) / (2 * RADIUS) for name in KINDS}

    def claims(self) -> list[Claim]:
        lowest = {name: min(self.series[name]) for name in KINDS}
        soft = self.series["soft"]
        rebound = max(soft[int(np.argmin(soft)) :])
        speed = _speed_of_deformation(self.last, "stiff")
        return [
            Claim(
                "the more compliant, the flatter on impact",
                ", ".join(f"{name} {100 * low:.0f} % of its height" for name, low in lowest.items()),
                lowest["stiff"] > lowest["medium"] > lowest["soft"],
            ),
            Claim(
                "the soft one collapses below 60 % of its height and springs back above 85 %",
                f"{100 * lowest['soft']:.0f} %, then {100 * rebound:.0f} %",
                lowest["soft"] < 0.60 and rebound > 0.85,
            ),
            Claim(
                "the stiff one stops deforming (below 0.05 m/s, beside its rolling)", f"{speed:.4f} m/s", speed < 0.05
            ),
        ]


def _speed_of_deformation(frame: Frame, name: str) -> float:
    """The largest speed of a body's vertices beside that of its rigid motion [m/s]."""
    part = next(part for part in frame.system.bodies if part.name == name)
    masses, x, v = frame.system.masses[part.vertices], frame.positions[name], frame.velocities[name]
    r, u = x - masses @ x / masses.sum(), v - masses @ v / masses.sum()
    inertia = masses @ np.einsum("ij,ij->i", r, r) * np.eye(3) - np.einsum("i,ij,ik->jk", masses, r, r)
    spin = np.linalg.solve(inertia, masses @ np.cross(r, u))
    return float(np.linalg.norm(u - np.cross(spin, r), axis=1).max())


COMPLIANCE = Demo(
    name="compliance",
    summary="three compliances on one floor: one collapses and springs back, one stops deforming",
    explanation=(
        "Three balls of the same mesh and mass fall on a floor. Only the compliance of their edges differs "
        "(2e-5, 2e-4 and 8e-4 m/N); the volume constraints are rigid in all three and push the collapsed ball up again."
    ),
    scene=scene,
    solvers={"xpbd": lambda: XPBD(substeps=40)},
    measurement=_Measurement,
    steps=300,
)
