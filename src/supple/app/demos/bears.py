"""A heap of gummy bears falling into a bowl."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement, volume
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.obstacles.sphere import Sphere
from supple.scene.scene import Scene
from supple.solvers.xpbd.solver import XPBD

HEIGHT = 0.1
BOWL = 0.22
LAYERS, PER_LAYER = 3, 4


def scene() -> Scene:
    """Twelve bears, 10 cm tall, in three layers above the bottom of a round bowl."""
    mesh = shapes.gummy_bear(height=HEIGHT, edge_length=0.013)
    skin = shapes.gummy_bear_surface(height=HEIGHT, resolution=40)
    material = StableNeoHookean(youngs=3e4, poisson=0.45, density=1100.0, damping=0.01)
    generator = np.random.default_rng(7)
    bodies = []
    for layer in range(LAYERS):
        for k in range(PER_LAYER):
            angle = 2 * np.pi * (k + 0.5 * layer) / PER_LAYER
            place = (0.06 * np.cos(angle), 0.08 + 0.115 * layer, 0.06 * np.sin(angle))
            bodies.append(
                Body(
                    f"bear{len(bodies) + 1:02d}",
                    mesh,
                    material,
                    position=place,
                    rotation=generator.normal(scale=0.15, size=3),
                    friction=0.4,
                    skin=skin,
                    look="gummy",
                )
            )
    return Scene(
        bodies=bodies, obstacles=[Sphere(name="bowl", center=(0, BOWL, 0), radius=BOWL, inside=True, friction=0.4)]
    )


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        reach = np.linalg.norm(frame.state.positions - [0.0, BOWL, 0.0], axis=1).max() - BOWL
        return {"outside": float(reach)}

    def claims(self) -> list[Claim]:
        outside = max(0.0, *self.series["outside"])
        ratios = [volume(self.last, name) / volume(self.first, name) for name in self.first.positions]
        v = self.last.state.velocities
        speed = float(np.sqrt(2.0 * self.last.report.kinetic_energy / self.last.system.masses.sum()))
        return [
            Claim(
                "no vertex leaves the bowl by more than 1 mm",
                f"furthest {1e3 * outside:.3f} mm beyond its wall",
                outside <= 1e-3,
            ),
            Claim(
                "every bear keeps its volume within 5 %",
                f"volume ratios from {min(ratios):.3f} to {max(ratios):.3f}",
                min(ratios) >= 0.95 and max(ratios) <= 1.05,
            ),
            Claim(
                "the heap comes to rest (mean speed below 2 cm/s)",
                f"{100 * speed:.2f} cm/s, fastest vertex {100 * float(np.linalg.norm(v, axis=1).max()):.1f} cm/s",
                speed <= 0.02,
            ),
        ]


BEARS = Demo(
    name="bears",
    summary="a heap of gummy bears falling into a bowl",
    explanation=(
        "Twelve gummy bears (E = 30 kPa, nu = 0.45) fall into a bowl and on each other: body against body and "
        "bowl, with friction. The page draws a finer skin, embedded in the coarse tetrahedra that are simulated."
    ),
    scene=scene,
    solvers={"xpbd": lambda: XPBD(accuracy=0.1)},
    measurement=_Measurement,
    steps=180,
)
