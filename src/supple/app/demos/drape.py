"""A cloth falls over a ball and a bear."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement, body_range, meetings
from supple.materials.elastic import StableNeoHookean
from supple.materials.shells.shell_material import ShellMaterial
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.results.recording.thin_cells import ratios_of
from supple.scene.body import Body
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.obstacles.sphere import Sphere
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.scene.shell import Shell
from supple.solvers.implicit.solver import Implicit

SIDE, HEIGHT, RADIUS, G = 0.3, 0.12, 0.05, 9.81


def scene() -> Scene:
    """A cloth of 30 cm and 1.5 mm above a ball that stands still, and a soft bear of 12 cm whose feet are held."""
    cloth = ShellMaterial(youngs=1e5, poisson=0.3, thickness=1.5e-3, density=300.0, damping=0.01)
    gummy = StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0, damping=0.02)
    bear = shapes.gummy_bear(height=HEIGHT, edge_length=HEIGHT / 7)
    skin = shapes.gummy_bear_surface(height=HEIGHT, resolution=16)
    low = min(skin.bounds[0][1], float(bear.vertices[:, 1].min()))
    feet = np.flatnonzero(bear.vertices[:, 1] < low + 0.15 * HEIGHT)
    bodies = [
        Shell("cloth", shapes.sheet(SIDE, SIDE, SIDE / 16), cloth, position=(0, HEIGHT + 0.02, 0), friction=0.5),
        Body(
            "bear",
            bear,
            gummy,
            position=(0.06, 5e-4 - low, 0),
            friction=0.5,
            skin=skin,
            collide="skin",
            look="gummy",
        ),
    ]
    ball = Sphere(name="ball", center=(-0.06, RADIUS, 0), radius=RADIUS, friction=0.5)
    return Scene(bodies, obstacles=[HalfSpace(name="floor", friction=0.5), ball], pins=[Pin("bear", feet)])


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        ratios = ratios_of(body_range(frame, "cloth"), frame.positions["cloth"])
        return {"meetings": meetings(frame), "ratios": (float(ratios.min()), float(ratios.max()))}

    def claims(self) -> list[Claim]:
        v = self.last.velocities["cloth"]
        speed = float(np.sqrt((v * v).sum(axis=1).mean()))
        low, high = min(low for low, _ in self.series["ratios"]), max(high for _, high in self.series["ratios"])
        contacts, carried = self.last.contacts, np.zeros(3)
        if contacts is not None:
            carried = sum((contacts.force_between("cloth", name) for name in ("bear", "ball", "floor")), carried)
        weight = self.last.system.scene.bodies[0].lumped_masses().sum() * G
        off = float(np.abs(carried - [0.0, weight, 0.0]).max()) / weight
        return [
            self.nothing_crosses(),
            Claim("the cloth comes to rest (mean speed below 1 cm/s)", f"{100 * speed:.2g} cm/s", speed < 0.01),
            Claim(
                "bear, ball and floor carry its weight within 2 %",
                f"{carried[1]:.4f} N of {weight:.4f} N, largest difference {100 * off:.2g} %",
                off < 0.02,
            ),
            Claim(
                "no triangle of it changes its area by more than 20 %",
                f"ratios of areas from {low:.3f} to {high:.3f}",
                low > 0.8 and high < 1.2,
            ),
        ]


DRAPE = Demo(
    name="drape",
    summary="a cloth falls over a ball and a bear",
    explanation=(
        "A cloth falls on a ball and on a gummy bear, slides, folds and comes to rest on both and on the floor. It is "
        "a shell: triangles that stretch and bend, and touch on both sides, half their thickness away. The bear is "
        "soft and yields; it touches with its skin. Exact tests of each frame show that all surfaces stay apart."
    ),
    scene=scene,
    solvers={"implicit": Implicit},
    measurement=_Measurement,
    steps=75,
)
